"""A small swept scenario, and a metric that is a digest of everything a run recorded."""

import hashlib

import yaml

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


def patchy(scenario, signals) -> dict:
    """Metrics that some runs do not have, by the seed: absent, None, NaN, infinity; the topic that is read differs too."""
    seed, command = scenario.seed, signals["toy/command" if scenario.seed % 2 else "toy/truth"]
    found = {"always": float(seed), "whole": seed if seed % 3 else 0.5, "count": len(command), "flag": seed % 2 == 0}
    if seed % 4:
        found["sometimes"] = {1: 1.0, 2: None, 3: float("nan")}[seed % 4]
    found["unbounded"] = float("inf") if seed == 53 else -float(seed)
    return found


def campaign_file(path, vary=None, **overrides):
    """The toy's scenario with a vary block as a YAML file."""
    data = swept(vary or RANDOM, **overrides).file.model_dump(by_alias=True, exclude_none=True)
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path
