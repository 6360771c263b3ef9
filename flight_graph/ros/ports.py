"""Raw topic ends: bytes out of a record, bytes into a record, without message objects and without an executor."""

import importlib
import time

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from flight_graph.ros import slots
from flight_graph.ros.answers import AnswerReader, Judge
from msg_schemas.qos import Qos, alone
from msg_schemas.signal import Signal

SLICE_NS = 50_000_000  # [ns] longest wait before Python looks at signals again


def message_class(type_name: str):
    """The rclpy class of ``package/msg/Type``. Raises ImportError where the package is not installed."""
    package, _, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def profile(qos: Qos) -> QoSProfile:
    """The rclpy form of a row of the QoS table."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if qos.transient_local else DurabilityPolicy.VOLATILE)


def _is_alone(node) -> bool:
    """Whether a node runs by itself, at the pace of the wall: what it has missed is gone."""
    return not node.settings.supervised and not node.settings.lockstep


def overridable(node) -> QoSOverridingOptions | None:
    """Parameters ``qos_overrides.<topic>.subscription.reliability`` and so on, for a node that runs alone."""
    kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
    return None if node.settings.supervised else QoSOverridingOptions(kinds)


def _named(node, topic):
    """A topic as a node has to name it; those of other programs than ours are in no vehicle."""
    return node.in_graph(topic) if hasattr(node, "in_graph") else topic


class LoopOnly(CallbackGroup):
    """Keeps the data subscriptions away from the executor that serves parameters and lifecycle."""

    def can_execute(self, entity):
        return False

    def beginning_execution(self, entity):
        return False

    def ending_execution(self, entity):
        pass


class RawSubscription:
    """A subscription whose serialised messages are taken by the loop, in order."""

    def __init__(self, node, topic: str, type_name: str, qos: Qos, group: CallbackGroup, overrides=None):
        self.message_type = message_class(type_name)
        self.type_name = type_name
        self.qos_profile = profile(qos)
        self._subscription = node.create_subscription(
            self.message_type, _named(node, topic), _never, self.qos_profile, raw=True, callback_group=group,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False), qos_overriding_options=overrides)
        self.topic = self._subscription.topic_name
        self._handle = self._subscription.handle
        self._alone_since = None
        self._wait_set = rclpy_implementation.WaitSet(1, 0, 0, 0, 0, 0, node.context.handle)

    def take(self) -> bytes | None:
        """The next message, or None when none is there."""
        taken = self._handle.take_message(self.message_type, True)
        return None if taken is None else taken[0]

    def take_sent(self) -> tuple[bytes, int] | None:
        """The next message and when it was sent (by its sender's wall clock) [ns], or None when none is there."""
        taken = self._handle.take_message(self.message_type, True)
        return None if taken is None else (taken[0], taken[1]["source_timestamp"])

    def wait(self, nanoseconds: int) -> None:
        """Wait until a message is there, for at most ``nanoseconds`` (and never longer than a slice)."""
        self._wait_set.add_subscription(self._handle)
        self._wait_set.wait(max(0, min(nanoseconds, SLICE_NS)))
        self._wait_set.clear_entities()  # a wait set that still holds a subscription keeps its node alive

    def publishers(self) -> int:
        return self._subscription.get_publisher_count()

    def abandoned_s(self) -> float:
        """How long [s] it has been seen without a publisher by those who ask here while they wait."""
        now = time.monotonic()
        self._alone_since = None if self.publishers() else self._alone_since or now
        return now - (self._alone_since or now)


class RawPublisher:
    """A publisher of serialised messages."""

    def __init__(self, node, topic: str, type_name: str, qos: Qos, overrides=None):
        self.qos_profile = profile(qos)
        self._publisher = node.create_publisher(
            message_class(type_name), _named(node, topic), self.qos_profile, qos_overriding_options=overrides,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False))  # see strangers.py
        self.topic = self._publisher.topic_name
        self.type_name = type_name
        self.publish = self._publisher.publish

    def subscribers(self) -> int:
        return self._publisher.get_subscription_count()

    def wait_for_all_acked(self, seconds: float) -> bool:
        """Wait until every reliable reader has all messages; whether that came true in time."""
        return self._publisher.wait_for_all_acked(Duration(seconds=seconds))


