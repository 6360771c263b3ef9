"""Publishes a bag to live topics: raw bytes, in order, at the recorded times, with /clock.

Between messages /clock goes on at a rate of its own, so that timers of nodes on simulation time run. From a terminal
space pauses and resumes, s or the right arrow plays the next message, up and down change the rate.
"""

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

from flight_graph.replays.play import Schedule  # noqa: E402
from flight_graph.ros.keyboard import Keyboard  # noqa: E402
from flight_graph.ros.node import CLOCK, CLOCK_PERIOD_NS, clock_payload  # noqa: E402
from flight_graph.ros.ports import RawPublisher, message_class  # noqa: E402
from flight_graph.timebase import SECOND, stamp_parts  # noqa: E402

_FIRST_READERS_S = 1.0  # [s] readers that are there already are waited for this long
_SLICE_S = 0.02  # [s] longest wait before keys are looked at again
_FASTER = 1.1  # [1] what an arrow does to the rate


@dataclass
class Report:
    """What a playback did. worst_delay_s: how late the latest message was [s of wall time]."""

    messages: int = 0
    topics: int = 0
    worst_delay_s: float = 0.0
    rounds: int = 0


class Timeline:
    """Where a playback stands, in log time; it can be paused, hurried and moved."""

    def __init__(self, start_ns: int, rate: float):
        self.rate, self.paused = rate, False
        self._at_ns, self._since = start_ns, time.monotonic()

    def now_ns(self) -> int:
        """The log time now."""
        if self.paused:
            return self._at_ns
        return self._at_ns + round((time.monotonic() - self._since) * SECOND * self.rate)

    def move(self, stamp_ns: int) -> None:
        """Go on from another log time."""
        self._at_ns, self._since = stamp_ns, time.monotonic()

    def pause(self, paused: bool) -> None:
        self.move(self.now_ns())
        self.paused = paused

    def hurry(self, factor: float) -> None:
        """Change the rate."""
        self.move(self.now_ns())
        self.rate *= factor

    def wait_s(self, stamp_ns: int) -> float:
        """Wall time [s] until a log time; negative when it is past."""
        return float("inf") if self.paused else (stamp_ns - self.now_ns()) / SECOND / self.rate


