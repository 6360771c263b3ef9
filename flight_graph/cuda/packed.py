"""The memory of a run as one row of bytes: what an image of many runs on a device is made of, and read back from.

Every array and every table has its place in the row; addresses in tables become those of the row, wherever it lies. Logs
have rows of their own, which are only read back.
"""

import numpy as np

from flight_graph.engines.addresses import address
from flight_graph.engines.condition_steps import ADDRESSES
from flight_graph.engines.driver import CONTROL, OUTPUT
from flight_graph.engines.flight import Flight

_ALIGNED = 16  # [bytes]
_WORD = "<i8"
_LOGS = ("L_", "T_")  # kinds of arrays that a run fills
_MOVING = ("log", "times")  # addresses that go on as the run does
_OF_CODE = ("part", "start", "place", "fire")  # addresses of machine code
_END = "_end"


class Packed:
    """The places of a flight's memory in a row. numbers: address of a part's machine code -> its number on the device.

    size, log_size [bytes]: of its rows. The control record comes first.
    """

    def __init__(self, flight: Flight, numbers: dict[int, int]):
        arrays, tables = flight.arrays, flight.tables
        self._io, self._outputs = tables.io, tables.outputs
        found = [flight.control, *tables.all(), *arrays.values()]
        with_addresses = [one for one in found if one is self._io or ADDRESSES.get(one.dtype)]
        logs = [one for name, one in arrays.items() if name.startswith(_LOGS)]
        known = {id(one) for one in (*with_addresses, *logs)}
        self._kept, self.size = _laid([*with_addresses, *(one for one in found if id(one) not in known)])
        self._tables = len(with_addresses)
        self._log_places, self.log_size = _laid(logs)
        self._find_arrays()
        found = [self._words(at, one) for at, one in self._kept[:self._tables]]
        self._where, self._relative, self._is_log = (np.concatenate(parts) for parts in zip(*found))
        firings = self._place(tables.firings)
        code = [(firings + tables.firings.dtype.fields[name][1], name) for name in ("part", "start", "place")]
        step = tables.firings.dtype.itemsize * np.arange(len(tables.firings))
        self._code_where = np.concatenate([at + step for at, _ in code]) // 8
        self._code = np.array([numbers.get(int(place), 0) for _, name in code for place in tables.firings[name]], _WORD)

    def _find_arrays(self):
        """Where each array lies, here and in its row, by its address."""
        rows = [(address(one), one.nbytes, at, False) for at, one in self._kept]
        rows += [(address(one), one.nbytes, at, True) for at, one in self._log_places]
        rows.sort()
        self._bases, self._sizes, self._targets, self._in_log = (np.array(column) for column in zip(*rows))

    def _place(self, table) -> int:
        return next(at for at, one in self._kept if one is table)

    def _relocated(self, places):
        """(offset in its row, whether that is one of logs) of addresses; 0 stays."""
        which = np.maximum(np.searchsorted(self._bases, places, "right") - 1, 0)
        offset = places - self._bases[which]
        if np.any((places != 0) & ((offset < 0) | (offset > self._sizes[which]))):
            raise AssertionError("a table holds an address that is in no array of the run")
        return offset + self._targets[which], self._in_log[which]

    def _words(self, at, table):
        """Of the addresses in a table that are not zero: number of the word in the row, offset, whether of a log."""
        found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool))]
        words = table.view(_WORD).reshape(len(table), -1) if len(table) else None
        names = ADDRESSES.get(table.dtype)
        columns = () if words is None else range(words.shape[1]) if table is self._io else [
            table.dtype.names.index(name) for name in names or ()]
        for column in columns:
            places, name = words[:, column], table.dtype.names[column] if names else ""
            begin = places
            if name.endswith(_END):  # an end is as far behind its begin there
                begin = words[:, table.dtype.names.index(name.removesuffix(_END))]
            there = np.flatnonzero(begin)
            offset, of_log = self._relocated(begin[there])
            found.append((at // 8 + there * words.shape[1] + column, offset + places[there] - begin[there], of_log))
        return tuple(np.concatenate(parts) for parts in zip(*found))

    # -- to a row and back -------------------------------------------------------------------------------------------
    def write(self, row: np.ndarray, logs: np.ndarray, address_there: int, logs_there: int) -> None:
        """Fill a row and that of the logs (bytes), which will lie at these addresses."""
        for at, one in self._log_places:
            logs[at:at + one.nbytes] = one.view(np.uint8).reshape(-1)
        for at, one in self._kept:
            row[at:at + one.nbytes] = one.view(np.uint8).reshape(-1)
        words = row.view(_WORD)
        words[self._where] = self._relative + np.where(self._is_log, logs_there, address_there)
        words[self._code_where] = self._code
        for where, table, name in self._moved():
            offset, _ = self._relocated(table[name])
            words[where] = np.where(table[name] != 0, offset + logs_there, 0)
        words[CONTROL.names.index("stop")] = 0

    def _moved(self):
        outputs = self._outputs
        at = self._place(outputs) // 8 + OUTPUT.itemsize // 8 * np.arange(len(outputs))
        return [(at + OUTPUT.names.index(name), outputs, name) for name in _MOVING]

    def read(self, flight: Flight, row: np.ndarray, logs: np.ndarray, logs_there: int) -> None:
        """Take a row and the logs (bytes) over that a device has worked on, and let the flight know how far it came."""
        words, moved = row.view(_WORD), []
        for where, table, name in self._moved():
            before = table[name].copy()
            offset, _ = self._relocated(before)
            moved.append((table, name, np.where(before != 0, before + words[where] - (offset + logs_there), 0)))
        for at, one in self._kept[self._tables:]:
            one.view(np.uint8).reshape(-1)[:] = row[at:at + one.nbytes]
        for at, table in self._kept[:self._tables]:
            _take(table, row[at:at + table.nbytes])
        for table, name, places in moved:
            table[name] = places
        for at, one in self._log_places:
            one.view(np.uint8).reshape(-1)[:] = logs[at:at + one.nbytes]
        control = flight.control[0]
        tick, stop = int(control["tick"]), int(control["stop"])
        if stop:
            firing = flight.schedule.firings[int(control["who"])]
            flight.stopped_at(tick, firing.node, firing.part, stop)
        else:
            flight.went_to(tick)


def _take(table, content):
    """A table's numbers; its addresses and those of code stay."""
    fixed, there = {*ADDRESSES.get(table.dtype, ()), *_OF_CODE}, content.view(table.dtype)
    for name in table.dtype.names or ():
        if name not in fixed:
            table[name] = there[name]


def _laid(arrays) -> tuple[list[tuple[int, np.ndarray]], int]:
    """(offset, array) of each, one behind the other, and the size of all."""
    places, size = [], 0
    for one in arrays:
        places.append((size, one))
        size += -(-one.nbytes // _ALIGNED) * _ALIGNED
    return places, size
