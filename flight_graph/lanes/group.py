"""Eight flights of one schedule bound to woven memory, and the tables that the driver of lanes walks."""

from weakref import WeakKeyDictionary

import numpy as np

from flight_graph.engines import driver
from flight_graph.engines.addresses import address
from flight_graph.engines.reductions import REDUCTION
from flight_graph.engines.schedule import finite_runs, stamp_offset
from flight_graph.lanes import lane_driver, weave
from flight_graph.lanes.lane_driver import CONTROL, FIRING, HOLD, LEAF, OUTPUT, TRANSFER
from flight_graph.lanes.operations import LANES
from flight_graph.lanes.wide_parts import Wide

_WORD = "<i8"


class Group:
    """A schedule for eight flights at once. wide: node -> its wide parts, for the nodes that have them."""

    def __init__(self, flight, wide: dict[str, Wide]):
        self._schedule, self._wide, self._arrays = flight.schedule, wide, flight.arrays
        self._flights, self._leaf_tables, self._runs = [], {}, []
        self._writers = {name: firing.node for firing in self._schedule.firings for made in firing.publications
                         for name in (made.record, made.visible) if name}
        self._find_readers()
        self.woven = {name: self._room(name) for name in self._woven_names()}
        self._places = np.zeros((len(self.woven), LANES), _WORD)
        self._known = WeakKeyDictionary()  # flight -> where its records lie
        self._made = [made for firing in self._schedule.firings for made in firing.publications]
        self._logs, self._reductions = (np.zeros((len(self._made), LANES), _WORD) for _ in range(2))
        self._stops = np.zeros((len(self._schedule.firings), LANES), _WORD)
        self._singles = np.zeros((len(self._schedule.firings), LANES), _WORD)
        self._held = np.zeros((len(self._schedule.holds), LANES, 2), _WORD)
        self._make_tables()

    # -- what is where -----------------------------------------------------------------------------------------------
    def _is_wide(self, node):
        return node in self._wide

    def _owner(self, name):
        """The node that a held or watched record belongs to."""
        return name[2:].partition(".")[0]

    def _find_readers(self):
        """Records that are read woven, and by one lane at a time."""
        self._read_woven, self._read_singly = set(), set()
        for firing in self._schedule.firings:
            inputs = firing.records[:len(firing.records) - len(firing.publications)]
            channels = firing.own.channels if firing.own else ()
            (self._read_woven if self._is_wide(firing.node) else self._read_singly).update(
                inputs, (channel.origin for channel in channels))
        for hold in self._schedule.holds:
            (self._read_woven if self._is_wide(self._owner(hold.target)) else self._read_singly).add(hold.origin)

    def _woven_names(self):
        names = {name for node in self._wide for name in (f"P_{node}", f"X_{node}")} | self._read_woven
        names |= {name for firing in self._schedule.firings if self._is_wide(firing.node)
                  for made in firing.publications for name in (made.record, made.visible) if name}
        return sorted(names)

    def _room(self, name):
        size = self._arrays[name].nbytes
        return weave.block(size * (LANES + 1) if name.startswith("P_") else size * LANES)

    # -- tables ------------------------------------------------------------------------------------------------------
    def _leaves(self, name) -> tuple[int, int]:
        dtype = self._arrays[name].dtype
        if dtype not in self._leaf_tables:
            self._leaf_tables[dtype] = np.array(list(weave.leaves(dtype)), LEAF)
        table = self._leaf_tables[dtype]
        return address(table), address(table) + table.nbytes

    def _transfers(self, names, inward) -> np.ndarray:
        rows = {name: address(row) for name, row in zip(self.woven, self._places)}
        return np.array([(address(self.woven[name]), *self._leaves(name), rows[name], inward) for name in names], TRANSFER)

    def _make_tables(self):
        records, transfers = [], []
        for firing in self._schedule.firings:
            is_wide = self._is_wide(firing.node)
            records.append([address(self.woven[name]) if is_wide else 0 for name in firing.records])
            needed = self._read_singly if is_wide else self._read_woven
            names = [name for made in firing.publications for name in (made.record, made.visible) if name in needed]
            transfers.append(self._transfers(dict.fromkeys(names), not is_wide))
        self._records = np.array([place for row in records for place in row], _WORD)
        self._moves = np.concatenate([*transfers, np.zeros(0, TRANSFER)])
        self.outputs = np.array([self._output(i, made) for i, made in enumerate(self._made)], OUTPUT)
        rows, record, output, move = [], address(self._records), address(self.outputs), address(self._moves)
        for i, firing in enumerate(self._schedule.firings):
            output_end = output + OUTPUT.itemsize * len(firing.publications)
            move_end = move + TRANSFER.itemsize * len(transfers[i])
            rows.append(self._firing(i, firing, record, (output, output_end), (move, move_end)))
            record, output, move = record + 8 * len(firing.records), output_end, move_end
        self.firings = np.array(rows, FIRING)
        self.holds = np.array([self._hold(i, hold) for i, hold in enumerate(self._schedule.holds)], HOLD)
        self._inward = self._transfers(self.woven, True)
        kept = [name for name in self.woven if name[0] != "P" and self._is_wide(
            self._writers.get(name) or self._owner(name))]
        self._outward = self._transfers(kept, False)
        self.control = np.zeros(1, CONTROL)
        self.control["fire"] = driver.CODE.address("fire")
        for name in ("holds", "firings"):
            table = getattr(self, name)
            self.control[name], self.control[f"{name}_end"] = address(table), address(table) + table.nbytes

    def _output(self, i, made):
        if made.record not in self.woven:
            return (0,) * len(OUTPUT.names)
        runs = np.array([(LANES * offset, LANES * count, size == 8) for offset, count, size in finite_runs(made.signal)],
                        driver.RUN)
        self._runs.append(runs)
        woven = address(self.woven[made.record])
        return (0, made.period, woven + LANES * stamp_offset(made.signal), woven, made.signal.dtype.itemsize, address(runs),
                address(runs) + runs.nbytes, *self._leaves(made.record),
                address(self.woven[made.visible]) if made.visible else 0, address(self._logs[i]),
                0 if made.log_period else -1, made.log_period, address(self._reductions[i]),
                REDUCTION.itemsize * len(made.reductions))

    def _firing(self, i, firing, record, outputs, moves):
        if not self._is_wide(firing.node):
            return (0, firing.period, 0, 0, 0, 0, 0, *outputs, *moves, address(self._singles[i]), address(self._stops[i]))
        state = self._arrays[firing.state]
        fault = address(self.woven[firing.state]) + LANES * state.dtype.fields["fault"][1]
        part = self._wide[firing.node].codes[firing.part]
        return (0, firing.period, part.address, address(self.woven[firing.parameters]), address(self.woven[firing.state]),
                record, fault, *outputs, *moves, 0, address(self._stops[i]))

    def _hold(self, i, hold):
        size = self._arrays[hold.target].nbytes
        if not self._is_wide(self._owner(hold.target)):
            return (0, hold.period, 0, 0, size, 1, address(self._held[i]))
        return (0, hold.period, address(self.woven[hold.target]), address(self.woven[hold.origin]), size, 0, 0)

    # -- flights -----------------------------------------------------------------------------------------------------
    def bind(self, flights: list) -> None:
        """Take over flights of this schedule (at most eight, at one tick, none stopped)."""
        self._flights = flights
        lanes = [*flights, *[flights[0]] * (LANES - len(flights))]
        for lane, flight in enumerate(lanes):
            if flight not in self._known:
                self._known[flight] = self._lie(flight)
            self._places[:, lane], self._singles[:, lane], self._held[:, lane] = self._known[flight]
            self._logs[:, lane] = flight.tables.outputs["log"]
            self._reductions[:, lane] = flight.tables.outputs["reductions"]
        first = flights[0].tables
        for mine, theirs in ((self.firings, first.firings), (self.holds, first.holds), (self.outputs, first.outputs)):
            mine["next"] = theirs["next"]
        self.outputs["log_next"] = first.outputs["log_next"]
        self._move(self._inward, (1 << LANES) - 1)
        for name, woven in self.woven.items():
            if name.startswith("P_"):
                woven[LANES * self._arrays[name].nbytes:] = flights[0].arrays[name].view(np.uint8)
        for name, value in (("tick", flights[0].tick), ("alive", (1 << len(flights)) - 1), ("stopped", 0),
                            ("epoch_ns", flights[0].control["epoch_ns"][0]), ("base_ns", flights[0].control["base_ns"][0]),
                            ("next_firing", self.control["firings"][0])):
            self.control[name] = value

    def _lie(self, flight):
        """Where records, rows of firings, and held records of a flight lie."""
        firings = address(flight.tables.firings) + driver.FIRING.itemsize * np.arange(len(self._schedule.firings))
        held = [[address(flight.arrays[name]) for name in (hold.target, hold.origin)] for hold in self._schedule.holds]
        return (np.array([address(flight.arrays[name]) for name in self.woven], _WORD), firings,
                np.array(held, _WORD).reshape(-1, 2))

    def _move(self, transfers, lanes):
        begin = address(transfers)
        lane_driver.CODE.function("transfer")(begin, begin + transfers.nbytes, lanes)

    def advance(self, end: int) -> None:
        """Run until before a tick; lanes whose flight stops leave."""
        self.control["end"] = end
        run = lane_driver.CODE.function("run")
        while run(address(self.control)):
            self._leave_stopped()

    def _leave_stopped(self):
        stopped, alive = int(self.control["stopped"][0]), int(self.control["alive"][0])
        number = (int(self.control["next_firing"][0]) - int(self.control["firings"][0])) // FIRING.itemsize - 1
        firing = self._schedule.firings[number]
        self._move(self._outward, stopped)
        for lane in range(LANES):
            if stopped >> lane & 1:
                self._give_back(lane)
                self._flights[lane].stopped_at(int(self.control["tick"][0]), firing.node, firing.part,
                                               int(self._stops[number, lane]))
                if alive:
                    self._imitate(lane, alive.bit_length() - 1)

    def _imitate(self, lane, other):
        """Let a lane that has left do what another one does: its numbers may not hold the others up."""
        for name, woven in self.woven.items():
            for offset, count, width in weave.leaves(self._arrays[name].dtype):
                numbers = woven[LANES * offset:LANES * (offset + count * width)].reshape(count, LANES, width)
                numbers[:, lane] = numbers[:, other]

    def _give_back(self, lane):
        """Let a flight's own tables say how far its lane came."""
        tables = self._flights[lane].tables
        wide = [i for i, made in enumerate(self._made) if made.record in self.woven and self._is_wide(
            self._writers[made.record])]
        tables.outputs["log"][wide] = self._logs[wide, lane]
        for name in ("next", "log_next"):
            tables.outputs[name][wide] = self.outputs[name][wide]
        tables.firings["next"], tables.holds["next"] = self.firings["next"], self.holds["next"]

    def is_alive(self) -> bool:
        """Whether a lane still flies."""
        return bool(self.control["alive"][0])

    def release(self) -> None:
        """Give the flights that are left their memory back."""
        alive = int(self.control["alive"][0])
        self._move(self._outward, alive)
        for lane, flight in enumerate(self._flights):
            if alive >> lane & 1:
                self._give_back(lane)
                flight.went_to(int(self.control["tick"][0]))
        self._flights = []
