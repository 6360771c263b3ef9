"""The faults of a schedule as tables of addresses, for `flight_graph.engines.effects`."""

import numpy as np

from flight_graph.engines import effects
from flight_graph.engines.addresses import address
from flight_graph.engines.condition_steps import STEP, number_kind
from flight_graph.engines.effects import CHANNEL, EFFECT, OWN
from flight_graph.engines.fault_schedule import watched
from flight_graph.faults.fault_set import FOREVER


class FaultTables:
    """All rows of a schedule's faults, over the arrays of one run; they live as long as this."""

    def __init__(self, schedule, arrays: dict, epoch_ns: int = 0):
        self._epoch_ns = epoch_ns
        self._arrays, self._rows, self._owns, self._channels = arrays, [], {}, {}
        for firing in schedule.firings:
            for made in firing.publications:
                if made.channel is not None:
                    self._channels[made.channel.name, made.record] = self._channel_row(made.channel)
        for firing in schedule.firings:
            if firing.own is not None:
                self._owns[firing.node, firing.part] = self._own_row(firing)

    def all(self) -> list[np.ndarray]:
        """All its tables."""
        return [*self._rows, *self._owns.values(), *self._channels.values()]

    def channel(self, made) -> int:
        """Address of the way of an output through its faults; 0: it has none."""
        return address(self._channels[made.channel.name, made.record]) if made.channel is not None else 0

    def own(self, firing) -> int:
        """Address of what a firing looks at first; 0: nothing."""
        return address(self._owns[firing.node, firing.part]) if firing.own is not None else 0

    def delivered(self, channel) -> int:
        """How many messages of an output its last firing delivered."""
        return int(self._channels[channel.name, channel.record]["delivered"][0])

    def _keep(self, rows: np.ndarray) -> tuple[int, int]:
        """Begin and end of a table that is kept."""
        self._rows.append(rows)
        return address(rows), address(rows) + rows.nbytes

    def _effects(self, found) -> tuple[int, int]:
        return self._keep(np.array([self._effect_row(effect) for effect in found], EFFECT)) if found else (0, 0)

    def _channel_row(self, channel):
        arrays = self._arrays
        return np.array([(address(arrays[channel.origin]), address(arrays[channel.record]), arrays[channel.record].nbytes,
                          address(arrays[channel.visible]) if channel.visible else 0, *self._effects(channel.effects), 0)],
                        CHANNEL)

    def _own_row(self, firing):
        arrays, own, row = self._arrays, firing.own, np.zeros(1, OWN)
        for name, found in (("ends", own.ends), ("effects", own.effects)):
            row[name], row[f"{name}_end"] = self._effects(found)
        channels = [self._channel_row(channel) for channel in own.channels]
        row["channels"], row["channels_end"] = self._keep(np.concatenate(channels)) if channels else (0, 0)
        if own.placements:
            row["placements"], row["placements_end"] = self._keep(np.array(
                [(one.begin_ns, one.end_ns, address(arrays[one.array])) for one in own.placements], effects.PLACEMENT))
        if own.parameters:
            nominal = arrays[f"N_{own.node}"]
            row["parameters"], row["nominal"] = address(arrays[own.parameters]), address(nominal)
            row["parameters_size"] = nominal.nbytes
        if own.ends:
            state = arrays[firing.state]
            row["state"], row["fresh"], row["state_size"] = address(state), address(arrays[f"Z_{own.node}"]), state.nbytes
        if not own.first:
            first = next((row for (node, part), row in self._owns.items() if node == own.node), None)
            row["first"] = address(first) if first is not None else 0
        return row

    def _effect_row(self, effect):
        row, buffer = np.zeros(1, EFFECT), self._arrays.get(f"B_{effect.name}")
        values = {"op": effect.op, "end": FOREVER, "chance": 1.0, "width": effect.dtype.itemsize, "count": effect.count,
                  "memory": address(self._arrays[f"A_{effect.name}"]),
                  "buffer": address(buffer) if buffer is not None else 0}
        if effect.array:
            record = address(self._arrays[effect.array])
            values |= {"target": record + effect.offset, "stamp": record + effect.stamp}
        if effect.condition:
            values["when"], values["when_end"] = self._condition(effect)
        if effect.op == effects.FLAG:
            values["value"] = 1.0
        if effect.fault is not None:
            values |= _of_fault(effect.fault, effect.op)
        if effect.change is not None:
            values |= {"begin": effect.change.begin_ns, "end": effect.end,
                       "buffer": address(self._arrays[f"G_{effect.name}"])}
        if effect.action is not None:
            values |= {"each": effect.action.entry.in_a_row, "again": effect.action.entry.act == "each",
                       "cause": effect.action.number, "value": float(effect.mode)}
        if effect.op == effects.REQUEST:
            array, offset = effect.acts
            values |= {"acts": address(self._arrays[array]) + offset,
                       "buffer": address(self._arrays[effect.written]) + effect.offset}
        for name, value in values.items():
            row[name] = value
        return row[0].item()

    def _condition(self, effect):
        def place(step):
            array = effect.array if step.signal is None else watched(effect.node, *step.signal)
            return address(self._arrays[array])
        return fill(self._arrays[f"C_{effect.name}"], effect.condition, place, self._epoch_ns)


def fill(steps: np.ndarray, condition, place, epoch_ns: int) -> tuple[int, int]:
    """Fill the steps of a condition; return begin and end. place(step): address of the record that a step reads."""
    at, size = address(steps), STEP.itemsize
    for row, step in zip(steps, condition.steps):
        row["op"], row["a"], row["b"], row["constant"] = step.op, at + size * step.a, at + size * step.b, step.constant
        row["epoch_ns"] = epoch_ns
        if step.field is not None:
            row["address"] = place(step) + step.field.offset
            row["kind"] = number_kind(step.field.dtype)
            row["width"] = step.field.dtype.itemsize
    return at, at + steps.nbytes


def _of_fault(fault, op) -> dict:
    """What of an effect's row its fault decides; a flag of the report leaves size, chance and count out."""
    entry, window = fault.entry, fault.window
    values = {"begin": window.begin, "end": window.end, "every": window.every, "span": window.span, "key": fault.key}
    if op in (effects.FLAG, effects.ON_CHANGE):
        return values
    return values | {"each": entry.every or 0, "ticks": entry.ticks or 0, "bit": entry.bit or 0,
                     "ramp": entry.ramp_s or 0.0,
                     "value": 0.0 if entry.value is None else entry.value,
                     "chance": 1.0 if entry.probability is None else entry.probability}
