"""What a playback publishes and when: order, times, profiles, latched messages, gaps; without ROS.

Profiles are merged as rosbag2 does it: where a topic's publishers offered one profile it is taken, else the default one
(reliable, volatile), which every reader accepts; durability stays transient local where all of them had it.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from flight_graph import yaml_text
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.errors import FlightError, unknown
from flight_graph.timebase import SECOND
from msg_schemas.qos import Qos

CLOCK_TOPIC = "/clock"
CLOCK_HZ = 40.0  # [Hz] default, as `ros2 bag play --clock` has it
LONGEST_GAP_S = 60.0  # [s] default: a gap that is longer is passed over
_DEEPEST = 10_000  # messages of a publisher's history
_LONGEST_NAME = 255  # characters, as ROS has it
_NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")  # a topic's name as ROS has it
_RELIABLE, _BEST_EFFORT = ("reliable", 1, "system_default", 0, None), ("best_effort", 2)
_LATCHED, _VOLATILE = ("transient_local", 1), ("volatile", 2, "system_default", 0, None)


@dataclass(frozen=True)
class Gap:
    """A stretch without messages: from stamp_ns on for so long."""

    stamp_ns: int
    seconds: float
    passed_over: bool


@dataclass(frozen=True)
class Schedule:
    """What to play of a bag.

    rate: recorded seconds per second of wall time; start_ns: log time of the beginning; names: topic -> the name that it
    is published under; profiles: topic -> its quality of service; clock_hz: rate of /clock between messages [Hz];
    longest_gap_s: a longer stretch without messages [s of the recording] is passed over; unnamed: topics that are left out
    because ROS has no such names.
    """

    bag: Bag
    topics: list[str]
    rate: float
    start_ns: int
    names: dict[str, str] = field(default_factory=dict)
    profiles: dict[str, Qos] = field(default_factory=dict)
    clock_hz: float = CLOCK_HZ
    longest_gap_s: float = LONGEST_GAP_S
    unnamed: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, path, rate: float = 1.0, start_s: float = 0.0, topics: list[str] | None = None, remap=(),
           overrides: Path | None = None, clock_hz: float = CLOCK_HZ, longest_gap_s: float = LONGEST_GAP_S) -> "Schedule":
        """Open a bag for playback. Raises FlightError.

        topics: with or without their first slash; remap: of ``old:=new``; overrides: a YAML file, topic -> profile.
        """
        for name, value in (("rate", rate), ("clock", clock_hz), ("longest-gap", longest_gap_s)):
            if not (value > 0 and (math.isfinite(value) or name == "longest-gap")):
                raise FlightError(f"--{name} {value:g}: allowed: a number greater than 0")
        bag = read_bag(path)
        chosen = [bag.spelled(name) for name in topics] if topics is not None else list(bag.topics)
        chosen = list(dict.fromkeys(chosen))
        names = _names(bag, chosen, remap)
        unnamed = [] if topics is not None else [name for name in chosen if not _is_name(names[name])
                                                 and names[name].lstrip("/") == name.lstrip("/")]
        chosen = [name for name in chosen if name not in unnamed]
        _check_names({name: names[name] for name in chosen})
        seconds = (bag.end_ns - bag.start_ns) / SECOND
        if not any(bag.topics[name].count for name in chosen):
            raise FlightError(f"bag '{path}': there is nothing to play; it holds no messages on "
                              f"{', '.join(chosen) or 'any topic'}")
        if not 0 <= start_s <= seconds:
            raise FlightError(f"--start {start_s:g}: the bag is {seconds:.9g} s long")
        given = _overrides(overrides, bag) if overrides is not None else {}
        return cls(bag, chosen, rate, bag.start_ns + round(start_s * SECOND), names,
                   {name: given.get(name) or merged_profile(bag.topics[name]) for name in chosen}, clock_hz, longest_gap_s,
                   unnamed)

    @property
    def has_clock(self) -> bool:
        """Whether the time is among the recorded topics, so that none must be made."""
        return any(self.names[name] == CLOCK_TOPIC and self.bag.topics[name].count > 0 for name in self.topics)

    def latched(self) -> list[tuple[str, int, bytes]]:
        """(topic, log time [ns], payload) of the latched messages from before the start that a late reader would get: of
        each topic as many of the newest as its publishers keep."""
        found = {}
        for topic in (name for name in self.topics if self.profiles[name].transient_local):
            rows = [(topic, stamp, payload) for _, stamp, payload in self.bag.messages([topic]) if stamp < self.start_ns]
            found[topic] = sorted(rows, key=lambda row: row[1])[-self.profiles[topic].depth:]
        return sorted((row for rows in found.values() for row in rows), key=lambda row: row[1])

    def messages(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, log time [ns], payload) from the start on: by log time, equal ones in the order of the bag."""
        found = ((topic, stamp, payload) for topic, stamp, payload in self.bag.messages(self.topics)
                 if stamp >= self.start_ns)
        _, _, stamps = self.bag.write_order()
        return found if (np.diff(stamps) >= 0).all() else iter(sorted(found, key=lambda message: message[1]))

    def gaps(self) -> list[Gap]:
        """The long stretches without messages from the start on, in order."""
        stamps = np.sort(np.concatenate([self.bag.stamps_ns(topic) for topic in self.topics]))
        stamps = np.concatenate(([self.start_ns], stamps[stamps >= self.start_ns]))
        lengths = np.diff(stamps) / SECOND
        return [Gap(int(stamps[i]), float(lengths[i]), bool(lengths[i] > self.longest_gap_s))
                for i in np.flatnonzero(lengths > min(self.longest_gap_s, LONGEST_GAP_S))]


