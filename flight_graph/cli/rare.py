"""flight rare: the probability of a rare event, by subset simulation."""

import json
import shlex
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Json, Params, Settings, overrides
from flight_graph.cli.show import add, console, steps
from flight_graph.cli.trust import Trust, asked


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight rare lander_dispersed --metric lateral_m --above 1.0")(rare)


def rare(
    scenario: Annotated[str, typer.Argument(
        help="A scenario's name, or a YAML file, whose 'vary' block (or --vary) draws.")],
    metric: Annotated[str, typer.Option(help="The metric that tells how near a run is to the event.")],
    above: Annotated[float | None, typer.Option(help="The event: the metric is here or above.")] = None,
    below: Annotated[float | None, typer.Option(help="The event: the metric is here or below.")] = None,
    runs: Annotated[int, typer.Option(help="Runs of a level; a probability of 1e-6 takes six levels.")] = 1000,
    down_to: Annotated[float, typer.Option(help="Give up here: the probability is below it.")] = 1e-8,
    seed: Annotated[int, typer.Option(help="Of the samples.", min=0)] = 0,
    vary: Annotated[list[str] | None, typer.Option(
        metavar="KEY=VALUES", help="Draw plant.mass=normal:2,0.04 besides; may be repeated.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; one a core when left out.")] = None,
    confidence: Annotated[float, typer.Option(min=0.5, max=0.999, help="Of the interval.")] = 0.95,
    settings: Settings = None,
    params: Params = None,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """The probability that a metric passes a limit, where no campaign is large enough to see it: 1e-2 down to 1e-6.

    Says the coefficient of variation, an interval, and runs in which it happens. See docs/statistics.md.
    """
    from flight_graph.campaigns.opening import varied
    from flight_graph.campaigns.rare_events import Event, rare_event
    from flight_graph.sampling.specifications import Besides
    consent = asked(trust)
    event = Event(metric, above, below)
    given = overrides(scenario, settings, params, None, None, consent)
    loaded = varied(scenario, given, Besides(tuple(vary or ())), consent)
    with steps(f"{loaded.name}: {event.sentence()}", not as_json) as advance:
        found = rare_event(loaded, event, runs, seed, workers, confidence, down_to=down_to,
                           progress=lambda done, level, threshold: advance(done, runs * (level + 1), f"level {level + 1}"))
    if as_json:
        print(json.dumps(found.plain()))
        return
    for line in _shown(found, loaded.name, shlex.join([scenario, *(f"--set={word}" for word in settings or [])])):
        console.print(line, **({"markup": False} if isinstance(line, str) else {}))


def _shown(found, name, words):
    from rich.table import Table
    estimate = found.estimate
    table = Table("level", "limit", "probability", "variation", "accepted", title=f"{name}: {found.event.sentence()}",
                  title_justify="left")
    for number, level in enumerate(estimate.levels):
        add(table, number + 1, f"{found.event.towards(level.threshold):.6g}", f"{level.probability:.4g}",
            f"{level.variation:.3g}", "" if level.acceptance is None else f"{level.acceptance:.2f}")
    yield table
    if estimate.bound:
        yield f"the event was not reached: its probability is below about {estimate.probability:.2g} ({estimate.runs} runs)"
    else:
        yield (f"probability {estimate.probability:.4g}, coefficient of variation {estimate.variation:.2f}, "
               f"{100 * estimate.confidence:g} % interval {estimate.low:.3g} to {estimate.high:.3g}; {estimate.runs} runs")
    if estimate.missing:
        yield (f"note: {estimate.missing} runs gave no number ({found.stopped} did not end well); they count as the event")
    for run in found.runs[:1]:
        values = " ".join(f"--set {key}={json.dumps(value).replace(' ', '')}" for key, value in run["values"].items())
        yield f"one of them: flight run {words} {values}"
