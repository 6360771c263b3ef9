"""The compiled executor: a scenario's whole schedule as one numba loop in this process.

With NUMBA_DISABLE_JIT=1 in the environment the same generated source runs as plain Python (engine ``python``).
"""

import threading
import time
from dataclasses import dataclass, field

import numba
import numpy as np

from flight_graph.engines import source
from flight_graph.errors import RunStopped
from flight_graph.graphs.scenario import Scenario
from flight_graph.timebase import SECOND
from msg_schemas.signal import Signal

SHORTEST_CHUNK = 2000  # [ticks] between calls of progress; entering the loop costs some 50 us
_COMPILING = threading.Lock()  # runs of a sweep are threads of one process
_READY = set()  # modules whose machine code is loaded


@dataclass
class Track:
    """All recorded messages of one topic. stamps_ns: (n,) time since the epoch; records: (n,) structured array."""

    topic: str
    signal: Signal
    node: str
    port: str
    stamps_ns: np.ndarray
    records: np.ndarray


@dataclass
class Recording:
    """What a run left behind: tracks in the order of the schedule, and how long it took.

    wall_s: seconds in the loop alone; compile_s: seconds until the first step could run.
    """

    scenario: Scenario
    tracks: list[Track] = field(default_factory=list)
    wall_s: float = 0.0
    compile_s: float = 0.0

    def __getitem__(self, topic: str) -> np.ndarray:
        for track in self.tracks:
            if track.topic == topic.lstrip("/"):
                return track.records
        raise KeyError(topic)

    def __contains__(self, topic: str) -> bool:
        return any(track.topic == topic.lstrip("/") for track in self.tracks)


