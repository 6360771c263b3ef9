"""Metrics of a run of the space robot.

Source of the definitions: Aerospace 2023, 10(8), 679, sections 4.1-4.3, made exact where the paper is silent.
The window of the root mean squares is t >= 20 s for harmonics (the start is at rest, so the law meets a mismatch of
velocities first), the whole run otherwise. Errors are those of the true state against the reference.
"""

import numpy as np

from flight_graph.graphs.glossary import Alarm, Trace, number, recorded
from spacerobot_ros.inertial_parameters import smallest_pseudo_inertia_eigenvalues

SETTLED = 0.2  # [deg]
WINDOW = 20.0  # [s]
NO_JUDGE = "this graph has no judge of the prediction"
METRICS = (
    number("attitude_rms_deg", "deg", "root mean square of the attitude error's angle, in the window", headline=True),
    number("joint_rms_deg", "deg", "of the length of the joint errors' vector, in the window", headline=True),
    number("attitude_tail_deg", "deg", "of the attitude error, last 20 s", headline=True),
    number("joint_tail_deg", "deg", "of the joint errors, last 20 s", headline=True),
    number("settling_attitude_s", "s", "first time from which the attitude error stays below 0.2 deg", "it does not"),
    number("settling_joints_s", "s", "first time from which every joint error stays below 0.2 deg", "they do not"),
    number("roll_below_1_deg_s", "s", "first time with |roll error| < 1 deg", "it is never so small"),
    number("overshoot_deg", "deg", "of roll beyond its target", "a harmonic has no target to pass"),
    number("attitude_peak_deg", "deg", "largest attitude error", headline=True),
    number("cross_axis_deg", "deg", "largest error about pitch and yaw"),
    number("prediction_error_rms", "N m", "of |Y (pi_hat - pi)| at the true motion, moment and joint rows, in the window",
           NO_JUDGE, headline=True),
    number("prediction_below_1e3_s", "s", "first time from which that stays below 1e-3 N m", f"it does not, or {NO_JUDGE}"),
    number("parameter_error", "1", "root mean square of (pi_hat - pi) / |pi| at the end", NO_JUDGE),
    number("torque_peak", "N m", "largest commanded torque of base and joints", headline=True),
    number("momentum_max", "kg m/s", "largest linear momentum"),
    number("angular_balance_max", "N m s", "largest |angular momentum - impulse|"),
    number("energy_balance_max", "J", "largest |kinetic energy - work|"),
    number("base_drift_max_m", "m", "largest distance of the base's origin from where it started"),
    number("kinetic_energy_peak_J", "J", "largest kinetic energy"),
    number("wheel_momentum_max", "N m s", "largest momentum of a wheel"),
    number("limited", "1", "part of the samples with an actuator at its limit"),
    *(number(f"i{axis}{axis}_base", "1", f"the base's I{axis}{axis}, estimated over true, at the end") for axis in "xyz"),
    number("ixx_base_hat", "kg m^2", "the base's Ixx, estimated, at the end"),
    number("impossible_bodies", "1", "bodies of the estimate that cannot exist, at the end", alarm=Alarm(
        "at the end {value} bodies of the estimate could not exist", 0.0)),
    number("skipped", "1", "measurements that were not finite"),
    number("repaired", "1", "times the covariance had lost symmetry or positivity"),
    number("frozen", "1", "samples left out because an actuator was at its limit"),
)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS."""
    truth, reference = signals["spacerobot/truth"], signals["spacerobot/reference"]
    t = seconds(truth, scenario)
    error = attitude_errors(truth["attitude"], matched(t, reference, scenario)["attitude"])
    attitude = np.degrees(np.linalg.norm(error, axis=1))
    joints = np.degrees(matched(t, reference, scenario)["joints"] - truth["joints"])
    joint_norm = np.linalg.norm(joints, axis=1)
    harmonic = scenario.graph.nodes["trajectory"].values["motion"] == "harmonic"
    window = t >= (WINDOW if harmonic and t[-1] > WINDOW else 0.0)
    tail = t >= t[-1] - WINDOW
    roll = np.degrees(error[:, 0])
    found = {
        "attitude_rms_deg": rms(attitude[window]),
        "joint_rms_deg": rms(joint_norm[window]),
        "attitude_tail_deg": rms(attitude[tail]),
        "joint_tail_deg": rms(joint_norm[tail]),
        "settling_attitude_s": settling(t, attitude),
        "settling_joints_s": settling(t, np.abs(joints).max(axis=1)),
        "roll_below_1_deg_s": first(t, np.abs(roll) < 1.0),
        "overshoot_deg": None if harmonic else float(max(0.0, -(np.sign(roll[0]) * roll).min())),
        "attitude_peak_deg": float(attitude.max()),
        "cross_axis_deg": float(np.degrees(np.abs(error[:, 1:])).max()),
        **prediction(scenario, signals, window if harmonic else None),
        "torque_peak": torque_peak(signals),
        "momentum_max": float(np.linalg.norm(truth["momentum"], axis=1).max()),
        "angular_balance_max": float(np.linalg.norm(truth["angular_momentum"] - truth["angular_momentum"][0]
                                                    - truth["impulse"], axis=1).max()),
        "energy_balance_max": float(np.abs(truth["kinetic_energy"] - truth["kinetic_energy"][0] - truth["work"]).max()),
        "base_drift_max_m": float(np.linalg.norm(truth["position"] - truth["position"][0], axis=1).max()),
        "kinetic_energy_peak_J": float(truth["kinetic_energy"].max()),
        "wheel_momentum_max": float(np.abs(truth["wheel_momentum"]).max()),
        "limited": float((truth["limited"] > 0.0).mean()),
    }
    found.update(estimates(signals))
    return found


def seconds(records, scenario) -> np.ndarray:
    """Time of each record since the epoch of the run [s]."""
    stamp = records["header"]["stamp"]
    return (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - scenario.epoch_ns) / 1e9


def matched(t, records, scenario) -> np.ndarray:
    """The newest record at each time t."""
    index = np.searchsorted(seconds(records, scenario), t, side="right") - 1
    return records[np.maximum(index, 0)]


def attitude_errors(present, desired) -> np.ndarray:
    """Rotation vectors (m, 3) [rad] from present to desired attitude, base axes; quaternions (m, 4) x, y, z, w."""
    a, b = present[:, :3], desired[:, :3]
    scalar = present[:, 3] * desired[:, 3] + (a * b).sum(axis=1)
    vector = present[:, 3:] * b - desired[:, 3:] * a - np.cross(a, b)
    sine = np.linalg.norm(vector, axis=1)
    angle = 2.0 * np.arctan2(sine, np.abs(scalar))
    factor = np.where(sine > 1e-12, angle / np.where(sine > 1e-12, sine, 1.0), 2.0)
    return np.where(scalar >= 0.0, 1.0, -1.0)[:, None] * factor[:, None] * vector


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values * values)))


def settling(t, values, bound=SETTLED):
    """First time from which values stay below the bound; None: never."""
    outside = np.flatnonzero(~(values < bound))
    if not len(outside):
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else None


def first(t, mask):
    """First time at which a condition holds; None: never."""
    found = np.flatnonzero(mask)
    return float(t[found[0]]) if len(found) else None


def prediction(scenario, signals, window) -> dict:
    """Prediction error against the truth, where the run has a judge of it."""
    if "spacerobot/truth/prediction" not in signals:
        return {"prediction_error_rms": None, "prediction_below_1e3_s": None}
    found = signals["spacerobot/truth/prediction"]
    error = found["prediction_error"]
    t = seconds(found, scenario)
    return {"prediction_error_rms": rms(error[window] if window is not None and len(window) == len(error) else error),
            "prediction_below_1e3_s": settling(t, error, 1e-3), "parameter_error": float(found["parameter_error"][-1])}


def torque_peak(signals) -> float:
    """Largest commanded torque of base and joints [N m]."""
    return float(max(np.abs(signals["spacerobot/base_command"]["wrench"]["torque"]).max(),
                     np.abs(signals["spacerobot/joint_command"]["effort"]).max()))


def estimates(signals) -> dict:
    """The base's principal elements at the end, and how many bodies of the estimate cannot exist."""
    if "spacerobot/parameters" not in signals:
        return {}
    estimate, true = signals["spacerobot/parameters"]["pi"][-1], signals["spacerobot/truth/parameters"]["pi"][-1]
    telemetry = signals["spacerobot/parameter_estimator"][-1]
    return {"ixx_base": float(estimate[0] / true[0]), "iyy_base": float(estimate[3] / true[3]),
            "izz_base": float(estimate[5] / true[5]), "ixx_base_hat": float(estimate[0]),
            "impossible_bodies": int((smallest_pseudo_inertia_eigenvalues(estimate) <= 0.0).sum()),
            "skipped": float(telemetry["skipped"]), "repaired": float(telemetry["repaired"]),
            "frozen": float(telemetry["frozen"])}


def attitude_error_trace(scenario, signals) -> tuple:
    """t (n,) [s] and the attitude error's angle (n,) [deg]."""
    truth = signals["spacerobot/truth"]
    t = seconds(truth, scenario)
    desired = matched(t, signals["spacerobot/reference"], scenario)["attitude"]
    return t, np.degrees(np.linalg.norm(attitude_errors(truth["attitude"], desired), axis=1))


def joint_error_trace(scenario, signals) -> tuple:
    """t (n,) [s] and the length of the joint errors' vector (n,) [deg]."""
    truth = signals["spacerobot/truth"]
    t = seconds(truth, scenario)
    error = matched(t, signals["spacerobot/reference"], scenario)["joints"] - truth["joints"]
    return t, np.degrees(np.linalg.norm(error, axis=1))


TRACES = (
    Trace("attitude error", "deg", "angle to the reference", ("spacerobot/truth", "spacerobot/reference"),
          attitude_error_trace),
    Trace("joint error", "deg", "length of the joint errors' vector", ("spacerobot/truth", "spacerobot/reference"),
          joint_error_trace),
    recorded("base torque", "N m", "commanded, length of the vector", "spacerobot/base_command", "wrench.torque",
             reduce="norm"),
)
