"""Metrics of a run of the Cubli rover.

Source of the definitions: Aerospace 2022, 9(11), 728, sections 3.2, 4.1 and 5, made exact where the paper is silent:

=================== ==================================================================================================
xi_a_max, xi_u_max  largest |xi_a|, |xi_u| of any axis; below 1: the funnels hold
settling_time_s     last time any |e_a| > 0.008 rad; never settled within the run: null
overshoot_percent   largest excursion of the other sign over the initial angle, all axes
tail_rad            largest |e_a| of the last sixth of the run
rate_axis_max       largest |omega_i| [rad/s];  rate_norm_max: largest |omega|
torque_peak         largest |u_i| [N m];  torque_late: of the last sixth;  effort: integral of u.u dt [N^2 m^2 s]
normal_force_min    smallest normal force in m g, from true state, torque and disturbance; negative: contact is lost
friction_ratio_max  largest ratio of tangential to normal force (1e6 where contact is lost)
wheel_speed_max     largest wheel speed [rad/s];  limit_eq9: the rate limit of eq. (9) [rad/s]
nees_10s, nis_mean  consistency of the attitude filter, see `papers.appc.consistency`
proof_a_excess, ... what weighs the proof and the model, see `papers.appc.motion_metrics`
lift_first_s, ...   first and last time of a negative normal force or flight, and of |omega| above the limit of eq. (9)
=================== ==================================================================================================

Errors are those of the true state (the angles themselves: the reference is zero), funnels those of the law.

A plant that simulates its contact (`cubli/truth/contact`) gives the forces itself, and the metrics are those of the
time until its run was decided (a landing, a fall):

=================== ==================================================================================================
slip_first_s        first time outside the friction cone;  lift_off_s: first time without contact (null: never)
end_s, outcome      when the run was decided, and how: 0 not at all, 1 landed after a flight, 2 fell, 3 jammed sliding
flight_time_s, ...  time in the air and time sliding [s]
hop_height          largest height of the corner above the ground [m];  hop_distance: from where it stood first [m]
touching_speed      speed of the corner that touched, into the ground [m/s]
=================== ==================================================================================================
"""

import numpy as np
from scipy.integrate import trapezoid

from cubli_ros import jump_condition
from cubli_ros.attitude import rotation_matrix
from flight_math import Vec3, plain, sincos
from papers.appc.consistency import filter_consistency
from papers.appc.motion_metrics import has_proof, moments, proof_metrics, rate_error_jump, wheel_work

SETTLED = 0.008  # [rad]
TRUTH, COMMAND, FUNNEL, CONTACT = "cubli/truth", "cubli/wheel_command", "cubli/funnel", "cubli/truth/contact"


