"""How well a run's monitors met its faults: detection, isolation, false alarms, recovery, the mode at the end."""

import numpy as np

from flight_graph.faults.report import MONITORS, REPORT
from flight_graph.graphs.metric_entry import flag, number, word
from flight_graph.timebase import SECOND

MODE = "mode"  # the output of a mode manager
METRICS = (
    number("fault_onset_s", "s", "when the first fault became active", missing="no fault became active"),
    flag("fault_detected", "an actionpoint acted from the onset on"),
    number("fault_detection_delay_s", "s", "from the onset to the first act of an actionpoint", missing="none acted",
           headline=True),
    word("fault_detected_by", "the actionpoint of that first act", missing="none acted"),
    flag("fault_isolated", "the first actionpoint that acted and blames units blames one that failed",
         missing="none that blames a unit acted"),
    number("false_alarms", "1", "acts before any fault, or in a run without one"),
    number("fault_recovery_s", "s", "from the onset to the last time that a watchpoint held",
           missing="a watchpoint still holds at the end"),
    word("final_mode", "mode of the mode manager at the end"),
    number("mode_changes", "1", "changes of mode"),
)


def scores(scenario, signals, from_above: list | None = None) -> dict:
    """The scores of a run; {} where its scenario has neither faults nor monitors, or did not record them.

    signals: a mapping topic -> structured array, as for `flight_graph.graphs.metrics.compute`; from_above: what `strikes`
    says of the scenarios that include this one, None where none of their faults is of this vehicle.
    """
    if scenario.faults.faults and REPORT not in signals:
        return {}
    struck = [*strikes(scenario, signals), *(from_above or [])]
    onset = min((time for time, _ in struck if time is not None), default=None)
    found = {"fault_onset_s": onset} if scenario.faults.faults or from_above is not None else {}
    if scenario.faults.monitors and MONITORS in signals:
        found |= _judged(scenario, signals[MONITORS], onset, {unit for time, unit in struck if time is not None})
    return found | _modes(scenario, signals)


def strikes(scenario, signals, vehicle: str = "") -> list[tuple[float | None, str]]:
    """(when it first became active [s], None: never; the unit that fails) of each fault of a scenario, but for those of its
    vehicles; of those in one vehicle alone where it is named, with the unit as that has it.
    """
    if REPORT not in signals:
        return []
    report, inside = signals[REPORT], f"{vehicle}." if vehicle else ""
    at, found = times(scenario, report), []
    for fault in scenario.faults.faults:
        if fault.place.node.startswith(inside):
            active = np.flatnonzero(report[fault.id] > 0.0)
            found.append((float(at[active[0]]) if len(active) else None, fault.unit.removeprefix(inside)))
    return found


def in_vehicle(scenario, signals, vehicle: str, from_above: list | None = None) -> list | None:
    """What `scores` of a vehicle take from above: strikes of the scenario and of those that include it."""
    inside = f"{vehicle}."
    higher = None if from_above is None else [(time, unit.removeprefix(inside)) for time, unit in from_above
                                              if unit.startswith(inside)]
    if REPORT not in signals or not any(fault.place.node.startswith(inside) for fault in scenario.faults.faults):
        return higher or None
    return [*strikes(scenario, signals, vehicle), *(higher or [])]


def times(scenario, records) -> np.ndarray:
    """The stamps (n,) of records [s] since the start of the run."""
    stamp = records["header"]["stamp"]
    return ((stamp["sec"].astype(np.int64) * SECOND + stamp["nanosec"]) - scenario.epoch_ns) / SECOND


def _judged(scenario, status, onset, failed):
    t, monitors = times(scenario, status), scenario.faults.monitors
    acts = sorted((float(t[at]), number, action.entry) for number, action in enumerate(monitors.actions)
                  for at in np.flatnonzero(np.diff(status[action.entry.id], prepend=0.0) > 0.0))
    later = [] if onset is None else [act for act in acts if act[0] >= onset]
    blaming = [entry for _, _, entry in later if entry.blames]
    held = np.array([status[watch.entry.id] > 0.0 for watch in monitors.watches]).any(axis=0)
    if onset is not None:
        held &= t >= onset
    last = np.flatnonzero(held)
    found = {"false_alarms": len(acts) - len(later)}
    if onset is None:
        return found
    recovery = 0.0
    if len(last):
        recovery = None if last[-1] == len(t) - 1 else float(t[last[-1]]) - onset
    return found | {
        "fault_detected": bool(later),
        "fault_detection_delay_s": later[0][0] - onset if later else None,
        "fault_detected_by": later[0][2].id if later else None,
        "fault_isolated": bool(set(blaming[0].blames) & failed) if blaming else None,
        "fault_recovery_s": recovery,
    }


def _modes(scenario, signals):
    for node in scenario.graph.nodes.values():
        modes = getattr(node.component, "modes", ())
        if modes and MODE in node.component.outputs and node.component.outputs[MODE].topic in signals:
            record = signals[node.component.outputs[MODE].topic][-1:]
            if len(record):
                return {"final_mode": modes[int(record["mode"][0])], "mode_changes": int(record["changes"][0])}
    return {}
