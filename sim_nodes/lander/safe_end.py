"""How a descent with faults ended, from the truth."""

import math

import numpy as np

from flight_graph.graphs.fault_scores import times
from flight_graph.graphs.glossary import flag, number, recorded, word

SOFT = {"lateral": 0.5, "speed": 0.1, "attitude_error": math.radians(3.0), "rate": math.radians(0.2)}  # [m], [m/s], [rad]
DESCEND = 0  # mode of `lander_ros.mode_manager`
STILL, SILENT = 0.1, 1.0  # [m/s], [s] since the last word of a mode manager that is gone
METRICS = (
    word("end", "landed (a contact within the limits of a soft one), hit (a harder one), below (no contact, but has been "
         f"under the keep-out funnel), holding (slower than {STILL} m/s), climbing, descending (to site or ground)"),
    flag("is_safe", "landed, holding or climbing; descending only under a mode manager that lives and is in its mode "
         "descend", headline=True),
    number("speed_mps", "m/s", "relative to the site, at the contact or at the end", headline=True),
    number("lateral_m", "m", "off the site's normal, at the contact or at the end", headline=True),
    number("height_m", "m", "along the site's normal, at the contact or at the end", headline=True),
    number("attitude_deg", "deg", "angle to the goal's attitude, at the contact or at the end"),
    number("clearance_min_m", "m", "smallest clearance over the keep-out funnel", headline=True, smallest_is_worst=True),
    number("delta_v_mps", "m/s", "integral of |f|/m", headline=True),
    number("valid_error_max_m", "m", "largest error of a position that was said to be valid, until a contact",
           "none was said to be valid", headline=True),
)
TRACES = (
    recorded("height", "m", "along the site's normal", "lander/truth", "site_position", reduce=2),
    recorded("speed", "m/s", "relative to the site", "lander/truth", "site_velocity", reduce="norm"),
    recorded("clearance", "m", "over the keep-out funnel", "lander/truth", "clearance"),
)


def compute(scenario, signals) -> dict:
    """Metrics of a run, see METRICS; {} where it is so short a part of one that nothing was summed up in it."""
    if not len(signals["lander/truth/summary"]):
        return {}
    last, truth, mode = signals["lander/truth/summary"][-1], signals["lander/truth"], signals["lander/mode"]
    is_alive = len(mode) > 0 and times(scenario, truth)[-1] - times(scenario, mode)[-1] < SILENT
    end = named(last, truth[-1])
    return {
        "end": end,
        "is_safe": end in ("landed", "holding", "climbing") or (
            end == "descending" and bool(is_alive and mode["mode"][-1] == DESCEND)),
        "speed_mps": float(last["speed"]),
        "lateral_m": float(last["lateral"]),
        "height_m": float(truth["site_position"][-1, 2]),
        "attitude_deg": math.degrees(last["attitude_error"]),
        "clearance_min_m": float(last["clearance_min_all"]),
        "delta_v_mps": float(last["delta_v"]),
        "valid_error_max_m": valid_error(scenario, signals),
    }


def named(last, truth) -> str:
    """The name of an end, from the last summary and the last true state."""
    if last["landed"]:
        return "landed" if all(last[name] <= limit for name, limit in SOFT.items()) else "hit"
    if last["clearance_min_all"] <= 0.0:
        return "below"
    if last["speed"] < STILL:
        return "holding"
    return "climbing" if truth["site_velocity"] @ truth["site_position"] > 0.0 else "descending"


def valid_error(scenario, signals) -> float | None:
    """The largest error [m] of estimated positions that were said to be valid, until a contact; None without one."""
    truth, estimate, status = (signals[topic] for topic in ("lander/truth", "lander/odom", "lander/navigation_status"))
    flying = truth["landed"] < 0.5
    told = np.intersect1d(times(scenario, estimate), times(scenario, status))
    known = np.intersect1d(times(scenario, truth)[flying], told)
    rows = [np.searchsorted(times(scenario, records), known) for records in (truth, estimate, status)]
    errors = estimate["pose"]["pose"]["position"][rows[1]] - truth["site_position"][rows[0]]
    valid = errors[status["valid"][rows[2]] > 0.5]
    return float(np.linalg.norm(valid, axis=1).max()) if len(valid) else None
