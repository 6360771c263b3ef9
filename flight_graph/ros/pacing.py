"""The clock master of a run that is controlled: before each of its firings it obeys, stands, and keeps the rate."""

import time

from flight_graph.ros import lockstep
from flight_graph.ros import simulation_settings as said
from flight_graph.ros.ports import LoopOnly, RawPublisher, RawSubscription
from flight_graph.ros.simulation_settings import Control, Order, Report
from flight_graph.ros.standing import KEPT, ORDERED
from flight_graph.ros.texts import TYPE, text_of, text_payload
from flight_graph.timebase import SECOND

_CATCH_UP_NS = SECOND // 10  # [ns] lockstep: a delay up to this is made good


class Pacing:
    """It stands until it is told to run. others: nodes that have done all before t when it stands in lockstep at t."""

    def __init__(self, node, control: Control, others: list[str]):
        self._node, self._control, self._others = node, control, others
        self._orders = RawSubscription(node, said.ORDERS, TYPE, ORDERED, LoopOnly())
        self._reports = RawPublisher(node, said.REPORTS, TYPE, KEPT)
        self._number, self._rate = 0, control.rate
        self._runs, self._has_begun = False, False
        self._steps = self._left = None  # of the steps that it was told to make
        self._due_ns = None  # lockstep: when the next firing is due, by the wall's clock

    def before(self, t_ns: int) -> int:
        """Before the firing at t: return when it may come, and how long [ns] the run has stood.

        Raises Stopped, and FlightError where a node does not come to t.
        """
        if not self._has_begun:
            self._has_begun = True
            self._stand(t_ns, "")
        began_ns = None
        while True:
            self._obey(t_ns)
            if self._runs and self._left == 0:
                self._stand(t_ns, said.STEPPED)
            if self._runs and (left_ns := self._ahead_ns()) <= 0:
                break
            began_ns = began_ns or time.monotonic_ns()
            self._orders.wait(left_ns if self._runs else SECOND)
            self._node.check_alive()
        if self._left is not None:
            self._left -= 1
        return time.monotonic_ns() - began_ns if began_ns else 0

    def end(self, t_ns: int) -> None:
        """The run is over."""
        self._report(t_ns, said.STEPPED if self._steps else "", is_over=True)

    def _obey(self, t_ns):
        while (message := self._orders.take()) is not None:
            order = said.parsed(Order, text_of(message))
            if order is None or order.segment != self._control.segment or order.number <= self._number:
                continue
            self._number = order.number
            if order.do == said.STAND:
                self._stand(t_ns, "paused" if self._runs else "")
            elif order.do == said.RATE:
                self._take_rate(order.rate)
                self._report(t_ns, f"rate {order.rate:g}" if order.rate else "rate as fast as the graph answers")
            elif order.do == said.NOTE:
                self._settle(t_ns, None)
                self._report(t_ns, order.note)
            else:
                self._runs, self._due_ns = True, None
                self._steps = self._left = order.steps if order.do == said.STEP else None
                if order.do == said.RUN:
                    self._report(t_ns, "played")

    def _take_rate(self, rate):
        self._rate, self._due_ns = rate, None
        if not self._node.settings.lockstep:
            self._node.settings.factor = rate

    def _stand(self, t_ns, done):
        """Stand before the firing at t, when all other nodes have done what comes before."""
        self._settle(t_ns, self._others)
        if self._steps and done == "paused":
            self._report(t_ns, said.STEPPED)
        self._runs = False
        self._report(t_ns, done)
        self._steps = self._left = None

    def _settle(self, t_ns, names):
        """Lockstep: wait until nodes have done what comes before t; the recorder among all (None): it has written it."""
        if self._node.settings.lockstep:
            lockstep.wait_for_nodes(self._node, t_ns, names)

    def _report(self, t_ns, done, is_over=False):
        ticks = self._steps - self._left if self._steps and done == said.STEPPED else 0
        self._reports.publish(text_payload(Report(
            self._control.segment, self._number, t_ns, not self._runs, self._rate, done, ticks, is_over).text()))

    def _ahead_ns(self) -> int:
        """Lockstep: how long until the next firing is due, which then counts as made; realtime keeps its own time."""
        if not self._rate or not self._node.settings.lockstep:
            return 0
        now = time.monotonic_ns()
        self._due_ns = now if self._due_ns is None else max(self._due_ns, now - _CATCH_UP_NS)
        if (left_ns := self._due_ns - now) <= 0:
            self._due_ns += round(self._node.settings.period_ns / self._rate)
        return left_ns
