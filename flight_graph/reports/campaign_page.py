"""The report of a campaign as a page: what succeeds, how it spreads, what decides it, where and when; the worst cases."""

from dataclasses import dataclass, field, replace

import numpy as np

from flight_graph.campaigns import report as numbers
from flight_graph.campaigns.fault_table import faults_of
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.values import Values
from flight_graph.components.foreign import Consent
from flight_graph.errors import FlightError
from flight_graph.graphs import glossary
from flight_graph.graphs.glossary import Glossary
from flight_graph.graphs.scenario import Scenario
from flight_graph.reports import campaign_figures as figures
from flight_graph.reports.flights import Flights, fly
from flight_graph.reports.page import Section

FLIGHTS, WORST = 100, 10  # cases that are run again for the funnels, and worst cases of each metric


@dataclass
class Subject:
    """A campaign and all that its page is made of. scenario: None where its code does not run here, ``why`` says the
    reason; glossary: units and meanings; ranked: name of a metric -> its sensitivities, once they were asked for."""

    campaign: Campaign
    choices: numbers.Choices
    values: Values
    found: dict
    scenario: Scenario | None
    why: str
    glossary: Glossary
    ranked: dict = field(default_factory=dict)

    @property
    def headlines(self) -> list[str]:
        """Names of the numbers that are drawn: those asked for, else those that are declared to matter, else the first."""
        known = {row["metric"] for group in self.found["groups"] for row in group["metrics"]}
        if self.choices.metrics:
            return [name for name in self.choices.metrics if name in known]
        declared = [name for name in self.values.metrics if name in known and self.glossary.entry(name).headline]
        return (declared or [name for name in self.values.metrics if name in known])[:figures.MOST_METRICS]

    def label(self, name: str) -> str:
        """Name and unit of a column."""
        column = self.values.columns.get(name)
        unit = column.unit if column is not None else ""
        return f"{name} [{unit}]" if unit not in ("", "1") else name

    def sensitivities(self, name: str) -> list[dict]:
        """What of the draws decides a metric, by group. Raises FlightError where nothing that is drawn is a number."""
        if name not in self.ranked:
            self.ranked[name] = numbers.sensitivities(self.campaign, name, self.choices)
        return self.ranked[name]

    def column(self, name: str) -> np.ndarray:
        """A column of numbers (n,)."""
        return next(self.values.read([name]))[1]


def subject(campaign: Campaign, choices: numbers.Choices, consent: Consent) -> Subject:
    """Read a campaign. consent: is asked before code of its scenario runs; where it refuses, or where the code is another,
    the page has no meanings, lines over time and ground, and says so. Raises FlightError."""
    scenario, why = None, ""
    try:
        scenario = campaign.manifest.load(consent)
        known = glossary.of(scenario)
    except FlightError as error:
        scenario, why, known = None, str(error), Glossary({}, is_declared=False)
    values, found = Values(campaign, choices.pool), numbers.report(campaign, choices)
    return Subject(campaign, choices, values, found, scenario, why, known)


def page(campaign: Campaign, choices: numbers.Choices, consent: Consent, flights: int = FLIGHTS, worst: int = WORST,
         jobs: int = 2, progress=None) -> tuple[str, str, list[Section]]:
    """Title, subtitle and sections. flights: how many cases are run again for the funnels over time, 0: none at all;
    worst: how many worst cases of each metric; progress(done, total). Raises FlightError."""
    about = subject(campaign, choices, consent)
    together = replace(choices, pool=True) if len(about.values.groups) > figures.MOST_GROUPS else choices
    listed = [numbers.worst(campaign, name, worst, about.glossary.entry(name).smallest_is_worst, together)
              for name in about.headlines]
    flown = None
    if about.scenario is not None and flights and about.glossary.traces:
        flown = _flown(about, listed, flights, jobs, progress)
    sections = [
        Section("Overview", figures.overview(about)),
        Section("Success", figures.success(about)),
        Section("Dispersion", figures.dispersions(about)),
        Section("All metrics", figures.all_metrics(about)),
        Section("Relations", figures.relations(about)),
        Section("Sensitivities", figures.sensitivities(about)),
        Section("Landing", figures.landings(about)),
        Section("Over time", figures.funnels(about, flown, flights)),
        Section("Worst cases", figures.worst_cases(about, listed, flown)),
        Section("Faults", figures.faults(faults_of(campaign))),
    ]
    manifest = campaign.manifest
    return (f"{manifest.name}: {manifest.scenario.get('title', '')}",
            f"Campaign {campaign.path.name}: {about.found['rows']} runs",
            [section for section in sections if section.parts])


def _flown(about: Subject, listed: list[dict], flights: int, jobs: int, progress) -> Flights:
    """The first cases, which are as good as any, and the worst ones."""
    first = about.values.cases[:flights].tolist()
    bad = [row["case"] for entry in listed for group in entry["groups"] for row in group["cases"]]
    cases = list(dict.fromkeys([*first, *bad[:figures.MOST_WORST_FLOWN]]))
    return fly(about.scenario, about.glossary.traces, cases, jobs, progress)
