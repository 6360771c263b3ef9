"""Runs of the lander's scenarios, each made once a session."""

import pytest

from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate


@pytest.fixture(scope="session")
def fly():
    """fly(scenario, overrides) -> (metrics, recording), in process."""
    made = {}

    def run(name, **changes):
        changes = {key.replace("__", "."): value for key, value in changes.items()}
        key = name, repr(sorted(changes.items()))
        if key not in made:
            scenario = load(name, changes)
            recording = simulate(scenario)
            made[key] = metrics.compute(scenario, recording), recording
        return made[key]

    return run
