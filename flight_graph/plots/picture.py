"""A picture of bags: chosen quantities over time or over another one, under a title that says what ran, with its events.

No code of a bag runs.
"""

from pathlib import Path

from flight_graph.components.foreign import refuse
from flight_graph.errors import FlightError
from flight_graph.plots import over_time
from flight_graph.plots.bag_lines import BagLines
from flight_graph.plots.marks import marks
from flight_graph.plots.names import run_names
from flight_graph.recordings.bag_scenario import read_scenario
from flight_graph.recordings.what_ran import what_ran


def read(bags: list, names: list[str] | None = None) -> list[BagLines]:
    """Bags under these names, by default ones that tell them apart. Raises FlightError."""
    return [BagLines(bag, name) for bag, name in zip(bags, names or run_names(bags))]


def draw(runs: list[BagLines], fields: list[str], path: Path, over: str | None = None, begin: float | None = None,
         end: float | None = None) -> tuple[Path, list[str]]:
    """Write the picture of some runs; return it, and sentences on what it does not show. Raises FlightError.

    fields: ``TOPIC.FIELD``, or ``TOPIC.FIELD - TOPIC.FIELD`` for a difference, a panel each; none: the first numbers that
    change. over: the field on the horizontal axis, in place of time. begin, end: the times [s] that are drawn.
    """
    panels = over_time.panels(runs, fields) if fields else over_time.first_panels(runs)
    axis = over_time.panels(runs, [over]) if over else None
    events = sorted({mark for run in runs for mark in marks(run)[0]}) if axis is None else []
    path, thinned = over_time.draw(panels, path, title(runs), axis, begin, end, events)
    notes = [f"{thinned} messages of a topic are more than a picture shows: the extremes of each stretch are drawn"] if (
        thinned) else []
    return path, notes + [f"not read: {topic}: {why}" for run in runs for topic, why in run.problems.items()]


def title(runs: list[BagLines]) -> str:
    """What ran, with case, seed and settings of each run."""
    if len(runs) == 1:
        words = _words(runs[0], ": ")
        return f"{runs[0].data.get('title') or runs[0].name}" + (f"\n{words}" if words else "")
    titles = list(dict.fromkeys(str(run.data.get("title") or "") for run in runs))
    first = titles[0] if len(titles) == 1 and titles[0] else f"{len(runs)} runs"
    return "\n".join([first, "; ".join(f"{run.name}: {_words(run, ', ') or 'no scenario'}" for run in runs)])


def _words(run, between) -> str:
    """Name, case, seed and settings of a run."""
    if not run.data:
        return ""
    try:
        scenario = read_scenario(run.bag, refuse)
        words = what_ran(scenario).words(scenario.seed)
    except FlightError:
        words = f"seed {run.data.get('seed', '?')}"
    return f"{run.data.get('name', '')}{between}{words}"
