"""Metrics of the toy graph, declared."""

import numpy as np

from flight_graph.graphs.fault_scores import times
from flight_graph.graphs.glossary import flag, number, recorded

METRICS = (
    number("angle_max", "rad", "largest |angle| of any axis", headline=True),
    number("rate_max", "rad/s", "largest |rate| of any axis", headline=True),
    number("quiet_s", "s", "first time of a rate below 1e-3 rad/s on all axes", missing="it is never so quiet"),
    flag("swings", "some axis crosses zero", headline=True),
)
TRACES = (recorded("angle", "rad", "largest of the axes", "toy/truth", "angle", reduce="largest"),)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS."""
    truth = signals["toy/truth"]
    quiet = np.flatnonzero((np.abs(truth["rate"]) < 1e-3).all(axis=1) & (times(scenario, truth) > 0.0))
    return {"angle_max": float(np.abs(truth["angle"]).max()), "rate_max": float(np.abs(truth["rate"]).max()),
            "quiet_s": float(times(scenario, truth)[quiet[0]]) if len(quiet) else None,
            "swings": bool((truth["angle"][0] * truth["angle"] < 0.0).any())}
