"""The start of a node among others: wait until every declared reader and writer is there, refuse a second source."""

import os
import time

from flight_graph.errors import FlightError
from flight_graph.ros.strangers import misfits

DISCOVERY_S = 1.0  # [s] nodes of one machine find each other in less


def match(node, others=None) -> None:
    """Wait until every declared reader and writer is matched. Raises FlightError naming what is missing.

    others(): what else is missing, in words.
    """
    if not node.settings.joins:  # in a running graph the dead one's topics linger for a while
        _refuse_second_source(node)
    deadline = time.monotonic() + node.settings.match_s
    while missing := _unmatched(node) or (others and others()):
        node.check_alive()
        if time.monotonic() > deadline:
            raise FlightError(f"{node.graph_name}: waited {node.settings.match_s:g} s for {missing}")
        time.sleep(0.01)
    if not node.settings.joins:
        _refuse_second_source(node)
    for port in node.inputs.values():
        port.sources = sources_of(node, port)


def sources_of(node, port) -> str:
    """The nodes that publish an input's topic, in words."""
    return " and ".join(sorted(info.node_name for info in node.get_publishers_info_by_topic(port.subscription.topic)))


def look_around(node) -> None:
    """Before a lone clock master speaks: wait until it would have found another source of its topics."""
    deadline = time.monotonic() + DISCOVERY_S
    while time.monotonic() < deadline:
        _refuse_second_source(node, patient=True)
        node.check_alive()
        node.stopping.wait(0.05)
    _refuse_second_source(node)


def _unmatched(node) -> str | None:
    for other, watch in node.watches.items():
        if not watch.is_matched():
            return f"the node {other}: it has not appeared"
    for name, port in node.inputs.items():
        if node.settings.sources[name].period_ns and port.subscription.publishers() < 1:
            return why_no_publisher(node, f"its input {name}", port, node.settings.sources[name].foreign)
    for name, port in node.outputs.items() if not node.settings.joins else ():  # a running graph may have lost readers
        wanted = node.settings.subscribers[name]
        found = port.subscribers()
        if found < wanted:
            foreign = node.settings.foreign_readers[name]
            hint = f"; {foreign}, a foreign node, has to read it ({port.signal.type_name}; {here()})" if foreign else ""
            return f"readers of its output {name} on {port.publisher.topic}: {found} of {wanted} have appeared{hint}"
    return node.memory.unmatched() or node.progress.unmatched() or node.changes.unmatched()


def why_no_publisher(node, what: str, port, foreign: str = "") -> str:
    """Why nobody publishes what a port (with ``subscription`` and ``signal``) takes. foreign: the node that should, where
    that is a foreign one.
    """
    topic = port.subscription.topic
    others = {info.topic_type for info in node.get_publishers_info_by_topic(topic)} - {port.signal.type_name}
    if others:
        return f"{what}: {topic} carries {', '.join(others)}, this input takes {port.signal.type_name}"
    if unfit := misfits(node, [port.subscription], []):
        return f"{what}: {unfit[0]}"
    if foreign:
        return (f"{what} on {topic}: no publisher has appeared; {foreign} is a foreign node, which is started beside this "
                f"run: it has to publish {port.signal.type_name} there, reliable ({here()})")
    return f"{what} on {topic}: no publisher has appeared"


def here() -> str:
    """Where this node is found."""
    return f"ROS_DOMAIN_ID={os.environ.get('ROS_DOMAIN_ID') or 0}"


def _refuse_second_source(node, patient=False):
    own = (node.get_name(), node.get_namespace())
    topics = {f"{node.graph_name}.{name}": port.publisher.topic for name, port in node.outputs.items()}
    if node.clock:
        topics[f"{node.graph_name} sets the time"] = node.clock.topic
    for what, topic in topics.items():
        found = [(info.node_name, info.node_namespace) for info in node.get_publishers_info_by_topic(topic)]
        others = [other for other in found if other != own] or found[1:]  # a second one may have this node's name
        if not others:
            continue
        unnamed = others[0][0].startswith("_NODE_NAME_UNKNOWN")
        if unnamed and patient:
            continue  # just appearing: its name comes a moment later
        other = "a node whose name is not known yet" if unnamed else f"node {others[0][1].rstrip('/')}/{others[0][0]}"
        raise FlightError(f"{what}: {topic} has a source already ({other}); one topic has one source ({here()})")
