"""Runs of the scenario spacerobot_faults with one fault, in the compiled engine; each is flown once."""

from functools import cache

import numpy as np

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load

TRACK, HOLD, FREE = 0.0, 1.0, 2.0
PERIOD = 0.02  # [s]


@cache
def fly(at=None, type=None, over=(), **keys):
    """The recording of a run with a fault: its place, type and other keys; over: (key, value) of other settings."""
    given = {"faults.fault.at": at, "faults.fault.type": type, **{f"faults.fault.{key}": value for key, value in keys.items()}}
    return CompiledRun(load("spacerobot_faults", {**(given if at else {}), **dict(over)})).run()


def times(recording, topic):
    """Seconds since the start of the run."""
    stamp = recording[topic]["header"]["stamp"]
    return (stamp["sec"].astype(float) - stamp["sec"][0]) + (stamp["nanosec"].astype(float) - stamp["nanosec"][0]) / 1e9


def between(recording, topic, begin, end=np.inf):
    """The messages stamped in [begin, end) [s]."""
    t = times(recording, topic)
    return recording[topic][(t > begin - 1e-6) & (t < end - 1e-6)]


def attitude_error(recording):
    """Angle (m,) [rad] between estimated and true attitude."""
    a, true = recording["spacerobot/odometry"]["pose"]["pose"]["orientation"], recording["spacerobot/truth"]["attitude"]
    vector = a[:, 3:] * true[:, :3] - true[:, 3:] * a[:, :3] - np.cross(a[:, :3], true[:, :3])
    return 2.0 * np.arcsin(np.minimum(1.0, np.linalg.norm(vector, axis=1)))


def rate_error(recording):
    """Largest error of the estimated rates of an axis (m,) [rad/s]."""
    error = recording["spacerobot/odometry"]["twist"]["twist"]["angular"] - recording["spacerobot/truth"]["rates"]
    return np.abs(error).max(axis=1)