def run(schedule: Schedule, loop: bool = False, tell=print) -> Report:
    """Play until the end, or until SIGINT or SIGTERM. tell(sentence) is called for what a person should know."""
    stopping, before = threading.Event(), {}
    for number in (signal.SIGINT, signal.SIGTERM):
        before[number] = signal.signal(number, lambda *_: stopping.set())
    rclpy.init(args=["player"], signal_handler_options=SignalHandlerOptions.NO)
    node = Node("player", start_parameter_services=False, enable_rosout=False)
    try:
        with Keyboard() as keyboard:
            return _Player(node, schedule, stopping, keyboard, tell).play(loop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
        for number, handler in before.items():
            signal.signal(number, handler)


class _Player:
    def __init__(self, node, schedule, stopping, keyboard, tell):
        self._schedule, self._stopping, self._keyboard, self._tell = schedule, stopping, keyboard, tell
        self._publishers = _publishers(node, schedule, tell)
        self._clock = None if schedule.has_clock else RawPublisher(node, *CLOCK)
        self._clock_ns, self._clock_due = None, 0.0
        self._timeline, self._single = None, False
        self._report = Report(topics=len(self._publishers))

    def play(self, loop):
        self._wait_for_readers()
        if self._keyboard.is_there:
            self._tell("space: pause and resume; s or right: next message; up, down: rate")
        gaps = {gap.stamp_ns: gap for gap in self._schedule.gaps()}
        for gap in gaps.values():
            self._tell(_gap_sentence(gap, self._schedule))
        while not self._stopping.is_set():
            self._report.rounds += 1
            self._play_once(gaps)
            if not loop:
                break
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(1.0)
        return self._report

    def _play_once(self, gaps):
        for topic, _, payload in self._schedule.latched():
            if topic in self._publishers:
                self._publish(topic, payload)
        self._timeline, self._clock_ns = Timeline(self._schedule.start_ns, self._schedule.rate), None
        last_ns, last_clock_ns = self._schedule.start_ns, None
        for topic, stamp_ns, payload in self._schedule.messages():
            if stamp_ns > last_ns and last_ns in gaps and gaps[last_ns].passed_over:
                self._timeline.move(stamp_ns)
            last_ns = stamp_ns
            if topic not in self._publishers:
                continue
            if not self._reach(stamp_ns):
                return
            if last_clock_ns is None or stamp_ns - last_clock_ns >= CLOCK_PERIOD_NS:
                last_clock_ns = stamp_ns
                self._tick(stamp_ns)
            self._publish(topic, payload)

    def _publish(self, topic, payload):
        self._publishers[topic].publish(payload)
        self._report.messages += 1

    def _reach(self, stamp_ns) -> bool:
        """Wait until a message is due, with /clock and keys meanwhile; False when the playback is to end."""
        while not self._stopping.is_set():
            self._obey_keys(stamp_ns)
            wait_s = self._timeline.wait_s(stamp_ns)
            if self._single:
                self._single = False
                self._timeline.move(max(stamp_ns, self._timeline.now_ns()))
                return True
            if wait_s <= 0:
                self._report.worst_delay_s = max(self._report.worst_delay_s, -wait_s)
                return True
            if time.monotonic() >= self._clock_due:
                self._clock_due = time.monotonic() + 1.0 / self._schedule.clock_hz
                self._tick(min(self._timeline.now_ns(), stamp_ns))
            self._stopping.wait(min(wait_s, _SLICE_S, max(0.0, self._clock_due - time.monotonic())))
        return False

    def _tick(self, now_ns):
        """Publish /clock, if it is to be made here and moves on."""
        if self._clock is not None and (self._clock_ns is None or now_ns > self._clock_ns):
            self._clock_ns = now_ns
            self._clock.publish(clock_payload(*stamp_parts(now_ns)))

    def _obey_keys(self, stamp_ns):
        key = self._keyboard.pressed()
        if key == "space":
            self._timeline.pause(not self._timeline.paused)
            self._tell(f"{'paused' if self._timeline.paused else 'resumed'} at "
                       f"{(self._timeline.now_ns() - self._schedule.bag.start_ns) / SECOND:.3f} s")
        elif key in ("s", "right"):
            if not self._timeline.paused:
                self._timeline.pause(True)
            self._single = True
        elif key in ("up", "down"):
            self._timeline.hurry(_FASTER if key == "up" else 1.0 / _FASTER)
            self._tell(f"rate {self._timeline.rate:.3g}")

    def _wait_for_readers(self):
        deadline = time.monotonic() + _FIRST_READERS_S
        while time.monotonic() < deadline and not self._stopping.is_set():
            if all(publisher.subscribers() for publisher in self._publishers.values()):
                return
            self._stopping.wait(0.02)


def _gap_sentence(gap, schedule):
    place = (gap.stamp_ns - schedule.bag.start_ns) / SECOND
    if gap.passed_over:
        return (f"nothing was recorded for {gap.seconds:.6g} s from {place:.6g} s on: this is passed over "
                "(--longest-gap inf plays it)")
    return (f"nothing was recorded for {gap.seconds:.6g} s from {place:.6g} s on (--start begins behind it, --longest-gap "
            "passes over it)")


def _publishers(node, schedule, tell):
    """topic -> publisher, of all types that can be imported here. Raises FlightError when there is none."""
    publishers = {}
    for name in schedule.unnamed:
        tell(f"'{name}' is skipped: ROS has no such name; --remap gives it another")
    for name in schedule.topics:
        info = schedule.bag.topics[name]
        if info.problem:
            tell(f"{name} is skipped: it {info.problem}")
            continue
        try:
            message_class(info.type_name)
        except (ImportError, AttributeError, ValueError):
            tell(f"{name} is skipped: {info.type_name} is not installed here")
            continue
        publishers[name] = RawPublisher(node, schedule.names[name], info.type_name, schedule.profiles[name])
    if not publishers:
        raise FlightError(f"bag '{schedule.bag.path}': none of its types is installed here, so nothing can be played")
    return publishers
