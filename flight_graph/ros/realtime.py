"""Realtime: the clock master steps on the wall clock, holds a command that is late, counts what was missed. So do other
plants, by its /clock.

Every other node fires when the newest message of its fastest input belongs to one of its firings, and waits for its other
inputs for at most one period. Without the settings of a graph (a node started by hand) this is how a node runs alone; it
may be among strangers then, whose stamps are on no grid (`flight_graph.ros.ticks`) or of another clock.
"""

import time
from dataclasses import dataclass, field

import numpy as np

from flight_graph.faults.report import REPORT
from flight_graph.ros import lockstep, matching
from flight_graph.ros.clock import ClockInput
from flight_graph.ros.ticks import Ticks, epoch_of
from flight_graph.timebase import SECOND
from msg_schemas.signal import SignalMismatch

_OTHER_CLOCK_NS = 10 * SECOND  # [ns] a node alone takes stamps that are off by more for those of another clock


@dataclass
class Statistics:
    """What a realtime loop counts. latencies_us: publish to last command of a tick, of the newest 100 000 ticks."""

    ticks: int = 0
    late_inputs: int = 0
    deadline_misses: int = 0
    stale_commands: int = 0
    refused_messages: int = 0
    latencies_us: list = field(default_factory=list)
    reasons: list = field(default_factory=list)  # why messages were refused

    def summary(self) -> dict:
        counts = {key: value for key, value in vars(self).items() if key != "latencies_us" and value != []}
        if self.latencies_us:
            for percent in (50, 90, 99, 100):
                counts[f"latency_us_p{percent}"] = float(np.percentile(self.latencies_us[-100_000:], percent))
        return counts


def run(node) -> None:
    """Run a node on the wall clock until its end. Raises Stopped, FlightError."""
    node.statistics = Statistics()
    if node.settings.supervised or not node.settings.clock_master:
        matching.match(node)
    else:
        matching.look_around(node)
    node.progress.tell(0)
    node.call("start", 0)
    began = time.monotonic()
    if node.settings.clock_master:
        lockstep.wait_for_nodes(node, 0)
        _run_master(node)
    elif node.component.update is not None:
        _run_plant(node)
    elif node.component.inputs and not node.component.modes and any(
            not node.settings.sources[name].foreign for name in node.inputs):
        _run_follower(node)
    else:
        _run_by_the_clock(node)
    node.wall_s = time.monotonic() - began
    node.announce({"statistics": node.statistics.summary()})


def _run_master(node):
    settings, statistics = node.settings, node.statistics
    beats = Beats(node)
    deadline, t_ns = time.monotonic_ns(), 0
    while not settings.duration_ns or t_ns < settings.duration_ns:
        node.check_alive()
        if node.pacing:
            deadline += node.pacing.before(t_ns)
        wall_period = round(settings.period_ns / settings.factor)  # [ns]
        deadline += wall_period
        node.look(t_ns)
        node.publish_clock(t_ns)
        part = "output" if node.component.kernel is None else "kernel"
        node.call(part, t_ns)
        node.publish_outputs(t_ns)
        published = time.monotonic_ns()
        _gather(node, t_ns, deadline)
        statistics.latencies_us.append((time.monotonic_ns() - published) / 1e3)
        node.call("update", t_ns)
        beats.check(t_ns)
        now = time.monotonic_ns()
        statistics.ticks += 1
        if now > deadline + wall_period:
            statistics.deadline_misses += 1
        elif deadline > now:
            time.sleep((deadline - now) / 1e9)
        t_ns += settings.period_ns
        if t_ns % SECOND < settings.period_ns:
            node.announce({"progress": t_ns / SECOND})
    if node.pacing:
        node.pacing.end(t_ns)