def merged_profile(info) -> Qos:
    """The profile to publish a topic with, from those that were offered on it (`flight_graph.bags.topics.TopicInfo`)."""
    offered = info.qos
    reliable = [profile.get("reliability") not in _BEST_EFFORT for profile in offered] or [True]
    latched = [profile.get("durability") in _LATCHED for profile in offered] or [False]
    depths = [profile.get("depth") for profile in offered]
    depth = sum(number if isinstance(number, int) and 0 < number < _DEEPEST else 1 for number in depths)
    return Qos(depth=min(max(depth, 1), _DEEPEST) if all(latched) else max(100, min(depth, _DEEPEST)),
               reliable=all(reliable) or any(reliable), transient_local=all(latched))


def _names(bag, topics, remap):
    """topic -> the name that it would be published under. Raises FlightError."""
    names = {name: name if name.startswith("/") else f"/{name}" for name in topics}
    for rule in remap:
        old, found, new = rule.partition(":=")
        if not found or not new:
            raise FlightError(f"--remap {rule}: allowed: old:=new, as /imu:=/left/imu")
        names[bag.spelled(old)] = new if new.startswith("/") else f"/{new}"
    return names


def _is_name(name):
    return len(name) <= _LONGEST_NAME and _NAME.fullmatch(name) is not None


def _check_names(names):
    for topic, name in names.items():
        if not _is_name(name):
            raise FlightError(f"topic '{topic}' cannot be published as '{name}': a name in ROS is made of letters, digits, "
                              "_ and /; choose topics (--topics), or another name (--remap old:=new)")
    twice = {name for name in names.values() if list(names.values()).count(name) > 1}
    if twice:
        raise FlightError(f"two topics would be published as {', '.join(sorted(twice))}; choose others (--remap old:=new)")


def _overrides(path: Path, bag) -> dict[str, Qos]:
    """topic -> profile, of a file as `ros2 bag play --qos-profile-overrides-path` takes it. Raises FlightError."""
    content = yaml_text.read(path)
    if not isinstance(content, dict):
        raise FlightError(f"{path}: needed is topic: {{reliability: ..., durability: ..., depth: ...}}")
    return {bag.spelled(str(name)): _override(f"{path}: {name}", profile) for name, profile in content.items()}


def _override(where, profile):
    if not isinstance(profile, dict):
        raise FlightError(f"{where}: needed is a profile, as {{reliability: best_effort, depth: 10}}")
    known = ("reliability", "durability", "depth", "history", "deadline", "lifespan", "liveliness",
             "liveliness_lease_duration", "avoid_ros_namespace_conventions")
    for key in profile:
        if key not in known:
            raise unknown("setting", str(key), known, where)
    depth = profile.get("depth", 100)
    if not isinstance(depth, int) or isinstance(depth, bool) or not 0 < depth <= _DEEPEST:
        raise FlightError(f"{where}.depth: {depth!r} is not allowed; allowed: a whole number from 1 to {_DEEPEST}")
    return Qos(depth, _choice(where, profile, "reliability", _RELIABLE, _BEST_EFFORT),
               _choice(where, profile, "durability", _LATCHED, _VOLATILE) if profile.get("durability") else False)


def _choice(where, profile, key, yes, no):
    value = profile.get(key)
    if value not in yes + no:
        raise FlightError(f"{where}.{key}: {value!r} is not allowed; allowed: {yes[0]} or {no[0]}")
    return value in yes
