"""Metrics of a landing. Definitions are ours: the paper's public text names no numbers.

Success: landed, lateral <= 0.5 m, speed <= 0.1 m/s, attitude <= 3 deg, rate <= 0.2 deg/s, clearance above 0 all the way,
view angle <= 30 deg at |r| > 5 m.
"""

import math

import numpy as np

from flight_graph.graphs.glossary import Alarm, LandingPoints, flag, number, recorded
from papers.lander import energy
from papers.lander.terrain import terrain

LIMITS = {"lateral_m": 0.5, "speed_mps": 0.1, "attitude_deg": 3.0, "rate_dps": 0.2}  # of success, units in the names
WINDOW, RESOLVED = 10.0, 1e-6  # [s] of the balance of the Lyapunov function, [J] that rounding leaves resolved
SETTLED = 60.0  # [s] the navigation filter has forgotten its start
FAR = 1e9  # [m] what the plant's smallest clearance begins with
AT_END = "true, at the contact trigger, or at the end of a run without one"
BEFORE = "the true state was not recorded"
METRICS = (
    flag("success", "landed within the limits of success, with both constraints kept", headline=True),
    flag("landed", "the contact trigger fired within the run", headline=True, alarm=Alarm(
        "it did not land within the run", is_=False)),
    number("touchdown_time_s", "s", "time of the contact trigger", "it never fired"),
    number("lateral_m", "m", f"distance from the site's normal; {AT_END}", headline=True),
    number("speed_mps", "m/s", f"speed relative to the site; {AT_END}", headline=True),
    number("attitude_deg", "deg", f"angle to the goal's attitude; {AT_END}", headline=True),
    number("rate_dps", "deg/s", f"turn rate relative to the site; {AT_END}", headline=True),
    number("touchdown_x_m", "m", "along x (east) of D, at the contact trigger", "not landed"),
    number("touchdown_y_m", "m", "along y of D, at the contact trigger", "not landed"),
    number("height_m", "m", "z_D of the last true state"),
    number("height_min_m", "m", "smallest z_D", smallest_is_worst=True),
    number("clearance_min_m", "m", "smallest clearance d over the keep-out funnel at |r| > 20 m", "never that far away",
           headline=True, smallest_is_worst=True),
    number("clearance_min_time_s", "s", "when that was", "never that far away"),
    number("clearance_min_all_m", "m", "smallest clearance d anywhere", smallest_is_worst=True),
    number("los_max_deg", "deg", "largest angle between -z_B and the goal at |r| > 5 m", headline=True),
    number("clearance_violation_s", "s", "time with d < 0", alarm=Alarm(
        "it was below the keep-out funnel for {value} s", 0.0)),
    number("los_violation_s", "s", "time beyond the view cone at |r| > 5 m", alarm=Alarm(
        "the site was out of the camera's cone for {value} s", 0.0)),
    number("delta_v_mps", "m/s", "integral of |f|/m", headline=True),
    number("torque_impulse_Nms", "N m s", "integral of |tau|"),
    number("force_peak_N", "N", "largest component of the delivered force"),
    number("torque_peak_Nm", "N m", "largest component of the delivered torque"),
    number("speed_max_mps", "m/s", "largest speed relative to the site"),
    number("saturated_s", "s", "time with an axis at its limit"),
    number("propellant_kg", "kg", "propellant used"),
    number("lyapunov_initial_J", "J", "of the law's telemetry, first value"),
    number("lyapunov_final_J", "J", "of the law's telemetry, last value up to the trigger"),
    number("lyapunov_rise_J", "J", "largest rise of a step; below 0: it falls all the way", "there is one value only"),
    number("lyapunov_balance_error", "1", "of the true motion (`papers.lander.energy`): largest difference over 10 s, "
           "nothing clipped, between the fall of L and what the damping takes, relative to the latter", BEFORE),
    number("saturated_longest_s", "s", "longest uninterrupted saturation of the law"),
    number("twistor_norm_max", "1", "largest norm of the law's twistor"),
    number("potential_initial_J", "J", "potential at the start"),
    flag("abort_advised", "the monitor advised to leave at some time before the trigger"),
    number("level_worst", "1", "the monitor's worst level before the trigger: 0 ok, 1 warning, 2 error, 3 stale"),
    number("nav_position_rms_m", "m", "estimate against truth, per axis, from 60 s after the start to the trigger"),
    number("nav_position_over_limit", "1", "the same over 0.02 m + 0.002 |r|"),
    number("nav_velocity_rms_mps", "m/s", "the same of the velocity"),
    number("nav_attitude_rms_deg", "deg", "the same of the attitude"),
    number("nav_rate_rms_dps", "deg/s", "the same of the turn rate"),
)
SUMMARY = "lander/truth/summary"
TRACES = (
    recorded("lateral distance", "m", "from the site's normal", SUMMARY, "lateral"),
    recorded("speed", "m/s", "relative to the site", SUMMARY, "speed"),
    recorded("attitude error", "deg", "to the goal's attitude", SUMMARY, "attitude_error", scale=math.degrees(1.0)),
    recorded("delta-v", "m/s", "used so far", SUMMARY, "delta_v"),
)
LANDING = LandingPoints("touchdown_x_m", "touchdown_y_m", terrain)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS; {} where it is so short a part of one that nothing was summed up in it."""
    if not len(signals[SUMMARY]):
        return {}
    last = signals[SUMMARY][-1]
    landed = bool(last["landed"])
    end = float(last["time"]) if landed else math.inf
    found = {
        "landed": landed,
        "touchdown_time_s": end if landed else None,
        "lateral_m": float(last["lateral"]),
        "speed_mps": float(last["speed"]),
        "attitude_deg": math.degrees(last["attitude_error"]),
        "rate_dps": math.degrees(last["rate"]),
        "clearance_min_m": float(last["clearance_min"]) if last["clearance_min"] < FAR else None,
        "clearance_min_time_s": float(last["clearance_min_time"]) if last["clearance_min"] < FAR else None,
        "clearance_min_all_m": float(last["clearance_min_all"]),
        "los_max_deg": math.degrees(last["view_max"]),
        "clearance_violation_s": float(last["clearance_violation"]),
        "los_violation_s": float(last["view_violation"]),
        "delta_v_mps": float(last["delta_v"]),
        "torque_impulse_Nms": float(last["torque_impulse"]),
        "force_peak_N": float(last["force_peak"]),
        "torque_peak_Nm": float(last["torque_peak"]),
        "speed_max_mps": float(last["speed_max"]),
        "saturated_s": float(last["saturated"]),
        "propellant_kg": float(last["propellant"]),
    }
    cone = math.degrees(scenario.graph.nodes["plant"].values["view_half_angle"])
    found["success"] = bool(
        landed and all(found[name] <= limit for name, limit in LIMITS.items())
        and found["clearance_min_all_m"] > 0.0 and found["los_max_deg"] <= cone)
    return {**found, **places(signals, landed), **law(scenario, signals, end), **verdict(scenario, signals, end),
            **navigation(scenario, signals, end)}


def seconds(records, scenario) -> np.ndarray:
    """Time of each record since the epoch of the run [s]."""
    stamp = records["header"]["stamp"]
    return (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - scenario.epoch_ns) / 1e9


def places(signals, landed) -> dict:
    """Where it is at the end, and was; {} where the truth was not recorded."""
    if "lander/truth" not in signals:
        return {}
    position = signals["lander/truth"]["site_position"]
    x, y = position[-1, :2] if landed else (None, None)  # the state is held from the contact on
    return {"touchdown_x_m": x, "touchdown_y_m": y, "height_m": float(position[-1, 2]),
            "height_min_m": float(position[:, 2].min())}


def law(scenario, signals, end) -> dict:
    """Lyapunov function and saturation of the law, up to the contact."""
    if "lander/constraints" not in signals:
        return {}
    records = signals["lander/constraints"]
    records = records[seconds(records, scenario) < end]
    values = records["lyapunov"]
    return {
        "lyapunov_initial_J": float(values[0]),
        "lyapunov_final_J": float(values[-1]),
        "lyapunov_rise_J": float(np.diff(values).max()) if len(values) > 1 else None,
        "lyapunov_balance_error": balance_error(scenario, signals, end),
        "saturated_longest_s": float(records["saturated_for"].max()),
        "twistor_norm_max": float(records["twistor_norm"].max()),
        "potential_initial_J": float(records["potential"][0]),
    }


def balance_error(scenario, signals, end):
    """Of L over windows of the true motion; None where the truth was not recorded."""
    if "lander/truth" not in signals:
        return None
    truth, law = signals["lander/truth"], scenario.graph.nodes["controller"].values
    t = seconds(truth, scenario)
    truth, t = truth[t <= end], t[t <= end]
    mass = float(scenario.graph.nodes["plant"].values["mass"])
    v, w = truth["site_velocity"], truth["rates"]
    level = energy.lyapunov(law, mass, truth["site_position"], v, truth["attitude"], w)
    power = energy.dissipated(law, v, w)
    taken = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (power[1:] + power[:-1]))])
    clipped = (np.abs(truth["force"]) >= law["force_limit"]) | (np.abs(truth["torque"]) >= law["torque_limit"])
    ever = np.concatenate([[0], np.cumsum(clipped.any(axis=1))])
    length = np.searchsorted(t, t[0] + WINDOW)
    begin = np.arange(0, len(t) - length, length)
    begin = begin[ever[begin + length + 1] == ever[begin]]
    begin = begin[taken[begin + length] - taken[begin] > RESOLVED]
    fall, wanted = level[begin] - level[begin + length], taken[begin + length] - taken[begin]
    return float(np.abs(fall / wanted - 1.0).max(initial=0.0))


def verdict(scenario, signals, end) -> dict:
    """What the monitor said before the contact."""
    if "lander/landing_status" not in signals:
        return {}
    records = signals["lander/landing_status"]
    records = records[seconds(records, scenario) < end]
    return {"abort_advised": bool(records["abort"].max()), "level_worst": int(records["level"].max())}


def navigation(scenario, signals, end) -> dict:
    """Root-mean-square errors of the estimate per axis, and the normalised errors squared of its position."""
    if "lander/odom" not in signals or "lander/truth/odom" not in signals:
        return {}
    truth, estimate = signals["lander/truth/odom"], signals["lander/odom"]
    t_truth, t = seconds(truth, scenario), seconds(estimate, scenario)
    keep = (t >= SETTLED) & (t < end) & np.isin(t, t_truth)
    if not keep.any():
        return {}
    truth, estimate = truth[np.searchsorted(t_truth, t[keep])], estimate[keep]
    errors = estimate_errors(truth, estimate)
    distance = np.linalg.norm(truth["pose"]["pose"]["position"], axis=1, keepdims=True)
    return {
        "nav_position_rms_m": rms(errors["position"]),
        "nav_position_over_limit": rms(errors["position"] / (0.02 + 0.002 * distance)),
        "nav_velocity_rms_mps": rms(errors["velocity"]),
        "nav_attitude_rms_deg": math.degrees(rms(errors["attitude"])),
        "nav_rate_rms_dps": math.degrees(rms(errors["rate"])),
    }


def rms(values) -> float:
    """Root mean square over all samples and axes."""
    return float(np.sqrt(np.mean(values * values)))


def estimate_errors(truth, estimate) -> dict:
    """Estimate less truth, (n, 3) each: position [m] in D; velocity [m/s], rate [rad/s], attitude [rad] in B."""
    true_q, q = truth["pose"]["pose"]["orientation"], estimate["pose"]["pose"]["orientation"]
    vector = (true_q[:, 3:] * q[:, :3] - q[:, 3:] * true_q[:, :3] - np.cross(true_q[:, :3], q[:, :3]))
    scalar = np.sum(true_q * q, axis=1, keepdims=True)
    return {
        "position": estimate["pose"]["pose"]["position"] - truth["pose"]["pose"]["position"],
        "velocity": estimate["twist"]["twist"]["linear"] - truth["twist"]["twist"]["linear"],
        "attitude": 2.0 * vector * np.sign(scalar),
        "rate": estimate["twist"]["twist"]["angular"] - truth["twist"]["twist"]["angular"],
    }
