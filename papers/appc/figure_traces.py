"""What the figures of the Cubli paper are drawn from: one run's curves, thinned to what a page can show."""

from dataclasses import dataclass

import numpy as np

from flight_graph.graphs.scenario import Scenario
from papers.appc.metrics import contact_history, matched, seconds

POINTS = 6000  # at most, of a curve


@dataclass
class Trace:
    """Curves of one run over time t (n,) [s]; bounds and rate_error are None for a law without funnels.

    angles [rad], rates [rad/s], torque [N m], rate_error [rad/s]: (n, 3); attitude_bound [rad], rate_bound [rad/s],
    effort [N^2 m^2 s], normal_force (in m g): (n,); limit: eq. (9) [rad/s].
    """

    t: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    torque: np.ndarray
    effort: np.ndarray
    normal_force: np.ndarray
    limit: float
    attitude_bound: np.ndarray | None = None
    rate_error: np.ndarray | None = None
    rate_bound: np.ndarray | None = None


def trace(scenario: Scenario, signals) -> Trace:
    """The curves of a run on the paper's plant, from its recorded signals (a Recording, or a bag's)."""
    values = scenario.graph.nodes["plant"].values
    truth, command = signals["cubli/truth"], signals["cubli/wheel_command"]
    t = seconds(truth, scenario)
    torque = matched(t, command, scenario)
    power = (torque * torque).sum(axis=1)
    effort = np.concatenate([[0.0], np.cumsum(power[:-1] * np.diff(t))])
    every = max(1, -(-len(t) // POINTS))
    pick = slice(None, None, every)
    normal_force, _ = contact_history(truth[pick], torque[pick], values)
    limit = float(np.sqrt(np.sqrt(2.0) * values["gravity"] / values["length"]))
    found = Trace(t[pick], truth["angles"][pick].copy(), truth["rates"][pick].copy(), torque[pick].copy(),
                  effort[pick].copy(), normal_force, limit)
    if "cubli/funnel" in signals:
        funnel = signals["cubli/funnel"]
        at = np.searchsorted(seconds(funnel, scenario), found.t, side="right") - 1
        found.attitude_bound = funnel["attitude_bound"][at, 0].copy()
        found.rate_error = funnel["rate_error"][at].copy()
        found.rate_bound = funnel["rate_bound"][at, 0].copy()
    return found
