"""A bag as a stream of messages: in the order of their log times, from any moment on."""

import numpy as np

from flight_graph.bags.reader import Bag
from flight_graph.viewers.messages import Message, Stream, named_series, streams_of
from flight_graph.viewers.source import Source
from flight_graph.viewers.typed_topics import TypedTopic


class BagSource(Source):
    """The messages of a bag, taken moment by moment. begin_ns, end_ns: its first and last log time."""

    can_seek = True

    def __init__(self, bag: Bag):
        self.name, self.begin_ns, self.end_ns = str(bag.path), bag.start_ns, bag.end_ns
        self.streams: list[Stream] = streams_of(bag)
        self.units = bag.metadata.get("units", {})
        self.typed = list(map(TypedTopic.of, named_series(bag)))
        names, owners, stamps = bag.write_order()
        self._payloads = [bag.payloads(name) for name in names]
        places = np.zeros(len(owners), np.int64)  # of each message among those of its topic
        for number in range(len(names)):
            chosen = owners == number
            places[chosen] = np.arange(np.count_nonzero(chosen))
        order = np.argsort(stamps, kind="stable")
        self._owners, self._stamps, self._places = owners[order], stamps[order].astype(np.int64), places[order]
        self._next = 0

    @property
    def is_over(self) -> bool:
        """Whether every message has been taken."""
        return self._next >= len(self._stamps)

    def take(self, until_ns: int) -> list[Message]:
        """The messages up to a time, from where the last call ended."""
        end = int(np.searchsorted(self._stamps, until_ns, "right"))
        begin, self._next = self._next, max(self._next, end)
        return [self._message(row) for row in range(begin, end)]

    def seek(self, t_ns: int) -> list[Message]:
        """Go to a time; the last message before it of each topic."""
        self._next = int(np.searchsorted(self._stamps, t_ns, "left"))
        before = self._owners[:self._next]
        rows = [int(found[-1]) for number in range(len(self.streams)) if len(found := np.flatnonzero(before == number))]
        return [self._message(row) for row in sorted(rows)]

    def _message(self, row: int) -> Message:
        number = int(self._owners[row])
        return Message(number, int(self._stamps[row]), bytes(self._payloads[number][self._places[row]]))
