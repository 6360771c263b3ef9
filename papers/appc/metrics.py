"""Metrics of a run of the Cubli rover.

Source of the definitions: Aerospace 2022, 9(11), 728, sections 3.2, 4.1 and 5, made exact where the paper is silent.
Errors are those of the true state (the angles themselves: the reference is zero), funnels those of the law. A plant that
simulates its contact (`cubli/truth/contact`) gives the forces itself, and the metrics are those of the time until its run
was decided (a landing, a fall).
"""

import numpy as np
from scipy.integrate import trapezoid

from cubli_ros import jump_condition
from cubli_ros.attitude import rotation_matrix
from flight_graph.graphs.glossary import Alarm, number, recorded, word
from flight_math import Vec3, plain, sincos
from papers.appc import consistency, motion_metrics
from papers.appc.consistency import filter_consistency
from papers.appc.motion_metrics import (
    centre_inertia,
    has_proof,
    moments,
    proof_metrics,
    rate_error_jump,
    turned_by,
    wheel_work,
)

SETTLED = 0.008  # [rad]
TRUTH, COMMAND, FUNNEL, CONTACT = "cubli/truth", "cubli/wheel_command", "cubli/funnel", "cubli/truth/contact"
NO_FUNNEL = "this law has no funnel"
OUTCOMES = (None, "landed", "fell", "jammed")  # of the contact's messages
METRICS = (
    number("xi_a_max", "1", "largest |xi_a| of any axis; below 1: the attitude funnel holds", NO_FUNNEL, headline=True),
    number("xi_u_max", "1", "largest |xi_u| of any axis; below 1: the rate funnel holds", NO_FUNNEL, headline=True),
    number("xi_u_initial", "1", "largest |xi_u| at the start", NO_FUNNEL),
    *(number(f"adaptive_{loop}_{axis}", "1", f"adaptive gain v_hat_{loop} of axis {axis} at the end", NO_FUNNEL)
      for loop in "au" for axis in "xyz"),
    number("rearmed", "1", "how often the funnels were opened anew", NO_FUNNEL),
    number("samples_outside", "1", "samples of the law outside of a funnel", NO_FUNNEL, alarm=Alarm(
        "the state left a funnel of the law, for {value} samples: what is proved within it says nothing of this run", 0.0)),
    number("settling_time_s", "s", "last time any |e_a| > 0.008 rad", "not settled within the run", headline=True),
    number("overshoot_percent", "%", "largest excursion of an axis beyond zero, over the largest initial |angle|",
           "it starts settled, within 0.008 rad"),
    number("tail_rad", "rad", "largest |e_a| of the last sixth of the run", headline=True),
    number("rate_axis_max", "rad/s", "largest |omega_i|"),
    number("rate_norm_max", "rad/s", "largest |omega|", headline=True),
    number("rate_across_max", "rad/s", "largest rate across the body diagonal"),
    number("torque_peak", "N m", "largest |u_i|", headline=True),
    number("torque_late", "N m", "largest |u_i| of the last sixth of the run"),
    number("effort", "N^2 m^2 s", "integral of u.u"),
    number("effort_20s", "N^2 m^2 s", "integral of u.u over the first 20 s"),
    number("normal_force_min", "m g", "smallest normal force, from true state, torque and disturbance; below 0: the ground "
           "would have to pull", headline=True, smallest_is_worst=True),
    number("friction_ratio_max", "1", "largest ratio of tangential to normal force", "contact is lost"),
    number("wheel_speed_max", "rad/s", "largest wheel speed"),
    number("limit_eq9", "rad/s", "rate limit of eq. (9)"),
    number("limit_3d", "rad/s", "rate limit about the corner"),
    number("tilt_initial_rad", "rad", "between the body diagonal and up, at the start"),
    number("lift_first_s", "s", "first time of a negative normal force or of flight", "contact is never lost"),
    number("lift_last_s", "s", "last such time", "contact is never lost"),
    number("over_limit_first_s", "s", "first time of |omega| above the limit of eq. (9)", "it stays below"),
    number("over_limit_last_s", "s", "last such time", "it stays below"),
    number("slip_time_s", "s", "time outside the friction cone"),
    number("slip_first_s", "s", "first time outside the friction cone", "it never slips"),
    number("lift_off_s", "s", "first time without contact", "it stays on the ground"),
    number("end_s", "s", "when the run was decided", "it was not, it stayed up"),
    word("outcome", "how it was decided: landed after a flight, fell, or jammed sliding", "it was not, it stayed up",
         alarm=Alarm("the run was decided before its time: {value} (end_s says when); metrics and figure are of the time "
                     "until then")),
    number("flight_time_s", "s", "time in the air"),
    number("sliding_time_s", "s", "time sliding"),
    number("hop_height", "m", "largest height of the corner above the ground"),
    number("hop_distance", "m", "largest distance of the corner from where it stood first"),
    number("touching_speed", "m/s", "speed of the corner that touched, into the ground"),
    *motion_metrics.METRICS, *consistency.METRICS,
)
TRACES = (
    recorded("attitude error", "rad", "largest of the three angles", TRUTH, "angles", reduce="largest"),
    recorded("rate", "rad/s", "|omega|", TRUTH, "rates", reduce="norm"),
    recorded("torque", "N m", "largest of the three wheels", COMMAND, "effort", reduce="largest"),
    recorded("wheel speed", "rad/s", "largest of the three wheels", TRUTH, "wheel_speed", reduce="largest"),
)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS; {} where it is so short a part of one that there is no truth in it."""
    if not all(len(signals[topic]) for topic in (TRUTH, CONTACT) if topic in signals):
        return {}
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
    result = {
        **funnel_maxima(signals),
        "settling_time_s": settled,
        "overshoot_percent": overshoot(angles),
        "tail_rad": float(error[t >= t[-1] * 5.0 / 6.0].max()),
        "rate_axis_max": float(np.abs(rates).max()),
        "rate_norm_max": float(norm.max()),
        "rate_across_max": float(np.sqrt(((rates - rates.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)).max()),
        "torque_peak": float(np.abs(command["effort"]).max()),
        "torque_late": float(np.abs(torque[t >= t[-1] * 5.0 / 6.0]).max()),
        "effort": effort(command, scenario, np.inf),
        "effort_20s": effort(command, scenario, 20.0),
        "normal_force_min": float(normal_force.min()),
        "friction_ratio_max": jump_condition.largest_ratio(friction_ratio),
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


def overshoot(angles) -> float | None:
    """Largest excursion [%] of angles (n, 3) beyond zero, over the largest initial one; None where they start settled."""
    initial = angles[0]
    step = np.abs(initial).max()
    return float(100.0 * np.max(-angles * np.sign(initial)) / step) if step > SETTLED else None


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
    """Events and motion of the contact."""
    last = contact[-1]
    step = (seconds(contact, scenario)[-1] / (len(contact) - 1)) if len(contact) > 1 else 0.0
    tilt, azimuth = values["tilt"], values["azimuth"]
    normal = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    height = contact["corner"] @ normal
    across = contact["corner"] - height[:, None] * normal
    return {
        "slip_first_s": event(last["slip_time"]), "lift_off_s": event(last["lift_off_time"]),
        "end_s": event(last["end_time"]), "outcome": OUTCOMES[int(last["outcome"])],
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
    if np.any(values.get("body_inertia", 0.0)):
        moment = moment - np.cross(rates, rates @ centre_inertia(values))
    acceleration = turned_by(moment + torque, values) + truth["disturbance"]
    force = np.cross(acceleration, arm) + np.cross(rates, np.cross(rates, arm)) - gravity
    weight = np.linalg.norm(gravity, axis=1)
    up = -gravity / weight[:, None]
    normal = (force * up).sum(axis=1)
    tangential = np.linalg.norm(force - normal[:, None] * up, axis=1)
    lost = tangential >= jump_condition.LOST_CONTACT_RATIO * normal
    ratio = np.where(lost, jump_condition.LOST_CONTACT_RATIO, tangential / np.where(lost, 1.0, normal))
    return normal / weight, ratio
