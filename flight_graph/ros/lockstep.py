"""Lockstep: a firing at t waits for exactly the messages that belong to t, so timing cannot change a bit."""

import time

from flight_graph.errors import FlightError
from flight_graph.ros.clock import ClockInput
from flight_graph.ros.matching import here, match, sources_of
from flight_graph.ros.standing import Deadline
from flight_graph.timebase import SECOND
from msg_schemas.signal import SignalMismatch

_GONE_S = 2.0  # [s] a node whose topics have been away for longer has ended


def run(node) -> None:
    """Run a node from t = 0, or from a checkpoint, to the end of the run. Raises FlightError, Stopped."""
    settings, component = node.settings, node.component
    paced = any(source.period_ns for source in settings.sources.values())
    grid_ns = settings.clock_period_ns
    clock = None if settings.clock_master or (paced and not grid_ns) else ClockInput(node)
    begin_ns, end_ns = node.memory.begin_ns, settings.duration_ns
    t_ns = -(-begin_ns // settings.period_ns) * settings.period_ns
    match(node)
    node.progress.tell(t_ns)  # of a node slower than the clock master it may lie behind the begin
    if settings.clock_master:
        wait_for_nodes(node, begin_ns)
    if not node.memory.is_restored:
        node.call("start", 0)
    began = time.perf_counter()
    node.memory.tell(t_ns)
    while not end_ns or t_ns < end_ns:
        node.check_alive()
        if node.pacing:
            node.pacing.before(t_ns)
        if settings.clock_master and t_ns % (settings.window_ns // 8 or 1) < settings.period_ns:
            wait_for_nodes(node, t_ns - settings.window_ns)
        if clock and (due_ns := t_ns // grid_ns * grid_ns if grid_ns else t_ns) >= begin_ns:
            clock.wait_until(due_ns, node)
        fire(node, component, t_ns)
        t_ns += settings.period_ns
        node.memory.tell(t_ns)
        node.progress.tell(t_ns)
        if settings.clock_master and t_ns % SECOND < settings.period_ns:
            node.announce({"progress": t_ns / SECOND})
    node.progress.tell(end_ns, now=True)
    if settings.clock_master:
        wait_for_nodes(node, end_ns)
    if node.pacing:
        node.pacing.end(end_ns)
    node.wall_s = time.perf_counter() - began


def fire(node, component, t_ns: int) -> None:
    """One firing at t."""
    if component.kernel is None:
        node.look(t_ns)
        node.publish_clock(t_ns)
        join(node, t_ns, node.watched)  # conditions of faults are decided before the output
        node.call("output", t_ns)
        node.publish_outputs(t_ns)
        join(node, t_ns)
        node.call("update", t_ns)
    else:
        join(node, t_ns)
        node.look(t_ns)  # behind the wait: a run may stand here, and things are set meanwhile
        node.call("kernel", t_ns)
        node.publish_outputs(t_ns)


def join(node, t_ns: int, names=None) -> None:
    """Bring inputs (all, or those of some names) to the message that belongs to a firing at t."""
    for name, port in node.inputs.items() if names is None else [(name, node.inputs[name]) for name in names]:
        expected = node.settings.sources[name].expected_ns(t_ns)
        if expected is None or port.stamp_ns == expected:
            continue
        deadline = Deadline(node)
        while port.stamp_ns != expected:
            _advance(node, name, port, expected, deadline)


def _advance(node, name, port, expected, deadline):
    try:
        found = port.peek()
    except SignalMismatch as error:
        raise FlightError(f"{node.graph_name}.{name}: {error}") from None
    if found is None:
        if deadline.is_over:
            raise FlightError(
                f"{node.graph_name}: waited {node.settings.timeout_s:g} s for its input {name} on "
                f"{port.subscription.topic} from {_source(node, port)}, stamp t = {expected / SECOND:.9f} s")
        port.wait(deadline.left_ns)
        node.check_alive()
        if port.subscription.abandoned_s() > _GONE_S:
            raise FlightError(f"{node.graph_name}: its input {name} has lost its source: {port.sources or 'its node'} "
                              f"publishes {port.subscription.topic} no longer; t = {expected / SECOND:.9f} s is missing")
    elif found <= expected:
        if port.stamp_ns is not None and found <= port.stamp_ns:
            raise FlightError(f"{node.graph_name}.{name}: {port.subscription.topic} carries t = {found / SECOND:.9f} s "
                              f"after t = {port.stamp_ns / SECOND:.9f} s: has the topic a second source?")
        port.accept()
    else:
        raise FlightError(f"{node.graph_name}.{name}: the message of t = {expected / SECOND:.9f} s on "
                          f"{port.subscription.topic} is lost; the next one is stamped {found / SECOND:.9f} s"
                          f"{_second_source(node, port)}")


def _second_source(node, port) -> str:
    """What to think of where an input's topic has several publishers."""
    if port.subscription.publishers() < 2:
        return ""
    return f"; {_source(node, port)} publish it: one topic has one source ({here()})"


def _source(node, port) -> str:
    """The nodes that publish an input's topic, or did, in words."""
    return sources_of(node, port) or f"{port.sources or 'nobody'} (no publisher is left)"


def wait_for_nodes(node, t_ns: int, names=None) -> None:
    """Wait until every watched node (of some names) has come to t. Raises FlightError naming the one that has not."""
    for name, watch in node.watches.items() if names is None else [(name, node.watches[name]) for name in names]:
        deadline = Deadline(node)
        best = watch.t_ns
        while watch.read() < t_ns:
            node.check_alive()
            if watch.t_ns > best:
                best, deadline = watch.t_ns, Deadline(node)
            if deadline.is_over:
                came = f"it has come to t = {watch.t_ns / SECOND:.9f} s" if watch.t_ns >= 0 else "it is not ready"
                raise FlightError(f"{node.graph_name}: waited {node.settings.timeout_s:g} s for the node {name} to reach "
                                  f"t = {max(t_ns, 0) / SECOND:.9f} s; {came}")
            watch.wait(SECOND)
            if watch.abandoned_s() > _GONE_S:
                raise FlightError(f"{node.graph_name}: the node {name} has ended before the run was over; it had come to "
                                  f"t = {max(watch.t_ns, 0) / SECOND:.9f} s")
