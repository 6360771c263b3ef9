"""Who waits in a run that is controlled must know when it stands: that time counts for nobody's patience."""

import time

from flight_graph.ros.ports import LoopOnly, RawSubscription
from flight_graph.ros.simulation_settings import REPORTS, Report, parsed
from flight_graph.ros.texts import TYPE, text_of
from flight_graph.timebase import SECOND
from msg_schemas.qos import Qos

KEPT = Qos(depth=1000, transient_local=True)
ORDERED = Qos(depth=10, transient_local=True)  # who orders waits for the report, so that few are on their way
_NEWEST = Qos(depth=1, transient_local=True)


class Reports:
    """What the clock master reports to a node of its graph. all_of_them: keep each, for `new`."""

    def __init__(self, node, all_of_them: bool = False):
        self._subscription = RawSubscription(node, REPORTS, TYPE, KEPT if all_of_them else _NEWEST, LoopOnly())
        self._last = None

    @property
    def stands(self) -> bool:
        """Whether the run stands, as was heard last."""
        return self._last is not None and self._last.stands

    @property
    def rate(self) -> float | None:
        """Simulated seconds per wall second, as was heard last; None before."""
        return self._last.rate if self._last else None

    def new(self) -> list[Report]:
        """The reports that have come since this was asked last."""
        found = []
        while (message := self._subscription.take()) is not None:
            if report := parsed(Report, text_of(message)):
                self._last = report
                found.append(report)
        return found

    def wait(self) -> None:
        """Wait until one may be there, a little while at most."""
        self._subscription.wait(SECOND)


class Deadline:
    """The end of a wait of a node for another one: its ``timeout_s``, without the time in which the run stands."""

    def __init__(self, node):
        self._node = node
        self._renew()

    def _renew(self):
        self._end_ns = time.monotonic_ns() + int(self._node.settings.timeout_s * SECOND)

    @property
    def left_ns(self) -> int:
        return self._end_ns - time.monotonic_ns()

    @property
    def is_over(self) -> bool:
        if self.left_ns > 0:
            return False
        reports = self._node.reports
        if reports and (reports.new() or reports.stands):
            self._renew()
            return False
        return True
