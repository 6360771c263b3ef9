"""A run that flies while it is watched: its messages moment by moment, parameters to set, faults to inject.

What was set and injected goes into its bag as a node's recorder writes it, so that the bag can be run again from itself.
"""

import json
import threading

import numpy as np

from flight_graph.bags.series import NAMED, series_of_signal
from flight_graph.components.entries import flat
from flight_graph.engines.checkpoint import Checkpoint, is_kept
from flight_graph.engines.compiled import CompiledRun, Recording
from flight_graph.engines.flight import Track
from flight_graph.engines.schedule import Schedule
from flight_graph.errors import FlightError, RunStopped, unknown
from flight_graph.faults.injections import Injections
from flight_graph.graphs import events
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.bag_scenario import INJECTED_FAULTS, SET_PARAMETERS
from flight_graph.recordings.recording import column_units, messages, recorded_topics, write_recording
from flight_graph.timebase import SECOND
from flight_graph.viewers.messages import Message, Stream
from flight_graph.viewers.source import Source
from flight_graph.viewers.typed_topics import TypedTopic
from msg_schemas.definitions import definition


class FlyingSource(Source):
    """A compiled run (or one in plain Python), flown as far as it is asked for. begin_ns, end_ns: stamps of its ends."""

    def __init__(self, scenario: Scenario, compiling=None):
        self.scenario, self.name = scenario, scenario.name
        self._run = CompiledRun(scenario)
        self._run.compile(compiling)
        self._flight = self._run.start(scenario.ticks)
        self._lock = threading.Lock()  # parameters are set by the threads of viewers
        self._topics, self._done = recorded_topics(scenario), {}
        self.streams = [Stream(f"/{topic.topic}", topic.type_name, definition(topic.type_name).text,
                               latched=topic.role.qos.transient_local) for topic in self._topics]
        self.units = column_units(self._topics)
        self.typed = [TypedTopic.of(one) for topic in self._topics if topic.formatted is None and topic.type_name == NAMED
                      for one in series_of_signal(f"/{topic.topic}", topic.signal, self.units)]
        self.begin_ns, self.end_ns = scenario.epoch_ns, scenario.epoch_ns + scenario.duration_ns
        self._changes, self._set = {}, []
        self._injections = Injections(scenario.live_ids)
        self._checkpoints = []
        self._past = []  # tracks of the flights before each fault that was injected

    # -- flying ----------------------------------------------------------------------------------------------------
    @property
    def is_over(self) -> bool:
        """Whether it has come to its end, or a component has stopped it."""
        return self._flight.stop is not None or self._flight.tick >= self.scenario.ticks

    @property
    def stop(self) -> RunStopped | None:
        """What a component stopped the run with."""
        return self._flight.stop

    @property
    def stopped(self) -> str:
        """The sentence of a component that stopped the run; empty: none did."""
        return str(self._flight.stop or "")

    def take(self, until_ns: int) -> list[Message]:
        """Fly on to a stamp; the messages since the last call, in the order of the bag."""
        with self._lock:
            tick = (until_ns - self.scenario.epoch_ns) // self.scenario.graph.base_ns + 1
            while not self.is_over and self._flight.tick < min(tick, self.scenario.ticks):
                due = self.scenario.next_checkpoint(self._flight.tick)
                self._flight.advance(min(tick, self.scenario.ticks, due))
                if self._flight.tick == due < self.scenario.ticks and not self._flight.stop:
                    self._checkpoints.append(self._flight.checkpoint())
            return self._new()

    def _new(self) -> list[Message]:
        tracks = {(track.node, track.port): track for track in self._flight.tracks()}
        found = []
        for number, topic in enumerate(self._topics):
            track, begin = tracks[topic.node, topic.port], self._done.get(number, 0)
            self._done[number] = len(track.records)
            stamps, payloads = messages(topic, track.stamps_ns[begin:], track.records[begin:])
            found += [Message(number, self.scenario.epoch_ns + int(stamp), bytes(payload))
                      for stamp, payload in zip(stamps, payloads)]
        return sorted(found, key=lambda message: (message.stamp_ns, message.number))

    # -- parameters ------------------------------------------------------------------------------------------------
    def parameters(self) -> dict[str, object]:
        """``component.parameter`` -> value as it is now, of all that may be set while it flies."""
        found = {}
        for name in self.scenario.file.components:
            node = self.scenario.graph.nodes[name]
            if name not in self.scenario.faults.changes:
                values = self._changes[name][-1].values if name in self._changes else node.values
                found |= {f"{name}.{key}": flat(values[key]) for key, entry in node.component.parameters.entries.items()
                          if entry.kind != "text"}
        return found

    def set(self, key: str, value) -> None:
        """Set a parameter before the next tick. Raises FlightError, and nothing has changed then."""
        name, _, parameter = key.partition(".")
        with self._lock:
            if key not in self.parameters():
                raise self._unknown(key)
            if self.is_over:
                raise FlightError(f"{key}: the run is over")
            node, t_ns = self.scenario.graph.nodes[name], self._flight.tick * self.scenario.graph.base_ns
            changes = events.with_change(self._changes.get(name, []), node, t_ns, {parameter: value})
            for array in (f"P_{name}", f"N_{name}"):
                if array in self._flight.arrays:
                    self._flight.arrays[array].view("u1")[:] = changes[-1].record.view("u1")
            self._changes[name] = changes
            self._set.append(events.as_entry(name, t_ns, {parameter: value}))

    def _unknown(self, key):
        name = key.partition(".")[0]
        if name in self.scenario.faults.changes:
            return FlightError(f"{key}: the scenario's events set parameters of {name}; it keeps to them")
        return unknown("parameter", key, self.parameters(), self.scenario.name)

    # -- faults ----------------------------------------------------------------------------------------------------
    @property
    def takes_faults(self) -> bool:
        """Whether the scenario keeps places for faults that are injected while it flies (``live_faults``)."""
        return bool(self.scenario.live_ids)

    def injected(self) -> list[dict]:
        """The faults that have been injected."""
        return list(self._injections.entries.values())

    def inject(self, fault) -> str:
        """Inject a fault (the keys of a scenario's block, without id and times) before the next tick; what is said of it.

        Raises FlightError.
        """
        self._injections.check(fault)
        with self._lock:
            return self._take(*self._injections.begun(fault, self._now_s()))

    def clear(self, name: str) -> str:
        """End an injected fault before the next tick; what is said of it. Raises FlightError."""
        with self._lock:
            return self._take(*self._injections.ended(name, self._now_s()))

    def _now_s(self) -> float:
        return self._flight.tick * self.scenario.graph.base_ns / SECOND

    def _take(self, entry, sentence):
        """Go on with one fault more, or another one; the sentence on it."""
        if self.is_over:
            raise FlightError("the run is over")
        entries = [one for one in self.injected() if one["id"] != entry["id"]] + [entry]
        faults = self.scenario.with_faults(entries)
        run, tick = CompiledRun(self.scenario, like=self._run), self._flight.tick
        run.schedule = Schedule.of(self.scenario.graph, run.schedule.plan, faults)
        flight = run.start(self.scenario.ticks - tick, begin=_memory(run, self._flight))
        self._past.append(self._flight.tracks())
        self._run, self._flight, self._done = run, flight, {}
        self._injections.entries[entry["id"]] = entry
        return sentence

    # -- the bag ---------------------------------------------------------------------------------------------------
    def recording(self) -> Recording:
        """What was flown, up to where it is."""
        found = {}
        for part in [*self._past, self._flight.tracks()]:
            for track in part:
                found.setdefault((track.node, track.port), []).append(track)
        checkpoints = [] if self._set or self.injected() else self._checkpoints  # they would be of another scenario
        return Recording(self.scenario, list(map(_joined, found.values())), stopped=self.stopped, checkpoints=checkpoints)

    def write(self, folder, engine: str) -> None:
        """Write what was flown as a bag, up to where it is."""
        complete = self._flight.tick >= self.scenario.ticks and not self.stopped
        happened = {SET_PARAMETERS: self._set, INJECTED_FAULTS: self.injected()}
        write_recording(self.recording(), folder, engine, complete=complete, happened={
            name: [json.dumps(entry) for entry in entries] for name, entries in happened.items()})


def _joined(parts: list[Track]) -> Track:
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    records = np.frombuffer(b"".join(part.records.tobytes() for part in parts), first.records.dtype)
    stamps = np.concatenate([part.stamps_ns for part in parts])
    return Track(first.topic, first.signal, first.node, first.port, stamps, records)


def _memory(run: CompiledRun, flight) -> Checkpoint:
    """The memory of a flight for a run with other faults: what both have goes on; an input that is on its way through
    faults for the first time is as its reader has seen it."""
    fresh = run.start(0)
    arrays = {name: array for name, array in fresh.arrays.items() if is_kept(name)}
    for name, array in arrays.items():
        old = flight.arrays.get(name)
        if old is not None and old.nbytes == array.nbytes:
            array.view("u1")[:] = old.view("u1")
    for firing in run.schedule.firings:
        for channel in firing.own.channels if firing.own else ():
            if channel.visible in arrays and channel.visible not in flight.arrays and channel.origin in flight.arrays:
                arrays[channel.visible].view("u1")[:] = flight.arrays[channel.origin].view("u1")
    return Checkpoint.of(flight.tick, fresh.shape, arrays)
