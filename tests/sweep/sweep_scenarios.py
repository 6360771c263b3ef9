"""A small swept scenario, and a metric that is a digest of everything a run recorded."""

import hashlib

from flight_graph.graphs.scenario import Scenario
from tests.graph import toy

TOPICS = ("toy/truth", "toy/imu", "toy/command", "toy/watch")
RANDOM = {"random": {"plant.angle": {"uniform": [-0.5, 0.5], "size": 3}, "seed": {"count": 50}}, "runs": 12}


def swept(vary, **overrides):
    """The toy graph with a vary block."""
    data = toy.scenario(metrics="tests.sweep.sweep_scenarios:digest", duration_s=1.0)
    return Scenario({**data, "vary": vary, **overrides}, "toy.yaml")


def leaves(records):
    """The fields of a structured array without the constant bytes between them."""
    if records.dtype.names is None:
        yield records
    for name in records.dtype.names or ():
        yield from leaves(records[name])


def digest(scenario, signals) -> dict:
    """A 52-bit digest of the bytes of all recorded arrays, and the largest angle."""
    found = hashlib.sha256()
    for topic in TOPICS:
        for leaf in leaves(signals[topic]):
            found.update(leaf.tobytes())
    if scenario.graph.nodes["plant"].values["inertia"] == 3.0:
        raise ValueError("an inertia of 3 is not judged")
    return {"digest": int(found.hexdigest()[:13], 16), "angle": abs(signals["toy/truth"]["angle"]).max()}
