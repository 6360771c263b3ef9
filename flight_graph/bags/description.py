"""The description of a bag (metadata.yaml, version 9) and its text of QoS profiles, as rosbag2 of Jazzy writes them."""

import os
from dataclasses import dataclass
from pathlib import Path

import yaml

from flight_graph import yaml_text
from flight_graph.text_files import read_bytes
from msg_schemas.qos import Qos

VERSION = 9
DISTRO = "jazzy"
FILE_NAME = "metadata.yaml"
LARGEST = 8 << 20  # [bytes] of metadata.yaml
MOST_VALUES = 400_000  # in it
_UNLIMITED = {"sec": 9223372036, "nsec": 854775807}  # rmw's infinite duration


@dataclass(frozen=True)
class TopicDescription:
    """What metadata.yaml says about one topic."""

    name: str
    type_name: str
    qos_text: str
    type_hash: str
    count: int
    encoding: str = "cdr"


def qos_text(qos: Qos) -> str:
    """The YAML text of one offered profile, as in a channel's ``offered_qos_profiles``."""
    duration = "\n    sec: {sec}\n    nsec: {nsec}".format(**_UNLIMITED)
    return (
        f"- history: keep_last\n  depth: {qos.depth}\n"
        f"  reliability: {'reliable' if qos.reliable else 'best_effort'}\n"
        f"  durability: {'transient_local' if qos.transient_local else 'volatile'}\n"
        f"  deadline:{duration}\n  lifespan:{duration}\n"
        f"  liveliness: automatic\n  liveliness_lease_duration:{duration}\n  avoid_ros_namespace_conventions: false"
    )


def qos_profiles(text: str) -> list:
    """The profiles of a text, as dictionaries; none where it is no list of them."""
    try:
        found = from_yaml(text) if text else []
    except (yaml.YAMLError, ValueError, RecursionError):
        return []
    return [profile for profile in found if isinstance(profile, dict)] if isinstance(found, list) else []


def describe(file_name: str, topics, start_ns: int, end_ns: int) -> dict:
    """The content of metadata.yaml below ``rosbag2_bagfile_information``."""
    count = sum(topic.count for topic in topics)
    span = {
        "starting_time": {"nanoseconds_since_epoch": start_ns if count else 0},
        "duration": {"nanoseconds": end_ns - start_ns if count else 0},
    }
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **span,
        "message_count": count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": topic.encoding,
                    "offered_qos_profiles": qos_profiles(topic.qos_text),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.count,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span, "message_count": count}],
        "custom_data": None,
        "ros_distro": DISTRO,
    }


def to_yaml(content: dict) -> str:
    """YAML text in rosbag2's order of keys, without aliases."""
    return yaml.dump(content, Dumper=_Plain, sort_keys=False, default_flow_style=False)


def from_yaml(text):
    """Parse the YAML text of a bag. Raises ValueError."""
    return yaml_text.parse(text, FILE_NAME, MOST_VALUES, LARGEST)


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, data):
        return True


def write_description(folder: Path, content: dict) -> None:
    """Write metadata.yaml so that it is there whole or not at all."""
    partial = folder / (FILE_NAME + ".partial")
    with open(partial, "w", encoding="utf-8", newline="\n") as file:
        file.write(to_yaml({"rosbag2_bagfile_information": content}))
        file.flush()
        os.fsync(file.fileno())
    partial.replace(folder / FILE_NAME)


def read_description(folder: Path) -> dict:
    """The content of metadata.yaml. Raises ValueError with a sentence where it is none."""
    try:
        content = from_yaml(read_bytes(folder / FILE_NAME, FILE_NAME, LARGEST))["rosbag2_bagfile_information"]
        if not isinstance(content, dict) or not isinstance(content["relative_file_paths"], list):
            raise TypeError
    except (yaml.YAMLError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"{FILE_NAME} is not a description of a bag") from error
    return content
