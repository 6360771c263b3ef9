"""flight plot: pictures of bags and campaigns."""

import os
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.bags import tell_unchecked
from flight_graph.cli.report import is_campaign
from flight_graph.cli.show import add, console, status, working
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

MOST_SOURCES = 9  # as many as there are colours


def register(app: typer.Typer) -> None:
    app.command(epilog="Examples: flight plot runs/a runs/b /cubli/truth.angles; flight plot runs/gains settling_time_s "
                "--over controller.lambda_a")(plot)


def plot(
    what: Annotated[list[str], typer.Argument(
        metavar="BAG...|DIR... [FIELD...]", help="Bags, then fields of them (TOPIC.FIELD, one panel each); or folders of "
        "campaigns, then metrics.")],
    out: Annotated[Path | None, typer.Option(
        help="The picture to write (.png, .svg or .pdf); beside the first bag when left out.")] = None,
    over: Annotated[str | None, typer.Option(
        metavar="FIELD", help="What stands on the horizontal axis in place of time; of campaigns what was varied, in place "
        "of how often a value came.")] = None,
    begin: Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Of bags: from this time on.")] = None,
    end: Annotated[float | None, typer.Option("--until", metavar="SECONDS", help="Of bags: until this time.")] = None,
    fields: Annotated[bool, typer.Option("--fields", help="List what can be plotted, and draw nothing.")] = False,
    vehicle: Annotated[str | None, typer.Option(help="Of a graph of several, the one that is drawn: rover_a.")] = None,
    trust: Trust = False,
) -> None:
    """Draw any field of any bag, several bags over each other, or the metrics of campaigns.

    One bag without fields is drawn as its scenario says, or, where it says nothing, by the first numbers that change.
    """
    sources, names = _sorted(what)
    if all(map(is_campaign, sources)):
        _of_campaigns(sources, names, over, out, fields, begin is not None or end is not None)
        return
    if odd := [path for path in sources if is_campaign(path)]:
        raise FlightError(f"{odd[0]} is the folder of a campaign, the others are bags; draw them apart")
    for name, value in (("--from", begin), ("--until", end)):
        if value is not None and not abs(value) < 1e12:
            raise FlightError(f"{name} {value}: this is no time")
    _of_bags(sources, names, over, out, fields, (begin, end), vehicle, trust)


def _sorted(what: list[str]) -> tuple[list[Path], list[str]]:
    """The files and folders first, then the names of fields. Raises FlightError."""
    count = next((number for number, word in enumerate(what) if not os.path.lexists(word)), len(what))
    if count == 0:
        raise FlightError(f"there is no bag at '{what[0]}', and no campaign")
    if late := [word for word in what[count:] if os.path.lexists(word) and not word.startswith("/")]:
        raise FlightError(f"'{late[0]}' is a file behind a field ('{what[count]}'), or '{what[count]}' is a bag that is "
                          "not there; name bags first, then fields")
    if count > MOST_SOURCES:
        raise FlightError(f"{count} bags are too many for one picture; allowed: {MOST_SOURCES}")
    return [Path(word) for word in what[:count]], what[count:]


def _of_bags(bags, names, over, out, list_fields, window, vehicle, trust):
    from flight_graph.plots import picture, style
    from flight_graph.plots.names import beside
    with working(f"reading {', '.join(map(str, bags))}", True):
        runs = picture.read(bags)
    tell_unchecked(*(run.bag for run in runs))
    for run in runs:
        if run.odd_scenario:
            status(run.odd_scenario)
    if list_fields:
        _list(runs)
        return
    path = style.check_format(out or beside(bags[0], f"-{vehicle}.png" if vehicle else ".png"))
    plain = not names and len(runs) == 1 and over is None and window == (None, None)
    if vehicle and not plain:
        raise FlightError("--vehicle draws one bag as the vehicle's scenario says; of chosen fields and of several bags "
                          f"name the vehicle's topics: /{vehicle}/...")
    if vehicle or (plain and runs[0].data.get("figure")):
        print(_as_the_scenario_says(runs[0].bag.path, trust, path, vehicle))
        return
    with working(f"drawing {path}", True):
        path, notes = picture.draw(runs, names, path, over, *window)
    for note in notes:
        status(note)
    print(path)


def _as_the_scenario_says(bag, trust, path, vehicle):
    from flight_graph.graphs.metrics import vehicle_of
    from flight_graph.recordings.figure import draw_overview
    from flight_graph.recordings.recording import open_run
    _, scenario, signals = open_run(bag, asked(trust), ("figure",))
    if vehicle:
        scenario, signals = vehicle_of(scenario, signals, vehicle)
    return draw_overview(scenario, signals, path)


def _list(runs):
    from rich.table import Table
    for run in runs:
        table = Table("field", "unit", "numbers", title=f"{run.name}: what flight plot takes", title_justify="left")
        for topic in run.topics:
            for series in run.series(topic):
                more = f"{series.lines[0].entry} to {series.lines[-1].entry}" if len(series.lines) > 1 else ""
                more += " (constant)" if series.is_constant else ""
                add(table, series.key, series.unit, more)
        console.print(table)
        for topic, why in run.problems.items():
            status(f"not read: {topic}: {why}")


def _of_campaigns(folders, names, over, out, list_fields, has_window):
    from flight_graph.campaigns.folder import Campaign
    from flight_graph.plots import style
    from flight_graph.plots.names import beside, run_names
    from flight_graph.reports import over_cases
    if has_window:
        raise FlightError("--from and --until are times of bags; a campaign has metrics")
    with working(f"reading {', '.join(map(str, folders))}", True):
        campaigns = [Campaign.at(folder) for folder in folders]
        if not list_fields:
            path = style.check_format(out or beside(folders[0], ".png"))
            print(over_cases.draw(campaigns, run_names(folders), names, over, path))
            return
    from rich.table import Table
    for campaign in campaigns:
        table = Table("name", "unit", "", title=f"{campaign.path}: what flight plot takes", title_justify="left")
        for column in campaign.columns():
            if column.kind in ("parameter", "metric"):
                add(table, column.name, column.unit, "varied: for --over" if column.kind == "parameter" else "metric")
        console.print(table)
