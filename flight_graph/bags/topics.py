"""The topics of a bag: what its channels and schemas say of each, and whether its messages can be decoded."""

import re
from dataclasses import dataclass, replace

import numpy as np

from flight_graph.bags.description import qos_profiles

_SHORT = re.compile(r"([a-z][a-z0-9_]*)/([A-Za-z][A-Za-z0-9_]*)")  # a type's name as ROS 1 and old recorders write it


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a bag. qos_texts: rosbag2's YAML texts of the offered profiles, one for each channel.

    definition, definition_encoding, type_hash: of its first channel. encoding: of its messages (``cdr`` is decoded).
    problem: why its messages cannot be decoded, as the second half of a sentence; empty where they can.
    """

    name: str
    type_name: str
    count: int
    qos_texts: tuple
    type_hash: str
    definition: str
    definition_encoding: str
    encoding: str = "cdr"
    problem: str = ""

    @property
    def qos_text(self) -> str:
        """The text of the first profile that there is."""
        return next((text for text in self.qos_texts if text), "")

    @property
    def qos(self) -> list:
        """All offered profiles, as dictionaries of rosbag2's keys; none where the text is no list of them."""
        return [profile for text in self.qos_texts for profile in qos_profiles(text)]


def full_type_name(name: str) -> str:
    """``sensor_msgs/msg/Imu`` of ``sensor_msgs/Imu`` and of ``sensor_msgs::msg::Imu``; other names as they are."""
    name = name.replace("::", "/")
    short = _SHORT.fullmatch(name)
    return f"{short[1]}/msg/{short[2]}" if short else name


def list_topics(contents: list) -> dict[str, TopicInfo]:
    """Topic name -> what the files of a bag say of it, in the order of declaration."""
    found = {}
    for part in contents:
        ids, counts = np.unique(part.messages.channel, return_counts=True)
        counted = dict(zip(ids.tolist(), counts.tolist()))
        for channel in part.channels.values():
            info = _of_channel(channel, part.schemas, counted.get(channel.id, 0))
            before = found.get(channel.topic)
            found[channel.topic] = info if before is None else _joined(before, info)
    return found


def _of_channel(channel, schemas, count):
    schema, metadata = schemas.get(channel.schema_id), channel.metadata
    problem = ""
    if channel.message_encoding != "cdr":
        problem = f"is encoded as '{channel.message_encoding}'; only cdr is decoded"
    elif schema is None:
        problem = "has no message definition" if channel.schema_id == 0 else "has lost its message definition"
    return TopicInfo(
        channel.topic, full_type_name(schema.name) if schema else "", count, (metadata.get("offered_qos_profiles", ""),),
        metadata.get("topic_type_hash", ""), schema.data.decode(errors="replace") if schema else "",
        schema.encoding if schema else "", channel.message_encoding, problem)


def _joined(before, info):
    problem = before.problem or info.problem
    if not problem and before.type_name != info.type_name:
        problem = f"carries {before.type_name} and {info.type_name}; one type a topic is decoded"
    return replace(before, count=before.count + info.count, problem=problem,
                   qos_texts=tuple(dict.fromkeys(before.qos_texts + info.qos_texts)))
