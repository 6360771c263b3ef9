"""Parameter update by Lyapunov's method: pi_dot = K_pi^-1 Y^T sigma, no torque measurement needed.

Source: Aerospace 2023, 10(8), 679, equations (43)-(45), with Y(theta, v, v_r, v_r_dot) of the control law in place of
the actual accelerations. With the seven moment and torque rows a term of the base's force rows is left in the proof;
with all ten rows, sigma extended in front by the integral of a_r - a (Walker and Wee), the proof is exact.
"""

import numpy as np

from flight_graph.errors import FlightError
from flight_math import kernel
from spacerobot_ros.recursive_least_squares import all_finite


def adaptation_gain(prior, choice: str = "uniform", scale: float | None = None) -> np.ndarray:
    """Diagonal of Gamma = K_pi^-1: "uniform" scale (0.3) for all, "prior_squared" scale (5) * prior^2."""
    prior = np.asarray(prior, float)
    if choice == "uniform":
        return np.full(prior.shape, 0.3 if scale is None else float(scale))
    if choice == "prior_squared":
        return (5.0 if scale is None else scale) * prior * prior
    raise FlightError(f"adaptation gain '{choice}' is unknown; allowed: uniform, prior_squared")


@kernel
def lyapunov_update(y, sigma, gain, period, pi):
    """pi += period * gain * Y^T sigma, equation (45). Returns False, pi untouched, if sigma or Y is not finite.

    ``y`` (rows, p) at the reference motion; ``sigma`` (rows,) [m/s, rad/s]; ``gain`` (p,) diagonal of Gamma; ``period``
    [s]; ``pi`` (p,) in place.
    """
    if not all_finite(y, sigma):
        return False
    for r in range(len(sigma)):
        weight = period * sigma[r]
        for j in range(len(pi)):
            pi[j] += gain[j] * (weight * y[r, j])
    return True
