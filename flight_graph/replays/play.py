"""When each message of a bag is due: the order and the times of a playback, without ROS."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flight_graph.bags.reader import Bag, read_bag
from flight_graph.errors import FlightError
from flight_graph.timebase import SECOND

CLOCK_TOPIC = "/clock"


@dataclass(frozen=True)
class Schedule:
    """What to play of a bag. rate: recorded seconds per second of wall time; start_ns: log time of the beginning."""

    bag: Bag
    topics: list[str]
    rate: float
    start_ns: int

    @classmethod
    def of(cls, path, rate: float = 1.0, start_s: float = 0.0, topics: list[str] | None = None) -> "Schedule":
        """Open a bag for playback. Raises FlightError."""
        if not (rate > 0 and math.isfinite(rate)):
            raise FlightError(f"--rate {rate:g}: allowed: a number greater than 0")
        bag = read_bag(path)
        chosen = [bag.spelled(name) for name in topics] if topics is not None else list(bag.topics)
        seconds = (bag.end_ns - bag.start_ns) / SECOND
        if not any(bag.topics[name].count for name in chosen):
            raise FlightError(f"bag '{path}': there is nothing to play; it holds no messages on "
                              f"{', '.join(chosen) or 'any topic'}")
        if not 0 <= start_s <= seconds:
            raise FlightError(f"--start {start_s:g}: the bag is {seconds:.9g} s long")
        return cls(bag, chosen, rate, bag.start_ns + round(start_s * SECOND))

    @property
    def has_clock(self) -> bool:
        """Whether the time is among the recorded topics, so that none must be made."""
        return CLOCK_TOPIC in self.topics and self.bag.topics[CLOCK_TOPIC].count > 0

    def messages(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, log time [ns], payload) from the start on: by log time, equal ones in the order of the bag."""
        found = ((topic, stamp, payload) for topic, stamp, payload in self.bag.messages(self.topics)
                 if stamp >= self.start_ns)
        _, _, stamps = self.bag.write_order()
        return found if (np.diff(stamps) >= 0).all() else iter(sorted(found, key=lambda message: message[1]))

    def due_s(self, stamp_ns: int) -> float:
        """Wall time [s] from the beginning of the playback to a stamp."""
        return (stamp_ns - self.start_ns) / SECOND / self.rate
