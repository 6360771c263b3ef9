"""Publishes a bag to live topics: raw bytes, in order, at the recorded times, with /clock."""

import signal
import threading
import time
from dataclasses import dataclass

from flight_graph.errors import FlightError
from flight_graph.ros.environment import prepare_environment

prepare_environment()

import rclpy  # noqa: E402 (reads the environment)
from rclpy.node import Node  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402
from yaml import YAMLError  # noqa: E402

from flight_graph.replays.play import CLOCK_TOPIC, Schedule  # noqa: E402
from flight_graph.ros.node import CLOCK, CLOCK_PERIOD_NS, clock_payload  # noqa: E402
from flight_graph.ros.ports import RawPublisher, message_class  # noqa: E402
from flight_graph.timebase import stamp_parts  # noqa: E402
from msg_schemas.qos import Qos  # noqa: E402

_FIRST_READERS_S = 1.0  # [s] readers that are there already are waited for this long


@dataclass
class Report:
    """What a playback did. worst_delay_s: how late the latest message was [s of wall time]."""

    messages: int = 0
    topics: int = 0
    worst_delay_s: float = 0.0
    rounds: int = 0


def run(schedule: Schedule, loop: bool = False, tell=print) -> Report:
    """Play until the end, or until SIGINT or SIGTERM. tell(sentence) is called for what cannot be played."""
    stopping, before = threading.Event(), {}
    for number in (signal.SIGINT, signal.SIGTERM):
        before[number] = signal.signal(number, lambda *_: stopping.set())
    rclpy.init(args=["player"], signal_handler_options=SignalHandlerOptions.NO)
    node = Node("player", start_parameter_services=False, enable_rosout=False)
    try:
        return _play(node, schedule, loop, stopping, tell)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
        for number, handler in before.items():
            signal.signal(number, handler)


def _play(node, schedule, loop, stopping, tell):
    publishers = _publishers(node, schedule, tell)
    clock = None if schedule.has_clock and CLOCK_TOPIC in publishers else RawPublisher(node, *CLOCK)
    report = Report(topics=len(publishers))
    _wait_for_readers(publishers, stopping)
    while not stopping.is_set():
        report.rounds += 1
        _play_once(schedule, publishers, clock, report, stopping)
        if not loop:
            break
    for publisher in publishers.values():
        publisher.wait_for_all_acked(1.0)
    return report


def _play_once(schedule, publishers, clock, report, stopping):
    began, clock_ns = time.monotonic(), None
    for topic, stamp_ns, payload in schedule.messages():
        publisher = publishers.get(topic)
        if publisher is None:
            continue
        wait_s = began + schedule.due_s(stamp_ns) - time.monotonic()
        if wait_s > 0 and stopping.wait(wait_s) or stopping.is_set():
            return
        report.worst_delay_s = max(report.worst_delay_s, -wait_s)
        if clock is not None and (clock_ns is None or stamp_ns - clock_ns >= CLOCK_PERIOD_NS):
            clock_ns = stamp_ns
            clock.publish(clock_payload(*stamp_parts(stamp_ns)))
        publisher.publish(payload)
        report.messages += 1


def _publishers(node, schedule, tell):
    """topic -> publisher, of all types that can be imported here. Raises FlightError when there is none."""
    publishers = {}
    for name in schedule.topics:
        info = schedule.bag.topics[name]
        try:
            message_class(info.type_name)
        except (ImportError, AttributeError, ValueError):
            tell(f"{name} is skipped: {info.type_name} is not installed here")
            continue
        publishers[name] = RawPublisher(node, name, info.type_name, _qos(info))
    if not publishers:
        raise FlightError(f"bag '{schedule.bag.path}': none of its types is installed here, so nothing can be played")
    return publishers


def _qos(info) -> Qos:
    """The recorded profile, as far as it matters to a reader; reliable where none is recorded."""
    try:
        offered = dict(info.qos[0])
    except (IndexError, KeyError, TypeError, ValueError, YAMLError):
        offered = {}
    depth = offered.get("depth")
    return Qos(depth=depth if isinstance(depth, int) and 0 < depth <= 10_000 else 100,
               reliable=offered.get("reliability") not in ("best_effort", 2),
               transient_local=offered.get("durability") in ("transient_local", 1))


def _wait_for_readers(publishers, stopping):
    deadline = time.monotonic() + _FIRST_READERS_S
    while time.monotonic() < deadline and not stopping.is_set():
        if all(publisher.subscribers() for publisher in publishers.values()):
            return
        stopping.wait(0.02)