def _run_plant(node):
    """A plant that does not set the time: it speaks at every period of /clock, and takes the commands of half a period."""
    settings, clock = node.settings, ClockInput(node)
    t_ns = -(-clock.first(node) // settings.period_ns) * settings.period_ns if settings.joins else 0
    while not settings.duration_ns or t_ns < settings.duration_ns:
        node.check_alive()
        node.look(t_ns)
        clock.wait_until(t_ns, node)
        node.call("output", t_ns)
        node.publish_outputs(t_ns)
        _gather(node, t_ns, time.monotonic_ns() + round(0.5 * settings.period_ns / settings.factor))
        node.call("update", t_ns)
        node.statistics.ticks += 1
        t_ns += settings.period_ns
        node.progress.tell(t_ns)


def _gather(node, t_ns, deadline):
    """Take the commands of t until the deadline; hold the last ones where they are late; zero them when stale."""
    for name, port in node.inputs.items():
        expected = node.settings.sources[name].expected_ns(t_ns)
        wanted = t_ns if expected is None else expected
        while port.stamp_ns is None or port.stamp_ns < wanted:
            if not _take(node, name, port, t_ns):
                left = deadline - time.monotonic_ns()
                if left <= 0 or (expected is None and port.stamp_ns is None):
                    break
                port.wait(left)
                node.check_alive()
        if expected is not None and port.stamp_ns != expected:
            node.statistics.late_inputs += 1
        if port.stamp_ns is not None and t_ns - port.stamp_ns > node.settings.stale_after_s * SECOND:
            node.statistics.stale_commands += 1
            if node.statistics.stale_commands == 1:
                node.get_logger().warning(f"{port.subscription.topic}: the newest message is older than "
                                          f"{node.settings.stale_after_s:g} s; this input is zero until another comes")
            port.clear()


def _take(node, name, port, t_ns) -> bool:
    """Move the next message stamped <= t into the record; False when there is none. Refused messages are counted."""
    found = _peek(node, port)
    if found is None:
        return False
    is_among_strangers = not node.settings.supervised or node.settings.sources[name].foreign
    if is_among_strangers and (port.is_foreign or abs(found - t_ns) > _OTHER_CLOCK_NS):
        return _take_newest(node, port, t_ns)
    if found > t_ns:
        return False
    port.accept()
    return True


def _take_newest(node, port, t_ns) -> bool:
    """Take a message by its arrival: its stamp is of another clock than this node's."""
    while _peek(node, port) is not None:
        port.accept()
    if not port.is_foreign:
        port.is_foreign = True
        node.get_logger().warning(
            f"the stamps of {port.subscription.topic} are {abs(port.stamp_ns - t_ns) / SECOND:.6g} s off this node's time: "
            "they are of another clock, and each message counts as stamped when it arrives")
    port.stamp_ns = t_ns
    return True


def _peek(node, port) -> int | None:
    """The t of the next message that fits, or None."""
    while True:
        try:
            return port.peek()
        except SignalMismatch as error:
            _refuse(node, error)


def _refuse(node, error):
    """Count a message that does not fit, and say why: once for each reason."""
    node.statistics.refused_messages += 1
    if str(error) not in node.statistics.reasons:
        node.statistics.reasons.append(str(error))
        node.get_logger().error(str(error))


def _run_follower(node):
    settings = node.settings
    trigger = _trigger(node)
    ticks = Ticks(settings.period_ns, trigger.subscription.topic, node.get_logger().warning)
    end_ns, before_ns = settings.duration_ns, None
    while True:
        node.check_alive()
        node.look(0 if before_ns is None else before_ns + 1)
        t_ns = _peek(node, trigger)
        if t_ns is None:
            trigger.wait(SECOND)
            if trigger.stamp_ns is None and not settings.supervised:
                node.get_logger().info(f"waiting for {trigger.subscription.topic}", throttle_duration_sec=5.0)
            continue
        if not settings.knows_epoch:
            t_ns = _find_epoch(node, trigger)
        trigger.accept()
        stamp_ns, t_ns = t_ns + settings.epoch_ns, _tick(t_ns, settings, ticks)
        if t_ns is None:
            continue
        span_ns = 1 if settings.supervised or before_ns is None else max(1, t_ns - before_ns)
        before_ns = t_ns
        deadline = time.monotonic_ns() + round(settings.period_ns / settings.factor)
        for name, port in node.inputs.items():
            if port is not trigger:
                _follow(node, name, port, t_ns, deadline)
        node.call("kernel" if node.component.kernel is not None else "output", t_ns, stamp_ns, span_ns)
        node.publish_outputs(t_ns, span_ns)
        node.call("update", t_ns)
        node.statistics.ticks += 1
        node.progress.tell(t_ns)
        if end_ns and t_ns + settings.period_ns >= end_ns:
            return


def _find_epoch(node, trigger) -> int:
    """Count time from where the first message says; return its t."""
    node.settings.knows_epoch = True
    node.count_from(epoch_of(trigger.peek() + node.settings.epoch_ns))
    return trigger.peek()


def _tick(t_ns, settings, ticks) -> int | None:
    """The t of the firing that a message belongs to. In a graph that is its stamp, or it belongs to none."""
    if settings.supervised:
        return None if t_ns % settings.period_ns else t_ns
    return ticks.of(t_ns)


def _follow(node, name, port, t_ns, deadline):
    expected = node.settings.sources[name].expected_ns(t_ns)
    while expected is not None and (port.stamp_ns is None or port.stamp_ns < expected):
        if not _take(node, name, port, t_ns):
            left = deadline - time.monotonic_ns()
            if left <= 0:
                node.statistics.late_inputs += 1
                return
            port.wait(left)
            node.check_alive()
    if expected is None:
        while _take(node, name, port, t_ns):
            pass


def _trigger(node):
    """The input that sets the firing: the fastest one of known rate without delay, else the first; no foreign node's."""
    own = {name: source for name, source in node.settings.sources.items() if name in node.inputs and not source.foreign}
    known = [(source.period_ns, name) for name, source in own.items() if source.period_ns and not source.delay]
    return node.inputs[min(known)[1] if known else next(iter(own))]


def _run_by_the_clock(node):
    """Fire at every period of /clock, with the inputs that have come by then or come within half a period."""
    settings, clock = node.settings, ClockInput(node)
    t_ns = -(-clock.first(node) // settings.period_ns) * settings.period_ns if settings.joins else 0
    told = ComponentFaults(node)
    while not settings.duration_ns or t_ns < settings.duration_ns:
        node.check_alive()
        node.look(t_ns)
        clock.wait_until(t_ns, node)
        deadline = time.monotonic_ns() + round(0.5 * settings.period_ns / settings.factor)
        for name, port in node.inputs.items():
            _follow(node, name, port, t_ns, deadline)
        node.call("kernel" if node.component.kernel is not None else "output", t_ns)
        node.publish_outputs(t_ns)
        node.call("update", t_ns)
        told.tell(t_ns)
        node.statistics.ticks += 1
        t_ns += settings.period_ns
        node.progress.tell(t_ns)


class ComponentFaults:
    """Tells the starter of the graph when a fault of a whole component begins and ends: it owns the processes."""

    def __init__(self, node):
        self._node, self._active = node, {}

    def tell(self, t_ns: int) -> None:
        """Announce what has changed at t."""
        faults, node = self._node.faults, self._node.graph_name
        if not faults or not faults.is_report(node):
            return
        for fault in (one for one in faults.of_components() if one in faults.of(node)):
            was = self._active.get(fault.id, False)
            now = bool(self._node.outputs[REPORT].record[fault.id][0])
            if now != was:
                self._active[fault.id] = now
                self._node.announce({"fault": fault.id, "of": fault.place.node, "type": fault.entry.type, "active": now,
                                     "t": t_ns / SECOND})


class Beats:
    """Listens whether the other nodes live, and tells the starter of the graph which have fallen silent, again and
    again.
    """

    def __init__(self, node):
        self._node, self._silent = node, {}  # name -> when it was told last (monotonic) [s]
        self._watches = {name: (node.watches[name], allowed / SECOND) for name, allowed in node.settings.beats.items()}

    def check(self, t_ns: int) -> None:
        """Look at all nodes at t."""
        now = time.monotonic()
        for name, (watch, allowed) in self._watches.items():
            watch.read()
            late = now - watch.heard > allowed
            if late and now - self._silent.get(name, 0.0) > allowed:
                if name not in self._silent:
                    self._node.get_logger().error(f"the node {name} is silent since t = {max(watch.t_ns, 0) / SECOND:g} s")
                self._silent[name] = now
                self._node.announce({"silent": name, "came": max(watch.t_ns, 0) / SECOND, "t": t_ns / SECOND})
            elif not late and name in self._silent:
                del self._silent[name]
                self._node.announce({"back": name, "t": t_ns / SECOND})
