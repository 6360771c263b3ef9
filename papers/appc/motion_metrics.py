"""Metrics of a run of the Cubli rover that weigh the paper's proof and what its model leaves out.

Source: Aerospace 2022, 9(11), 728, eq. (3), (5), (20)-(41), (43). With the paper's names, p_l the smallest 1 / rho, R_h
the largest R of the run and v = R_h / (p_l k), per axis and for each loop i = a, u,

    V_i = 1/2 ln(1 / (1 - xi_i^2)) + k_i p_l / (2 eta_i) (v_i - v_hat_i)^2.

By eq. (24), (31), (38) V_i' + lambda_i p_l eps_i^2 is not above zero, and so by eq. (25), (32), (40) V_i(t) - V_i(0).
The proof is of the law as printed, with its switching smoothed and gravity not fed forward; other runs have none of
it, nor have those that leave a funnel or do not adapt. Moments are those of a plant with wheels and a contact.
"""

import numpy as np
from scipy.integrate import trapezoid

from flight_graph.graphs.metric_entry import number

LOOPS = {"a": ("attitude_xi", "attitude_error", "attitude_bound"), "u": ("rate_xi", "rate_error", "rate_bound")}

NO_PROOF = "the run leaves a funnel, or the law does not adapt"
METRICS = (
    *(entry for loop in LOOPS for entry in (
        number(f"proof_{loop}_excess", "1/s", f"largest V_{loop}' + lambda_{loop} p_l eps_{loop}^2 of any axis", NO_PROOF),
        number(f"proof_{loop}_growth", "1", f"largest V_{loop}(t) - V_{loop}(0)", NO_PROOF),
        number(f"proof_{loop}_bound", "1", f"bound on |xi_{loop}| that follows, sqrt(1 - exp(-2 V_{loop}(0))), largest of "
               "the axes", NO_PROOF))),
    number("rate_error_jump", "rad/s", "largest change of e_u from one record to the next in which some xi_a changes sign; "
           "0 without such a change"),
    number("gyroscopic_moment", "N m", "largest |omega x (Theta omega + J_w Omega)| about the corner, which eq. (3), (5) "
           "leave out"),
    number("gravity_moment", "N m", "largest |M_g|"),
    number("torque_norm", "N m", "largest |u|"),
    number("wheel_work", "J", "integral of |u_i Omega_i| dt, all wheels"),
)


def wheel_work(t, truth, torque) -> float:
    """Integral of |u_i Omega_i| dt [J]; t (n,) [s], torque (n, 3) [N m]."""
    return float(trapezoid(np.abs(torque * truth["wheel_speed"]).sum(axis=1), t))


def moments(truth, torque, values) -> dict:
    """Moments of a run; torque (n, 3) [N m], values: the plant's parameters."""
    rates, wheels = truth["rates"], truth["wheel_speed"]
    square = values["mass"] * values["length"] * values["length"]
    momentum = square * (11.0 / 12.0 * rates - 0.25 * rates.sum(axis=1, keepdims=True))
    if np.any(values.get("body_inertia", 0.0)):
        momentum = rates @ centre_inertia(values) + square * (0.75 * rates - 0.25 * rates.sum(axis=1, keepdims=True))
    momentum += values["wheel_inertia"] * wheels
    return {"gyroscopic_moment": largest_norm(np.cross(rates, momentum)),
            "gravity_moment": largest_norm(gravity_moment(truth, values)),
            "torque_norm": largest_norm(torque)}


def largest_norm(vectors) -> float:
    """Of vectors (n, 3)."""
    return float(np.sqrt((vectors * vectors).sum(axis=1)).max())


def centre_inertia(values) -> np.ndarray:
    """Inertia (3, 3) [kg m^2] of the body about its centre: the user's own, or a solid cube's."""
    own = np.array(values.get("body_inertia", np.zeros((3, 3))), float)
    return own if own.any() else values["mass"] * values["length"] * values["length"] / 6.0 * np.eye(3)


def turned_by(moments, values) -> np.ndarray:
    """Angular accelerations (n, 3) [rad/s^2] of that inertia by moments (n, 3) [N m] about its centre."""
    inertia = centre_inertia(values)
    if np.any(values.get("body_inertia", 0.0)):
        return np.linalg.solve(inertia, moments.T).T
    return moments / inertia[0, 0]


def gravity_moment(truth, values) -> np.ndarray:
    """M_g (n, 3) [N m] of eq. (4)."""
    arm = np.full(3, 0.5 * values.get("gravity_sign", 1) * values["length"])
    return np.cross(arm, values["mass"] * truth["gravity"])


def rate_error_jump(funnel) -> float:
    """Largest change of e_u [rad/s] where a xi_a changes sign; 0.0 where no xi_a changes sign."""
    side = np.sign(funnel["attitude_xi"])
    switched = (side[1:] != side[:-1]).any(axis=1)
    change = np.abs(np.diff(funnel["rate_error"], axis=0)).max(axis=1)
    return float(change[switched].max()) if switched.any() else 0.0


def has_proof(law) -> bool:
    """Whether a law of these parameters is the one that the proof is of."""
    return law.get("law") == "explicit" and law["smoothing"] > 0.0 and law["feed_forward"] == 0.0


def proof_metrics(t, funnel, truth, plant, law) -> dict:
    """The proof's inequalities on a run; plant, law: parameters. Records of funnel and truth are of the same times."""
    found = {}
    for loop, (xi, error, bound) in LOOPS.items():
        k, eta, rate = (np.array(law[f"{name}_{loop}"]) for name in ("k", "eta", "lambda"))
        xi, error, bound = funnel[xi], funnel[error], funnel[bound]
        usable = len(t) > 2 and (k > 0.0).all() and (eta > 0.0).all() and bool((np.abs(xi) < 1.0).all())
        names = [f"proof_{loop}_{name}" for name in ("excess", "growth", "bound")]
        if not usable:
            found.update(dict.fromkeys(names))
            continue
        bound_dot = np.array(law[f"l_{loop}"]) * (bound - np.array(law[f"rho_{loop}_inf"]))
        drift = -bound_dot / bound * error
        if loop == "u":
            virtual_dot = np.gradient(truth["rates"] - error, t, axis=0)
            drift = drift + turned_by(gravity_moment(truth, plant), plant) - virtual_dot + truth["disturbance"]
        least, most = (1.0 / bound).min(axis=0), np.abs(drift / bound).max(axis=0)
        v = most / (least * k) - funnel[f"adaptive_{loop}"]
        value = -0.5 * np.log1p(-xi * xi) + k * least / (2.0 * eta) * v * v
        square = (xi / (1.0 - xi * xi)) ** 2
        excess = np.diff(value, axis=0) / np.diff(t)[:, None] + rate * least * 0.5 * (square[1:] + square[:-1])
        found.update(zip(names, (float(excess.max()), float((value - value[0]).max()),
                                 float(np.sqrt(-np.expm1(-2.0 * value[0])).max())), strict=True))
    return found
