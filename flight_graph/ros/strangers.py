"""Names the publishers and subscribers of other nodes that this node's topics do not match, and says what to do."""

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, ReliabilityPolicy

LOOK_S = 0.5  # [s] between two looks at the graph
_LOOKS = 10  # so often a node is waited for whose endpoint is found before its name
_UNKNOWN = "_NODE_NAME_UNKNOWN_"  # as rcl calls it
_UNNAMED = "of a participant that names none"
_STRONG = {"reliability": ReliabilityPolicy.RELIABLE, "durability": DurabilityPolicy.TRANSIENT_LOCAL,
           "liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}
_LIMITS = ("deadline", "liveliness_lease_duration")
_ENDLESS_NS = 2**62  # [ns] what is longer, or 0, is no limit


class Strangers:
    """Looks at the graph now and then from the executor's thread, and tells each thing that does not fit once."""

    def __init__(self, node, subscriptions, publishers):
        self._node, self._subscriptions, self._publishers = node, subscriptions, publishers
        self._told, self._unnamed = set(), {}
        node.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self):
        for sentence in misfits(self._node, self._subscriptions, self._publishers):
            if _UNNAMED in sentence:
                self._unnamed[sentence] = looks = self._unnamed.get(sentence, 0) + 1
                if looks < _LOOKS:
                    continue
            if sentence not in self._told:
                self._told.add(sentence)
                self._node.get_logger().warning(sentence)


def misfits(node, subscriptions, publishers) -> list[str]:
    """A sentence for each endpoint of another node that does not match one of these."""
    sentences = []
    for own in subscriptions:
        if node.count_publishers(own.topic) > own.publishers():
            sentences += filter(None, (_publisher_sentence(own, info)
                                       for info in node.get_publishers_info_by_topic(own.topic)))
    for own in publishers:
        if node.count_subscribers(own.topic) > own.subscribers():
            sentences += filter(None, (_subscriber_sentence(own, info)
                                       for info in node.get_subscriptions_info_by_topic(own.topic)))
    return sentences


def _publisher_sentence(own, info) -> str | None:
    """Why nothing comes from a publisher of another node, or None when it fits."""
    name = _name(info)
    if info.topic_type != own.type_name:
        return (f"{own.topic}: the node {name} publishes {info.topic_type} there, this node reads {own.type_name}: nothing "
                "is received from it. Remap one of the two")
    why = _policies(info.qos_profile, own.qos_profile)
    if why is None:
        return None
    return (f"{own.topic}: nothing is received from the node {name}. It offers {_words(info.qos_profile)}; this node asks "
            f"for {_words(own.qos_profile)}; what does not fit is {why}. Let it offer more"
            f"{_override(own.topic, 'subscription', why, info.qos_profile)}")


def _subscriber_sentence(own, info) -> str | None:
    """Why a subscriber of another node hears nothing, or None when it fits."""
    name = _name(info)
    if info.topic_type != own.type_name:
        return (f"{own.topic}: the node {name} reads {info.topic_type} there, this node publishes {own.type_name}: it "
                "hears nothing. Remap one of the two")
    why = _policies(own.qos_profile, info.qos_profile)
    if why is None:
        return None
    return (f"{own.topic}: the node {name} hears nothing. It asks for {_words(info.qos_profile)}; this node offers "
            f"{_words(own.qos_profile)}; what does not fit is {why}. Let it ask for less"
            f"{_override(own.topic, 'publisher', why, info.qos_profile)}")


def _policies(offered, asked) -> str | None:
    """The policies in which an offer falls short, or None when the two match."""
    short = [policy for policy, strong in _STRONG.items()
             if getattr(asked, policy) == strong and getattr(offered, policy) != strong]
    short += [policy for policy in _LIMITS if _limit_ns(offered, policy) > _limit_ns(asked, policy)]
    return " and ".join(short) or None


def _limit_ns(profile, policy) -> int:
    nanoseconds = getattr(profile, policy).nanoseconds
    return nanoseconds if 0 < nanoseconds < _ENDLESS_NS else _ENDLESS_NS


def _words(profile) -> str:
    return f"{profile.reliability.name.lower()}, {profile.durability.name.lower()}"


def _override(topic, side, why, wanted) -> str:
    settings = [f"-p qos_overrides.{topic}.{side}.{policy}:={getattr(wanted, policy).name.lower()}"
                for policy in ("reliability", "durability") if policy in why]
    return f", or start this node with {' '.join(settings)}" if settings else ""


def _name(info) -> str:
    if info.node_name == _UNKNOWN:
        return _UNNAMED
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"