class OutputPort:
    """An output of a component: the record that the kernel fills, and its publisher. slotted: it says what it sends."""

    def __init__(self, node, name: str, signal: Signal, topic: str, slotted: bool = False):
        self.name, self.signal = name, signal
        self.payload, self.record = signal.new()
        self.publisher = RawPublisher(node, topic, signal.type_name, signal.role.qos, overridable(node))
        self._slots = RawPublisher(node, slots.slots_topic(topic), slots.TYPE, slots.QOS_OF_SLOTS) if slotted else None

    def publish(self, stamp_ns: int, count: int = 1) -> None:
        """Send the record ``count`` times, and say so where the topic has slots."""
        for _ in range(count):
            self.publisher.publish(self.payload.tobytes())
        if self._slots is not None:
            self._slots.publish(slots.payload(stamp_ns, count))

    def subscribers(self) -> int:
        """How many readers there are, of its slots too where it has any."""
        found = self.publisher.subscribers()
        return found if self._slots is None else min(found, self._slots.subscribers())


class InputPort:
    """An input of a component: the record that the kernel reads, and the messages still to come.

    Stamps are nanoseconds since the start of the run; ``stamp_ns`` is that of the message in the record, None before; of a
    topic with slots, that of the slot, whose message may be missing or have another stamp.
    """

    def __init__(self, node, name: str, signal: Signal, source, epoch_ns: int, group):
        """source: a `flight_graph.ros.settings.Source`."""
        topic = source.topic
        self.name, self.signal, self.epoch_ns = name, signal, epoch_ns
        self.payload, self.record = signal.new()
        asked = alone(signal.role) if _is_alone(node) else signal.role.qos
        self.subscription = RawSubscription(node, topic, signal.type_name, asked, group, overridable(node))
        self._judge = Judge(signal) if source.foreign else None
        self._reader = self._slots_of(node, topic, source, group) if source.slotted else None
        self.stamp_ns = None
        self._spare, self._spare_record = signal.new()
        self._spare_stamp = self._spare_record
        for part in signal.stamp_path.split("."):
            self._spare_stamp = self._spare_stamp[part]
        self._pending_ns, self._is_filled = None, False
        self.sources = ""  # the nodes that publish it, once they have been found
        self.is_foreign = False  # its stamps are of another clock: each message counts as stamped when it is taken

    def _slots_of(self, node, topic, source, group):
        told = RawSubscription(node, slots.slots_topic(topic), slots.TYPE, slots.QOS_OF_SLOTS, group)
        if source.foreign:
            return AnswerReader(self.subscription, told, self.signal)
        return slots.SlotReader(self.subscription, told, lossy=not node.settings.lockstep)

    def wait(self, nanoseconds: int) -> None:
        """Wait until a message may be there, for at most ``nanoseconds`` (and never longer than a slice)."""
        (self._reader or self.subscription).wait(nanoseconds)

    def count_from(self, epoch_ns: int) -> None:
        """Let t = 0 have another stamp."""
        if self._pending_ns is not None:
            self._pending_ns += self.epoch_ns - epoch_ns
        self.epoch_ns = epoch_ns

    def peek(self) -> int | None:
        """Stamp of the next message that is not in the record yet, or None. Raises SignalMismatch."""
        if self._pending_ns is None:
            stamp_ns, messages = self._next()
            if stamp_ns is None and not messages:
                return None
            for message in messages:
                if self._judge:
                    self._judge.stamp_ns(message)
                self.signal.receive(message, self._spare)
            self._is_filled = bool(messages)
            if stamp_ns is None:
                stamp = self._spare_stamp[0]
                stamp_ns = int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
            self._pending_ns = stamp_ns - self.epoch_ns
        return self._pending_ns

    def _next(self):
        """(stamp of the slot or None, messages) of what comes next; (None, []) when nothing is there."""
        if self._reader is not None:
            return self._reader.next() or (None, [])
        message = self.subscription.take()
        return None, [] if message is None else [message]

    def accept(self) -> None:
        """Move the next message into the record, where there is one."""
        if self._is_filled:
            self.payload[:] = self._spare
        self.stamp_ns, self._pending_ns = self._pending_ns, None

    def discard(self) -> None:
        """Drop the next message."""
        self._pending_ns = None

    def clear(self) -> None:
        """Make the record the signal's zero (the safe value of a stale command)."""
        self.payload[:] = self.signal.new()[0]


def _never(_):
    """A subscription needs a callback; the loop takes the messages itself."""