class CompiledRun:
    """One run of a scenario. `compile` makes the machine code ready, `run` fills the recording."""

    def __init__(self, scenario: Scenario):
        self.scenario, self.graph = scenario, scenario.graph
        self.plan = scenario.recorded()
        text, self.names, self.slots = source.loop_source(self.graph, self.plan)
        kernels = [function for node in self.graph.nodes.values() for function in node.component.kernels()]
        self.module = source.load(text, kernels, "loop")

    def is_compiled(self) -> bool:
        """Whether the machine code lies in the cache."""
        return numba.config.DISABLE_JIT or source.is_cached(self.module)

    def prepare(self, ticks: int, logs: dict | None = None) -> dict:
        """Fresh arrays for a run: parameters, states, outputs, logs, by the names of the loop's arguments.

        logs: the arrays of an earlier run; those that fit are filled again (a run fills every row).
        """
        arrays = {}
        for node in self.graph.nodes.values():
            component = node.component
            arrays[f"P_{node.name}"] = component.parameters.record(node.values, node.name)
            arrays[f"P_{node.name}"]["period"] = node.period_ns / SECOND
            arrays[f"X_{node.name}"] = component.initial_state(node.values)
            for port, signal in component.outputs.items():
                arrays[f"O_{node.name}_{port}"] = signal.new()[1]
                arrays[f"V_{node.name}_{port}"] = signal.new()[1]
            for port, signal in component.inputs.items():
                arrays[f"H_{node.name}_{port}"] = signal.new()[1]
        for (name, port), every in self.plan.items():
            period = self.graph.nodes[name].output_period_ns(port) * every // self.graph.base_ns
            log, rows, signal = f"L_{name}_{port}", -(-ticks // period), self.graph.signal(name, port)
            old = (logs or {}).get(log)
            fits = old is not None and len(old) == rows and old.dtype == signal.dtype
            arrays[log] = old if fits else signal.zeros(rows)
        arrays = {name: arrays[name] for name in self.names}
        if numba.config.DISABLE_JIT:
            arrays = {name: array.view(np.recarray) for name, array in arrays.items()}
        return arrays

    def compile(self) -> float:
        """Make the loop ready (from the cache where it can be); return the seconds it took."""
        began = time.perf_counter()
        with _COMPILING:
            if self.module not in _READY:
                arrays = list(self.prepare(0).values())
                with np.errstate(all="ignore"):
                    self.module.start(*arrays)
                    self.module.run(self._control(0), *arrays)
                _READY.add(self.module)
        return time.perf_counter() - began

    def run(self, progress=None, logs: dict | None = None) -> Recording:
        """Run the scenario. progress(seconds simulated) is called now and then. Raises RunStopped on a fault.

        logs: takes the arrays of the log, and gives those of an earlier run back to this one: a recording made with the
        same dictionary before is overwritten.
        """
        compile_s = self.compile()
        ticks = -(-self.scenario.duration_ns // self.graph.base_ns)
        arrays = self.prepare(ticks, logs)
        control, values = self._control(ticks), list(arrays.values())
        chunk = max(SHORTEST_CHUNK, ticks // 100) if progress else ticks
        began = time.perf_counter()
        with np.errstate(all="ignore"):
            self.module.start(*values)
            while control[source.TICK] < ticks:
                control[source.END] = min(ticks, control[source.TICK] + chunk)
                if self.module.run(control, *values):
                    reason = "fault" if control[source.STOP] == source.FAULT else "nonfinite"
                    stopped_ns = int(control[source.TICK]) * self.graph.base_ns
                    raise RunStopped(self._stop_sentence(control, arrays), reason, stopped_ns)
                if progress:
                    progress(int(control[source.TICK]) * self.graph.base_ns / SECOND)
        wall_s = time.perf_counter() - began
        if logs is not None:
            logs.update((name, arrays[name]) for name in arrays if name.startswith("L_"))
        return Recording(self.scenario, self._tracks(arrays), wall_s, compile_s)

    def _control(self, ticks):
        return self.slots.control(ticks, self.scenario.epoch_ns, self.graph.base_ns)

    def _tracks(self, arrays):
        tracks = []
        for (name, port), every in self.plan.items():
            records = arrays[f"L_{name}_{port}"].view(np.ndarray)
            period = self.graph.nodes[name].output_period_ns(port) * every
            signal = self.graph.signal(name, port)
            records = records.view(signal.dtype)
            tracks.append(Track(signal.topic, signal, name, port, np.arange(len(records)) * period, records))
        return tracks

    def _stop_sentence(self, control, arrays):
        step = self.graph.order[control[source.WHO]]
        node = self.graph.nodes[step.node]
        seconds = int(control[source.TICK]) * self.graph.base_ns / SECOND
        if control[source.STOP] == source.FAULT:
            return fault_sentence(node.name, node.component, arrays[f"P_{node.name}"], arrays[f"X_{node.name}"], seconds)
        for port, signal in node.component.outputs.items():
            sentence = nonfinite_sentence(node.name, port, signal, arrays[f"O_{node.name}_{port}"], seconds)
            if sentence:
                return sentence
        return f"{node.name} stopped at t = {seconds:g} s"


def fault_sentence(name, component, parameters, state, seconds) -> str:
    """The sentence of a fault code, with the values it names filled in."""
    code = int(state["fault"][0])
    text = component.faults.get(code, f"fault {code}")
    values = {key: _readable(array[0][key]) for array in (parameters, state) for key in array.dtype.names}
    return f"{name} stopped at t = {seconds:g} s: {text.format(**values)}"


def nonfinite_sentence(name, port, signal, record, seconds) -> str | None:
    """Which field of an output is not finite, in words; None when all are."""
    body = np.ascontiguousarray(record).view("u1").reshape(-1)
    for path, dtype, offset, length in signal.leaves():
        if dtype.base.kind == "f" and path not in signal.may_be_nonfinite:
            values = body[offset:offset + length].view(dtype.base)
            if not np.isfinite(values).all():
                index = int(np.argmin(np.isfinite(values)))
                return (f"{name} stopped at t = {seconds:g} s: its output {port}.{path}"
                        f"{f'[{index}]' if dtype.shape else ''} is {values[index]}; only finite numbers are published")
    return None


def _readable(value):
    return np.asarray(value).tolist() if np.ndim(value) else value
