"""Messages of foreign nodes: which of them count. All who read a foreign node's topic come to the same by this.

In lockstep an answer is the first message of its topic that is of the signal, finite, and stamped as the slot; the stand-in
(`flight_graph.ros.stand_in`) says in slots whether it was in time. In realtime the stamp is free.
"""

import numpy as np

from flight_graph.engines.schedule import finite_runs
from flight_graph.ros.slots import SlotReader
from flight_graph.timebase import SECOND
from msg_schemas.signal import Signal, SignalMismatch


class Judge:
    """Looks at messages of one signal. record: the last one that was of it."""

    def __init__(self, signal: Signal):
        self._signal = signal
        self._payload, self.record = signal.new()
        body = self.record.view("u1").reshape(-1)
        self._runs = [body[start:start + count * size].view(f"<f{size}") for start, count, size in finite_runs(signal)]
        self._stamp = self.record
        for part in signal.stamp_path.split("."):
            self._stamp = self._stamp[part]

    def stamp_ns(self, message: bytes) -> int:
        """The stamp of a message. Raises SignalMismatch where it is not of the signal, or not finite."""
        self._signal.receive(message, self._payload)
        if not all(np.isfinite(run).all() for run in self._runs):
            raise SignalMismatch(f"topic '{self._signal.topic}': {self._not_finite()} of a message is not finite")
        return int(self._stamp["sec"][0]) * SECOND + int(self._stamp["nanosec"][0])

    def _not_finite(self) -> str:
        for path, dtype, offset, length in self._signal.leaves():
            if dtype.base.kind == "f" and path not in self._signal.may_be_nonfinite:
                numbers = self.record.view("u1").reshape(-1)[offset:offset + length].view(dtype.base)
                if not np.isfinite(numbers).all():
                    return path
        return "a number"


class AnswerReader(SlotReader):
    """The answers of a foreign node, slot by slot: what is no answer to the slot is passed over."""

    def __init__(self, data, slots, signal: Signal):
        super().__init__(data, slots, lossy=False)
        self._judge = Judge(signal)

    def _gather(self) -> bool:
        stamp_ns, count, _ = self._slot
        while len(self._messages) < count:
            message = self.data.take()
            if message is None:
                return False
            try:
                if self._judge.stamp_ns(message) == stamp_ns:
                    self._messages.append(message)
            except SignalMismatch:
                continue
        return True
