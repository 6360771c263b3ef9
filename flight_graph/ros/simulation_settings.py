"""Simulation control as texts: what the node ``simulation`` orders, what the clock master reports. Needs no ROS 2.

``/_simulation/orders`` and ``/_simulation/reports`` carry std_msgs/String: an `Order` or a `Report` as JSON. A run that is
taken back to an earlier time goes on as a new segment, with processes and a bag of its own; the node ``simulation`` stays.
"""

import json
from dataclasses import dataclass

NODE = "simulation"
ORDERS, REPORTS = f"_{NODE}/orders", f"_{NODE}/reports"
RUN, STEP, STAND, RATE, NOTE = "run", "step", "stand", "rate", "note"  # what an order may be; NOTE: when all is in the bag
STEPPED = "stepped"
RECORDED = "flight_graph.control"  # metadata of a bag: what was done, as JSON


@dataclass(frozen=True)
class Control:
    """What every node of a controlled run knows. segment: its number; rate: simulated seconds per wall second, 0: as fast
    as the graph answers; origin: what the segment goes back from, in words.
    """

    segment: int = 0
    rate: float = 0.0
    origin: str = ""

    def text(self) -> str:
        return json.dumps(vars(self))


@dataclass(frozen=True)
class Order:
    """What the clock master is to do. number: greater than that of the order before; steps: of STEP; rate: of RATE;
    note: to be kept in the bag.
    """

    segment: int
    number: int
    do: str
    steps: int = 0
    rate: float = 0.0
    note: str = ""

    def text(self) -> str:
        return json.dumps(vars(self))


@dataclass(frozen=True)
class Report:
    """What the clock master did. number: of the last order that it has obeyed; t_ns: of its next firing; stands: whether
    it waits before that; ticks: that it has fired for a STEP; done: in words, for the bag; empty: nothing was done.
    """

    segment: int
    number: int
    t_ns: int
    stands: bool
    rate: float
    done: str = ""
    ticks: int = 0
    is_over: bool = False

    def text(self) -> str:
        return json.dumps(vars(self))


def control_of(text: str) -> Control | None:
    """The settings in a text; None where the run is not controlled."""
    return Control(**json.loads(text)) if text else None


def parsed(kind: type, text: str) -> Order | Report | None:
    """An `Order` or a `Report` from its text; None for what is none: anybody may publish on a topic."""
    try:
        return kind(**json.loads(text))
    except (ValueError, TypeError):
        return None


def add_entry(entries: list[dict], report: Report, base_ns: int) -> None:
    """Add what was done to the entries for the bag; steps that follow upon steps are one entry."""
    if not report.done or (report.done == STEPPED and not report.ticks):
        return
    tick = report.t_ns // base_ns
    if report.done != STEPPED:
        entries.append({"tick": tick, "t_s": report.t_ns / 1e9, "did": report.done})
        return
    before = entries[-1] if entries else {}
    if before.get("did") == STEPPED:
        before |= {"tick": tick, "t_s": report.t_ns / 1e9, "steps": before["steps"] + report.ticks}
    else:
        entries.append({"tick": tick, "t_s": report.t_ns / 1e9, "did": STEPPED, "steps": report.ticks})
