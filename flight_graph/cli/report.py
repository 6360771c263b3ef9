"""flight report: what bags show and what a campaign says, as a page, as tables, or for a machine."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.bag_report import report_bags
from flight_graph.cli.report_tables import comparison_tables, overview_tables, sensitivity_tables, worst_tables
from flight_graph.cli.scenarios import Json
from flight_graph.cli.show import console, next_command, steps, working
from flight_graph.cli.trust import Trust
from flight_graph.cli.trust import asked as consent_of
from flight_graph.errors import FlightError

Metrics = Annotated[list[str] | None, typer.Option("--metric", metavar="METRIC", help="Only this metric; may be repeated.")]


def register(app: typer.Typer) -> None:
    app.command(epilog="Examples: flight report runs/cubli_asteroid-compiled-1; flight report runs/landings --worst "
                "lateral_m --sensitivity lateral_m")(report)


def report(
    folders: Annotated[list[Path], typer.Argument(
        metavar="BAG...|DIR", help="Bags, several beside each other; or the folder of a campaign, made by flight sweep.")],
    metrics: Metrics = None,
    confidence: Annotated[float, typer.Option(help="Of the two-sided intervals.")] = 0.95,
    share: Annotated[float, typer.Option(help="Share of all runs that the one-sided bound holds for.")] = 0.9973,
    share_confidence: Annotated[float, typer.Option(help="Confidence of that bound.")] = 0.9,
    sensitivity: Annotated[list[str] | None, typer.Option(
        metavar="METRIC", help="What of the draws decides this metric; may be repeated.")] = None,
    worst: Annotated[list[str] | None, typer.Option(
        metavar="METRIC", help="The cases with its largest values; may be repeated.")] = None,
    count: Annotated[int, typer.Option(min=1, max=1000, help="How many cases --worst shows.")] = 10,
    smallest: Annotated[bool, typer.Option("--smallest", help="--worst: the smallest values are the worst.")] = False,
    compare: Annotated[Path | None, typer.Option(
        metavar="DIR", help="Another campaign on the same draws: its values less those of this one, case by case.")] = None,
    between: Annotated[str | None, typer.Option(
        metavar="KEY|GROUP", help="Groups that differ in this key alone, on the same draws: each less the first; or all "
                                  "groups less this one.")] = None,
    pool: Annotated[bool, typer.Option("--pool", help="Put all combinations (variants, grid) together.")] = False,
    html: Annotated[Path | None, typer.Option(
        metavar="FILE", help="The page: one HTML file that needs nothing else. Of bags: beside the first.")] = None,
    verify: Annotated[bool, typer.Option("--verify", help="Of bags: run each again; the page says what came.")] = False,
    show: Annotated[bool, typer.Option("--open", help="Of bags: open the page in a browser.")] = False,
    flights: Annotated[int, typer.Option(
        min=0, max=10_000, help="--html: cases that are run again for the lines over time; 0: none.")] = 100,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """The page of bags: what ran, the vehicle in space, all topics, events, metrics, verdicts. Or what a campaign says.

    Of a campaign: rates and percentiles with their intervals; sensitivities, worst cases, a comparison; as a page (--html).
    Combinations are never put together unless --pool says so, and what is missing is counted. See docs/statistics.md.
    """
    from flight_graph.campaigns import paired
    from flight_graph.campaigns import report as reports
    from flight_graph.campaigns.folder import Campaign
    if not any(map(is_campaign, folders)):
        _only_of_campaigns({"--metric": metrics, "--sensitivity": sensitivity, "--worst": worst, "--compare": compare,
                            "--between": between, "--pool": pool, "--smallest": smallest})
        report_bags(folders, html, verify, show, trust, as_json)
        return
    if len(folders) > 1 or verify or show:
        raise FlightError(f"{' and '.join(map(str, folders))}: a campaign is reported by itself, without --verify and "
                          "--open; --compare DIR sets another one beside it")
    folder = folders[0]
    campaign = Campaign.at(folder)
    choices = reports.Choices(confidence, share, share_confidence, tuple(metrics or ()), pool)
    asked = bool(sensitivity or worst or compare or between is not None or html)
    if html is not None:
        _page(campaign, choices, html, flights, count, trust, as_json)
    with working(f"reading {folder}", not as_json):
        found = reports.report(campaign, choices) if as_json or not asked else None
        ranked = [reports.sensitivities(campaign, name, choices) for name in sensitivity or []]
        listed = [reports.worst(campaign, name, count, smallest, choices) for name in worst or []]
        compared = paired.compare(campaign, Campaign.at(compare), choices) if compare else None
        beside = paired.between(campaign, between, choices) if between is not None else None
    if as_json:
        print(json.dumps(found | {"sensitivities": [entry for groups in ranked for entry in groups], "worst": listed,
                                  "comparison": compared, "between": beside, "page": str(html) if html else None}))
        return
    tables = [*(overview_tables(found) if found else ()),
              *(table for groups in ranked for table in sensitivity_tables(groups)),
              *(table for entry in listed for table in worst_tables(entry, folder)),
              *(comparison_tables(compared) if compared else ()), *(comparison_tables(beside) if beside else ())]
    for table in tables:
        console.print(table, **({"markup": False} if isinstance(table, str) else {}))
    if not asked:
        next_command("report", folder, "--html", f"{folder}.html")


def is_campaign(path: Path) -> bool:
    """Whether a path is the folder of a campaign."""
    from flight_graph.campaigns.manifest import FILE
    return (path / FILE).is_file()


def _only_of_campaigns(given: dict) -> None:
    if named := [option for option, value in given.items() if value]:
        raise FlightError(f"{named[0]} goes with the folder of a campaign, and none of these is one")


def _page(campaign, choices, path, flights, worst, trust, as_json):
    """Write the campaign's page and say where it is."""
    from flight_graph.reports import campaign_page, page
    with steps(f"page of {campaign.manifest.name}", not as_json) as advance:
        made = campaign_page.page(campaign, choices, consent_of(trust), flights, worst,
                                  progress=lambda done, total: advance(done, total, "runs"))
    page.write(path, *made)
    if not as_json:
        print(path)