def compute(scenario, signals) -> dict:
    """Metrics of a run: see the module's table."""
    values = scenario.graph.nodes["plant"].values
    consistency = filter_consistency(scenario, signals, seconds)
    signals = until_decided(scenario, signals)
    truth, command = signals[TRUTH], signals[COMMAND]
    t = seconds(truth, scenario)
    torque = matched(t, command, scenario)
    angles, rates = truth["angles"], truth["rates"]
    if CONTACT in signals:
        contact = signals[CONTACT]
        normal_force, friction_ratio = contact["normal_force"], contact["friction_ratio"]
        lost = (normal_force < 0.0) | (contact["phase"] == 1.0)
    else:
        normal_force, friction_ratio = contact_history(truth, torque, values)
        lost = normal_force < 0.0
    cosine = float(np.cos(values.get("tilt", 0.0)))
    limit = plain(jump_condition.planar_rate_limit)(values["gravity"], values["length"], cosine)
    norm = np.sqrt((rates * rates).sum(axis=1))
    error = np.abs(angles).max(axis=1)
    late = np.flatnonzero(error > SETTLED)
    settled = None if len(late) and late[-1] == len(t) - 1 else float(t[late[-1]]) if len(late) else 0.0
    initial = angles[0]
    result = {
        **funnel_maxima(signals),
        "settling_time_s": settled,
        "overshoot_percent": float(100.0 * np.max(-angles / np.where(initial == 0.0, np.inf, initial))),
        "tail_rad": float(error[t >= t[-1] * 5.0 / 6.0].max()),
        "rate_axis_max": float(np.abs(rates).max()),
        "rate_norm_max": float(norm.max()),
        "rate_across_max": float(np.sqrt(((rates - rates.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)).max()),
        "torque_peak": float(np.abs(command["effort"]).max()),
        "torque_late": float(np.abs(torque[t >= t[-1] * 5.0 / 6.0]).max()),
        "effort": effort(command, scenario, np.inf),
        "effort_20s": effort(command, scenario, 20.0),
        "normal_force_min": float(normal_force.min()),
        "friction_ratio_max": float(friction_ratio.max()),
        "wheel_speed_max": float(np.abs(truth["wheel_speed"]).max()),
        "limit_eq9": float(limit),
        "limit_3d": float(plain(jump_condition.corner_rate_limit)(values["gravity"], values["length"], cosine)),
        "tilt_initial_rad": tilt(angles[0]),
    }
    result["lift_first_s"], result["lift_last_s"] = interval(t, lost)
    result["over_limit_first_s"], result["over_limit_last_s"] = interval(t, norm > limit)
    result["slip_time_s"] = float((friction_ratio > values.get("friction", 0.6)).mean() * (t[-1] - t[0]))
    if CONTACT in signals:
        result.update(contact_metrics(contact, values, scenario))
        result.update(moments(truth, torque, values))
    result["wheel_work"] = wheel_work(t, truth, torque)
    if FUNNEL in signals:
        result["rate_error_jump"] = rate_error_jump(signals[FUNNEL])
        law = scenario.graph.nodes["controller"].values if "controller" in scenario.graph.nodes else {}
        if has_proof(law) and len(signals[FUNNEL]) == len(t):
            result.update(proof_metrics(t, signals[FUNNEL], truth, values, law))
    result.update(consistency)
    return result


def until_decided(scenario, signals) -> dict:
    """The signals of a run, up to the moment at which the plant's contact decided it."""
    kept = {topic: signals[topic] for topic in (TRUTH, COMMAND, FUNNEL, CONTACT) if topic in signals}
    end = kept[CONTACT]["end_time"][-1] if CONTACT in kept else -1.0
    if end < 0.0:
        return kept
    node = next(node for node, _, signal in scenario.graph.outputs() if signal.topic == CONTACT)
    end += node.period_ns / 1e9  # the state of the touch stands in the message after it
    return {topic: records[seconds(records, scenario) <= end] for topic, records in kept.items()}


def contact_metrics(contact, values, scenario) -> dict:
    """Events and motion of the contact: see the module's table."""
    last = contact[-1]
    step = (seconds(contact, scenario)[-1] / (len(contact) - 1)) if len(contact) > 1 else 0.0
    tilt, azimuth = values["tilt"], values["azimuth"]
    normal = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    height = contact["corner"] @ normal
    across = contact["corner"] - height[:, None] * normal
    return {
        "slip_first_s": event(last["slip_time"]), "lift_off_s": event(last["lift_off_time"]),
        "end_s": event(last["end_time"]), "outcome": float(last["outcome"]),
        "flight_time_s": float((contact["phase"] == 1.0).sum() * step),
        "sliding_time_s": float((contact["sliding"] == 1.0).sum() * step),
        "hop_height": max(0.0, float(height.max())),
        "hop_distance": float(np.sqrt((across**2).sum(axis=1)).max()),
        "touching_speed": float(last["touching_speed"]),
    }


def event(time) -> float | None:
    """A time of the contact's messages, where -1 means never."""
    return float(time) if time >= 0.0 else None


def funnel_maxima(signals) -> dict:
    """xi maxima and the adaptive gains at the end; absent for laws without a funnel."""
    if FUNNEL not in signals:
        return {"xi_a_max": None, "xi_u_max": None}
    funnel = signals[FUNNEL]
    found = {"xi_a_max": float(np.abs(funnel["attitude_xi"]).max()),
             "xi_u_max": float(np.abs(funnel["rate_xi"]).max()),
             "xi_u_initial": float(np.abs(funnel["rate_xi"][0]).max())}
    for gain in ("adaptive_a", "adaptive_u"):
        for axis, name in enumerate("xyz"):
            found[f"{gain}_{name}"] = float(funnel[gain][-1, axis])
    found["rearmed"] = float(funnel["rearmed"][-1])
    found["samples_outside"] = float(funnel["outside"][-1])
    return found


def seconds(records, scenario) -> np.ndarray:
    """Time of each record since the epoch of the run [s]."""
    stamp = records["header"]["stamp"]
    return (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - scenario.epoch_ns) / 1e9


def effort(command, scenario, until_s) -> float:
    """Integral of u.u over the run up to a time: exact for a held torque; trapezoidal where the bag is thinned."""
    t = seconds(command, scenario)
    power = (command["effort"] ** 2).sum(axis=1)[t <= until_s]
    node = next(node.name for node, _, signal in scenario.graph.outputs() if signal.topic == COMMAND)
    period = scenario.graph.nodes[node].period_ns / 1e9
    if len(t) > 1 and t[1] - t[0] > 1.5 * period:
        return float(trapezoid(power, t[t <= until_s]))
    return float(power.sum() * period)


def matched(t, command, scenario) -> np.ndarray:
    """The torque (n, 3) held at each time t."""
    index = np.searchsorted(seconds(command, scenario), t, side="right") - 1
    return np.where(index[:, None] >= 0, command["effort"][np.maximum(index, 0)], 0.0)


def interval(t, mask) -> tuple:
    """First and last time at which a condition holds, or (None, None)."""
    found = np.flatnonzero(mask)
    return (float(t[found[0]]), float(t[found[-1]])) if len(found) else (None, None)


def tilt(angles) -> float:
    """Angle [rad] between the body diagonal and up, of Cardan angles (3,)."""
    matrix = np.array(plain(rotation_matrix)(sincos(Vec3(*angles))))
    return float(np.arccos(np.clip(matrix.sum() / 3.0, -1.0, 1.0)))


def contact_history(truth, torque, values) -> tuple:
    """Normal force in m g (n,) and friction ratio (n,) of the paper's model, as `jump_condition.contact` defines them.

    With sign -1 (hanging as printed) the geometry of the standing cube is used all the same: indicative only.
    """
    mass, length = values["mass"], values["length"]
    gravity, rates, arm = truth["gravity"], truth["rates"], np.full(3, 0.5 * length)
    moment = np.cross(values["gravity_sign"] * arm, mass * gravity)
    acceleration = (moment + torque) / (mass * length * length / 6.0) + truth["disturbance"]
    force = np.cross(acceleration, arm) + np.cross(rates, np.cross(rates, arm)) - gravity
    weight = np.linalg.norm(gravity, axis=1)
    up = -gravity / weight[:, None]
    normal = (force * up).sum(axis=1)
    tangential = np.linalg.norm(force - normal[:, None] * up, axis=1)
    lost = tangential >= jump_condition.LOST_CONTACT_RATIO * normal
    ratio = np.where(lost, jump_condition.LOST_CONTACT_RATIO, tangential / np.where(lost, 1.0, normal))
    return normal / weight, ratio
