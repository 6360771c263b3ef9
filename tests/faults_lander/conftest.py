"""Runs of the scenario with faults, each made once a session."""

import numpy as np
import pytest

from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.runs import simulate
from papers.lander.metrics import compute, seconds

NEVER = "star_tracker.measured.quaternion[3] > 2"  # a condition that never holds


class Run:
    """A run: its metrics and those of a landing, its tracks, and their rows at a time [s]."""

    def __init__(self, scenario):
        self.scenario, self.recording = scenario, simulate(scenario)
        self.metrics = metrics.compute(scenario, self.recording)
        self.landing = compute(scenario, self.recording)

    def __getitem__(self, topic):
        return self.recording[topic]

    def times(self, topic):
        """The stamps of a topic [s]."""
        return seconds(self[topic], self.scenario)

    def at(self, topic, time):
        """The last row at or before a time [s]."""
        return self[topic][np.searchsorted(self.times(topic), time + 1e-6) - 1]

    def errors(self, rows=slice(None)):
        """Position (n, 3) [m] of the estimate less the truth."""
        estimate, truth = self["lander/odom"], self["lander/truth/odom"]
        return estimate["pose"]["pose"]["position"][rows] - truth["pose"]["pose"]["position"][rows]


@pytest.fixture(scope="session")
def broken():
    """broken(at, type, **keys of the fault, changes={key: value}, more=[fault]) -> Run; broken() has no fault."""
    made = {}

    def run(at=None, kind=None, changes=None, more=(), **keys):
        values = {f"faults.fault.{key}": value for key, value in keys.items()}
        values |= {"faults.fault.when": NEVER} if at is None else {"faults.fault.at": at, "faults.fault.type": kind}
        values |= changes or {}
        key = repr((sorted(values.items()), more))
        if key not in made:
            scenario = load("lander_faults", values)
            if more:
                data = scenario.file.model_dump(by_alias=True, exclude_none=True)
                scenario = Scenario({**data, "faults": [*data["faults"], *more]}, scenario.origin, scenario.folder)
            made[key] = Run(scenario)
        return made[key]

    return run
