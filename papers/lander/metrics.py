"""Metrics of a landing.

Definitions (ours; the paper's public text names no numbers):

===================== ================================================================================================
landed                1 when the contact trigger fired within the run
touchdown_time_s      time of the contact trigger; null where it never fired
lateral_m, speed_mps, attitude_deg, rate_dps   true state at the trigger, or at the end of the run
height_m, height_min_m   z_D of the last true state, and the smallest
clearance_min_m       smallest clearance d at |r| > 20 m, and when (clearance_min_time_s); clearance_min_all_m: anywhere
los_max_deg           largest angle between -z_B and the goal at |r| > 5 m
clearance_violation_s, los_violation_s   time with d < 0; time beyond the view cone at |r| > 5 m
delta_v_mps           integral of |f|/m;  torque_impulse_Nms: integral of |tau|
force_peak_N, torque_peak_Nm   largest component of the delivered wrench;  speed_max_mps
saturated_s           time with an axis at its limit
success               1: landed, lateral <= 0.5 m, speed <= 0.1 m/s, attitude <= 3 deg, rate <= 0.2 deg/s, d > 0 all the
                      way, view angle <= 30 deg at |r| > 5 m
lyapunov_*            of the law's telemetry up to the trigger: first and last value [J], largest rise of a step [J]
lyapunov_balance_error   of the true motion, by `papers.lander.energy`: the largest difference over 10 s, nothing
                      clipped, between the fall of L and what the damping takes in that time, relative to the latter
saturated_longest_s   longest uninterrupted saturation of the law
abort_advised         1 when the monitor ever advised to leave;  level_worst: its worst level before the trigger
nav_*                 estimate against truth, from 60 s after the start to the trigger
===================== ================================================================================================
"""

import math

import numpy as np

from papers.lander import energy

LIMITS = {"lateral_m": 0.5, "speed_mps": 0.1, "attitude_deg": 3.0, "rate_dps": 0.2}  # of success, units in the names
WINDOW, RESOLVED = 10.0, 1e-6  # [s] of the balance of the Lyapunov function, [J] that rounding leaves resolved
SETTLED = 60.0  # [s] the navigation filter has forgotten its start


def compute(scenario, signals) -> dict:
    """Metrics of a run: see the module's table."""
    last = signals["lander/truth/summary"][-1]
    landed = bool(last["landed"])
    end = float(last["time"]) if landed else math.inf
    found = {
        "landed": int(landed),
        "touchdown_time_s": end,
        "lateral_m": float(last["lateral"]),
        "height_m": final_height(signals),
        "height_min_m": smallest_height(signals),
        "speed_mps": float(last["speed"]),
        "attitude_deg": math.degrees(last["attitude_error"]),
        "rate_dps": math.degrees(last["rate"]),
        "clearance_min_m": float(last["clearance_min"]),
        "clearance_min_time_s": float(last["clearance_min_time"]),
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
    found["success"] = int(
        landed and all(found[name] <= limit for name, limit in LIMITS.items())
        and found["clearance_min_all_m"] > 0.0 and found["los_max_deg"] <= cone)
    return {**found, **law(scenario, signals, end), **verdict(scenario, signals, end),
            **navigation(scenario, signals, end)}


def seconds(records, scenario) -> np.ndarray:
    """Time of each record since the epoch of the run [s]."""
    stamp = records["header"]["stamp"]
    return (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - scenario.epoch_ns) / 1e9


def final_height(signals):
    """z_D [m] of the last true state; NaN where the truth was not recorded."""
    return float(signals["lander/truth"]["site_position"][-1, 2]) if "lander/truth" in signals else math.nan


def smallest_height(signals):
    """Smallest z_D [m] of the true states; NaN where the truth was not recorded."""
    return float(signals["lander/truth"]["site_position"][:, 2].min()) if "lander/truth" in signals else math.nan


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
        "lyapunov_rise_J": float(np.diff(values).max(initial=-math.inf)),
        "lyapunov_balance_error": balance_error(scenario, signals, end),
        "saturated_longest_s": float(records["saturated_for"].max()),
        "twistor_norm_max": float(records["twistor_norm"].max()),
        "potential_initial_J": float(records["potential"][0]),
    }


def balance_error(scenario, signals, end):
    """Of L over windows of the true motion; NaN where the truth was not recorded."""
    if "lander/truth" not in signals:
        return math.nan
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
    return {"abort_advised": int(records["abort"].max()), "level_worst": int(records["level"].max())}


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
