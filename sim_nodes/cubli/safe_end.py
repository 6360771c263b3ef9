"""How a run of the rover with faults ended, from the truth of the physical plant.

Limits: no lift-off; a touch-down no faster than TOUCH, which from a corner that is let go, without any torque, is 0.012 m/s
on the asteroid's 0.002 m/s^2.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from cubli_ros.jump_condition import largest_ratio
from flight_graph.graphs.fault_scores import times
from flight_graph.graphs.glossary import flag, number, recorded, word

TOUCH, SPIN = 0.015, 0.5  # [m/s], [rad/s]
UPRIGHT, HELD, SETTLING = 0.05, 0.35, 0.01  # [rad] balanced and held within this tilt; [rad/s] and rate at the end
BALANCE, HOLD, REST = 0, 1, 2  # modes of `cubli_ros.mode_manager`
LANDED, FELL, JAMMED = 1, 2, 3
SAFE = ("balanced", "held", "resting", "let down", "passive")
METRICS = (
    word("end", "balanced, held, resting (on its way down), let down, passive (down without torque or law), leaning (lost, "
         f"but still up), fell (touched down faster than {TOUCH} m/s or with more than {SPIN} rad/s), jumped, jammed"),
    flag("is_safe", "the end is balanced, held, resting, let down or passive, and no limit was broken", headline=True),
    number("tilt_max", "rad", "largest angle between the body diagonal and up, until the run was decided", headline=True),
    number("attitude_error_max", "rad", "largest error of an attitude that was said to be valid, from 1 s on",
           "there was none", headline=True),
    number("rate_across_max", "rad/s", "largest rate across the body diagonal", headline=True),
    number("spin_max", "rad/s", "largest rate along the body diagonal"),
    number("wheel_speed_max", "rad/s", "largest wheel speed"),
    number("normal_force_min", "m g", "smallest normal force", headline=True, smallest_is_worst=True),
    number("friction_ratio_max", "1", "largest ratio of tangential to normal force", "contact is lost"),
    number("lift_off_s", "s", "first time without contact", "it stays on the ground"),
    number("slip_s", "s", "first time outside the friction cone", "it never slips"),
    number("touch_s", "s", "when another corner touched down", "none did"),
    number("touching_speed", "m/s", "speed of that corner, into the ground", "none did"),
)
TRACES = (
    recorded("rate", "rad/s", "|omega|", "cubli/truth", "rates", reduce="norm"),
    recorded("wheel speed", "rad/s", "largest of the three wheels", "cubli/truth", "wheel_speed", reduce="largest"),
    recorded("normal force", "m g", "at the corner", "cubli/truth/contact", "normal_force"),
)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS."""
    contact, truth = signals["cubli/truth/contact"], signals["cubli/truth"]
    t, last = times(scenario, truth), contact[-1]
    running = contact["phase"] != 2.0
    running[0] = True
    tilt = tilts(signals["cubli/truth/attitude"]["orientation"])
    rates = truth["rates"] - truth["rates"].mean(axis=1, keepdims=True)
    across = np.sqrt((rates * rates).sum(axis=1))
    spin = np.abs(truth["rates"].sum(axis=1)) / math.sqrt(3.0)
    late = running & (t >= t[running][-1] - 5.0)
    mode = int(signals["cubli/mode"]["mode"][-1]) if len(signals["cubli/mode"]) else BALANCE
    found = {
        "tilt_max": float(tilt[running].max()), "attitude_error_max": attitude_error(scenario, signals, t, running),
        "rate_across_max": float(across[running].max()),
        "spin_max": float(spin[running].max()),
        "wheel_speed_max": float(np.abs(truth["wheel_speed"]).max()),
        "normal_force_min": float(contact["normal_force"][running].min()),
        "friction_ratio_max": largest_ratio(contact["friction_ratio"][running]),
        "lift_off_s": _time(last["lift_off_time"]), "slip_s": _time(last["slip_time"]), "touch_s": _time(last["end_time"]),
        "touching_speed": float(last["touching_speed"]) if last["end_time"] >= 0.0 else None,
    }
    silent = t[-1] - times(scenario, signals["cubli/mode"])[-1] > 1.0 if len(signals["cubli/mode"]) else True
    end = named(found, int(last["outcome"]), mode, silent, float(tilt[late].max()), float(across[late].max()))
    return {"end": end, "is_safe": end in SAFE, **found}


def named(found, outcome, mode, silent, tilt, rate) -> str:
    """The name of an end; silent: the manager said nothing any more; tilt, rate: largest of the last 5 s."""
    if found["lift_off_s"] is not None or outcome == LANDED:
        return "jumped"
    if outcome == JAMMED:
        return "jammed"
    if outcome == FELL:
        if found["touching_speed"] > TOUCH or found["spin_max"] > SPIN:
            return "fell"
        return "let down" if mode == REST and not silent else "passive"
    if silent:
        return "leaning"
    if mode == REST:
        return "resting"
    if mode == HOLD:
        return "held" if tilt < HELD and rate < SETTLING else "leaning"
    return "balanced" if tilt < UPRIGHT and rate < SETTLING else "leaning"


def tilts(quaternions) -> np.ndarray:
    """Angles (n,) between the body diagonal and up [rad]; quaternions (n, 4): body to balance frame."""
    diagonal = np.full(3, 1.0 / math.sqrt(3.0))
    return np.arccos(np.clip(Rotation.from_quat(quaternions).apply(diagonal) @ diagonal, -1.0, 1.0))


def attitude_error(scenario, signals, t, running):
    """Largest error [rad] of estimates that were said to be valid."""
    if not len(signals["cubli/attitude"]) or not len(signals["cubli/estimator_status"]):
        return None
    estimate, status = signals["cubli/attitude"], signals["cubli/estimator_status"]
    known = np.intersect1d(times(scenario, estimate), times(scenario, status))
    known = known[(known >= 1.0) & (known <= t[running][-1])]
    rows = [np.searchsorted(times(scenario, signal), known) for signal in (estimate, status)]
    valid = status["valid"][rows[1]] > 0.0
    if not valid.any():
        return None
    true = signals["cubli/truth/attitude"]["orientation"][np.searchsorted(t, known[valid])]
    found = Rotation.from_quat(estimate["orientation"][rows[0]][valid])
    return float((Rotation.from_quat(true).inv() * found).magnitude().max())


def _time(value):
    return float(value) if value >= 0.0 else None
