"""flight report of bags: one page of what ran, seen in space and over time, with its verdicts."""

import json
import webbrowser
from pathlib import Path

from flight_graph.cli.show import add, console, number, status, steps
from flight_graph.cli.trust import asked, once
from flight_graph.errors import FlightError

MOST_TOLD = 12  # metrics that differ


def report_bags(bags: list[Path], html: Path | None, verify: bool, show: bool, trust: bool, as_json: bool) -> None:
    """Write the page of some bags and say where it is."""
    from flight_graph.bags.errors import quoted
    from flight_graph.plots.names import beside, run_names
    from flight_graph.reports import bag_figures, bag_page, page
    if len(bags) > bag_page.MOST_BAGS:
        raise FlightError(f"{len(bags)} bags are too many for one page; allowed: {bag_page.MOST_BAGS} on one axis")
    consent, names, runs = once(asked(trust)), run_names(bags), []
    path = html or beside(bags[0], ".html" if len(bags) == 1 else "_compared.html", "--html")
    with steps("report", not as_json) as advance:
        for bag, name in zip(bags, names):
            advance(0, None, f"reading {bag}")
            runs.append(bag_page.read_run(bag, name, consent))
        for run in runs if verify else ():
            run.verified = _verified(run, trust, advance)
        made = bag_page.page(runs, consent, advance)
    page.write(path, *made)
    if as_json:
        print(json.dumps({"page": str(path), "bags": [
            {"bag": str(run.bag.path), "scenario": run.lines.data.get("name"), "digest": bag_figures.digest(run.bag),
             "verified": run.verified or None, "metrics": run.metrics, "left_out": run.why or None} for run in runs]}))
    else:
        for run in runs:
            if run.why:
                status(f"{run.name}: metrics, requirements and claims are left out: {run.why}")
        if len(runs) > 1:
            _tell_differences(runs)
        print(path)
    if show and not webbrowser.open(path.resolve().as_uri()):
        status(f"there is no browser here that opens it; open {quoted(path)} in one")


def _tell_differences(runs) -> None:
    """The metrics that differ, of each run: those that matter, then those that differ most."""
    from rich.table import Table

    from flight_graph.graphs import glossary
    names = dict.fromkeys(name for run in runs for name in run.metrics)
    shown = {name: [number(run.metrics.get(name)) for run in runs] for name in names}
    known = glossary.joined(run.glossary for run in runs)
    differing = sorted((name for name, cells in shown.items() if len(set(cells)) > 1), key=lambda name: (
        not known.entry(name).headline, -_apart([run.metrics.get(name) for run in runs])))
    told = differing[:MOST_TOLD]
    table = Table("metric", "unit", *(run.name for run in runs), title="what differs", title_justify="left")
    for name in told:
        add(table, name, known.entry(name).unit, *shown[name])
    if told:
        console.print(table)
    if more := len(differing) - len(told):
        console.print(f"{more} more metrics differ, by less; the page has all of them")
    elif not differing and shown:
        console.print("no metric differs")


def _apart(values) -> float:
    """How far apart values are, over the largest of them; 1 where not all are numbers."""
    if not all(isinstance(value, (int, float)) for value in values):
        return 1.0
    return (max(values) - min(values)) / max(map(abs, values), default=1.0) if any(values) else 0.0


def _verified(run, trust, advance) -> str:
    """What running a bag again gave, in words."""
    from flight_graph.replays.verify import verify
    try:
        found = verify(run.bag.path, trust=trust, progress=lambda seconds, total: advance(
            seconds, total, f"running {run.name} again, s simulated"))
    except FlightError as error:
        return f"no: {error}"
    return "; ".join(dict.fromkeys(found.sentences)) or found.verdict
