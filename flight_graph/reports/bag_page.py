"""The report of bags as a page: what ran, the vehicle in space, all numbers over time, metrics, requirements, claims.

Of several bags the same series stand on one axis. What needs a scenario (metrics, names of modes) is left out, and said
so, where a bag carries none, or one whose code nobody has agreed to. Text of a bag is data: it is escaped by the page.
"""

from collections.abc import Callable
from dataclasses import dataclass

from flight_graph.bags.reader import Bag
from flight_graph.components.foreign import Consent, refuse
from flight_graph.errors import FlightError
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs.scenario import Scenario
from flight_graph.plots.bag_lines import BagLines
from flight_graph.plots.marks import Mark, marks
from flight_graph.recordings.bag_scenario import SCENARIO, read_scenario
from flight_graph.recordings.recording import BagSignals
from flight_graph.recordings.what_ran import what_ran
from flight_graph.reports import bag_figures as figures
from flight_graph.reports import space, verdicts
from flight_graph.reports.page import Fold, Section, Table

MOST_BAGS = 6  # on one axis: as many as there are colours


@dataclass
class Run:
    """One bag of a report. scenario: None where there is none that may run, ``why`` says the reason; verified: what running
    it again gave, "" where nobody asked; metrics: by name, of the scenario's."""

    lines: BagLines
    scenario: Scenario | None
    why: str
    marks: list[Mark]
    all_marks: int
    metrics: dict
    glossary: glossary.Glossary
    verified: str = ""

    @property
    def name(self) -> str:
        return self.lines.name

    @property
    def signals(self) -> BagSignals:
        return BagSignals(self.bag, self.scenario)

    @property
    def bag(self) -> Bag:
        return self.lines.bag


def read_run(path, name: str, consent: Consent) -> Run:
    """Read a bag and what can be known of it. Raises FlightError where it is no bag, or damaged."""
    lines = BagLines(path, name)
    scenario, why = _scenario(lines.bag, consent)
    known, found = glossary.Glossary({}, is_declared=False), {}
    if scenario is not None and not why:
        try:
            known = glossary.of(scenario)
            found = metrics.compute(scenario, BagSignals(lines.bag, scenario))
        except FlightError as error:
            why = str(error)
        except KeyError as error:
            why = f"its topics are not those of its scenario: {error.args[0]} is missing"
    events, count = marks(lines, modes_of(scenario))
    return Run(lines, scenario, why, events, count, found, known)


def _scenario(bag, consent) -> tuple[Scenario | None, str]:
    """The scenario of a bag, and why it or its metrics may not run; "" where they may."""
    if SCENARIO not in bag.attachments:
        return None, "the bag carries no scenario"
    try:
        return read_scenario(bag, consent, ("metrics",)), ""
    except FlightError as error:
        why = str(error)
    try:
        return read_scenario(bag, refuse), why
    except FlightError:
        return None, why


def modes_of(scenario: Scenario | None) -> dict[str, tuple[str, ...]]:
    """Topic -> names of the modes that it reports by number."""
    if scenario is None:
        return {}
    return {f"/{node.component.outputs['mode'].topic}": tuple(node.component.modes)
            for node in scenario.graph.nodes.values()
            if getattr(node.component, "modes", ()) and "mode" in node.component.outputs}


def page(runs: list[Run], trust=False, progress: Callable | None = None) -> tuple[str, str, list[Section]]:
    """Title, subtitle and sections. progress(done, total, what). Raises FlightError."""
    topics = list(dict.fromkeys(topic for run in runs for topic in run.lines.topics))
    total, first = len(topics) + 2, runs[0]

    def tell(done, what):
        if progress:
            progress(done, total, what)

    tell(0, "the vehicle")
    seen = _in_space(runs, trust)
    folds = []
    for number, topic in enumerate(topics):
        tell(1 + number, topic)
        folds += figures.topic(runs, topic)
    tell(total - 1, "verdicts")
    shown = [part for part in folds if isinstance(part, Fold)]
    for fold in shown[:figures.OPEN_TOPICS]:
        fold.is_open = True
    sections = [
        Section("What ran", figures.overview(runs)),
        Section("In space", seen),
        Section("At a glance", figures.glance(runs)),
        Section("Events", figures.events(runs)),
        Section("Metrics", figures.metric_table(runs)),
        Section("Requirements", verdicts.requirements(runs)),
        Section("Claims", verdicts.claims(runs)),
        Section("All topics", [*folds, *figures.not_drawn(runs)]),
    ]
    data = first.lines.data
    names = dict.fromkeys(str(run.lines.data.get("title") or run.name) for run in runs)
    title = next(iter(names)) if len(names) == 1 else f"{len(runs)} runs side by side"
    words = "" if first.scenario is None else what_ran(first.scenario).words(first.scenario.seed)
    subtitle = ", ".join([str(data.get("name") or first.name), words] if words and len(runs) == 1 else
                         [run.name for run in runs])
    return title, subtitle, [section for section in sections if section.parts]


def _in_space(runs, trust) -> list:
    """The first bag that can be seen, and of the others why not."""
    parts = []
    for run in runs:
        try:
            made = space.view(run.lines, trust)
        except FlightError as error:
            parts.append(f"{run.name}: {error}")
            continue
        made.title = f"{made.title}: {run.name}" if len(runs) > 1 else made.title
        parts.append(made)
    return parts if any(not isinstance(part, str) for part in parts) or len(runs) == 1 else [Table(
        "Nothing to see", ["bag", "why"], [part.split(": ", 1) for part in parts])]
