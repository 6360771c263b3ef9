"""A stream to Foxglove and Lichtblick: messages as they are, named numbers under their names, parameters that may be set.

The source is a bag, a run that flies, or a running graph; the viewer connects to ``ws://HOST:PORT``. Parameters besides the
source's own: ``playback.speed`` (simulated seconds a second; 0 stands still), and where faults may be injected
``faults.inject`` (YAML or JSON, as ``{at: imu, type: hang}``), ``faults.clear`` (an id) and ``faults.injected``.
"""

import json
import threading
import time

import numpy as np

from flight_graph import yaml_text
from flight_graph.bags.series import NAMED
from flight_graph.errors import FlightError
from flight_graph.extras import required
from flight_graph.timebase import SECOND
from flight_graph.viewers.messages import Message, in_memory, named_series
from flight_graph.viewers.typed_topics import TypedTopic

SPEED, INJECT, CLEAR, INJECTED = "playback.speed", "faults.inject", "faults.clear", "faults.injected"
BACKLOG = 1 << 16  # messages that wait for a slow viewer
PERIOD_S = 0.02  # [s] between two looks at the source
TELL_S = 0.5  # [s] between two looks at the parameters
LONGEST_S = 0.5  # [s] a machine that was busy goes on from where it was
SETTLED_S = 0.3  # [s] after the last subscription the viewer has made them all


class FoxgloveStream:
    """Serves a source until it is stopped. tell(sentence): for a person. Raises FlightError where a port cannot be had."""

    def __init__(self, source, host: str, port: int, speed: float = 1.0, tell=None):
        self._sdk = required("foxglove", "foxglove", "flight serve")
        self._web = required("foxglove.websocket", "foxglove", "flight serve")
        self._source, self._speed, self._tell = source, speed, tell or (lambda sentence: None)
        self._lock, self._seek, self._is_playing = threading.Lock(), None, True
        self._subscribed, self._heard_s, self._latest = threading.Event(), 0.0, {}
        self.now_ns, self._known, self._told_s = source.begin_ns, {}, 0.0
        self._context = self._sdk.Context()
        self._channels, self._named = [], {}
        self._announce()
        self._server = self._start(host, port)

    def _start(self, host, port):
        capabilities = [self._web.Capability.Time, self._web.Capability.Parameters]
        span = (self._source.begin_ns, self._source.end_ns) if self._source.can_seek else None
        try:
            return self._sdk.start_server(
                name=self._source.name, host=host, port=port, capabilities=capabilities, server_listener=_listener(self),
                context=self._context, playback_time_range=span, message_backlog_size=BACKLOG)
        except (RuntimeError, OSError, ValueError) as error:
            raise FlightError(f"--host {host} --port {port}: nothing can be served there ({error}); another port may be "
                              "free, as --port 8766") from None

    @property
    def port(self) -> int:
        """The port that is served on."""
        return self._server.port

    # -- channels --------------------------------------------------------------------------------------------------
    def _announce(self):
        """Make the channels of streams and typed topics that are new."""
        for stream in self._source.streams[len(self._channels):]:
            self._channels.append(self._channel(stream.topic, stream.encoding, stream.type_name, stream.definition,
                                                stream.definition_encoding))
        taken = {stream.topic for stream in self._source.streams}
        for topic in self._source.typed:
            if topic not in self._named and topic.own_topic not in taken:
                self._named[topic] = self._channel(topic.own_topic, "cdr", topic.type_name, topic.definition, "ros2msg")

    def _channel(self, topic, encoding, type_name, definition, definition_encoding):
        schema = self._sdk.Schema(name=type_name, encoding=definition_encoding, data=definition.encode()) if (
            definition) else None
        return self._sdk.Channel(topic, schema=schema, message_encoding=encoding, context=self._context)

    def subscribed(self, topic: str) -> None:
        """A viewer has asked for a topic: say what is latched once more."""
        self._heard_s = time.monotonic()
        self._subscribed.set()
        with self._lock:
            message = self._latest.get(topic)
        if message is not None:
            self._channels[message.number].log(message.payload, log_time=message.stamp_ns)

    # -- sending ---------------------------------------------------------------------------------------------------
    def wait_for_viewer(self, stop: threading.Event) -> None:
        """Wait until a viewer has subscribed, and has had time to subscribe to all that it wants."""
        while not stop.is_set() and (
                not self._subscribed.wait(PERIOD_S) or time.monotonic() - self._heard_s < SETTLED_S):
            stop.wait(PERIOD_S)

    def run(self, stop: threading.Event, once: bool = False, loop: bool = False) -> None:
        """Send until told to stop; with once to the end of the source, with loop again and again (a bag)."""
        before, told = time.monotonic(), False
        while not stop.is_set():
            now = time.monotonic()
            self._jump()
            if self._is_playing and self._source.end_ns is not None:
                step = round(min(now - before, LONGEST_S) * self._speed * SECOND)
                self.now_ns = min(self.now_ns + step, max(self._source.end_ns, self.now_ns))
            before = now
            self.send(self._source.take(self.now_ns))
            if self._source.end_ns is None:
                self.now_ns = max(self.now_ns, self._source.now_ns)
            self._server.broadcast_time(max(0, self.now_ns))
            self._publish_parameters(now)
            if self._source.is_over and not told:
                told = self._over()
                if once:
                    return
                if loop and self._source.can_seek:
                    self._seek, told = self._source.begin_ns, False
                    self._server.clear_session()
            told = told and self._source.is_over
            stop.wait(PERIOD_S)

    def _publish_parameters(self, now):
        """Tell viewers of parameters that have changed, whoever changed them."""
        if now - self._told_s < TELL_S:
            return
        self._told_s, known = now, self.parameters()
        changed = {name: value for name, value in known.items() if self._known.get(name) != value}
        self._known = known
        if changed:
            self._server.publish_parameter_values(
                [self._sdk.Parameter(name, value=value) for name, value in changed.items()])

    def _over(self) -> bool:
        if self._source.stopped:
            self._status(self._source.stopped, self._sdk.StatusLevel.Error)
        self._state(self._web.PlaybackStatus.Ended)
        return True

    def send(self, messages: list[Message]) -> None:
        """Send messages, and the named numbers that are in them, in the order of their stamps."""
        self._announce()
        rows = [(message.stamp_ns, 0, self._channels[message.number], message.payload) for message in messages]
        with self._lock:
            self._latest.update((self._source.streams[message.number].topic, message) for message in messages
                                if self._source.streams[message.number].latched)
        numbers = {message.number for message in messages if self._source.streams[message.number].type_name == NAMED}
        if numbers:
            bag = in_memory(self._source.streams, [message for message in messages if message.number in numbers],
                            self._source.units)
            found = {TypedTopic.of(series): series for series in named_series(bag)}
            if new := [topic for topic in found if topic not in self._source.typed]:
                self._source.typed += new
                self._announce()
            for topic, series in found.items():
                if topic in self._named and self._named[topic].has_sinks():
                    payloads = topic.payloads(bag.stamps_ns(topic.topic), series.values)
                    rows += [(stamp, 1, self._named[topic], payload.tobytes())
                             for stamp, payload in zip(bag.stamps_ns(topic.topic).tolist(), payloads)]
        for stamp, _, channel, payload in sorted(rows, key=lambda row: row[:2]):
            channel.log(payload, log_time=stamp)

    def close(self) -> None:
        """End the service."""
        self._server.stop()

    # -- asked by viewers ------------------------------------------------------------------------------------------
    def parameters(self) -> dict[str, object]:
        """Every parameter with its value."""
        found = {} if self._source.end_ns is None else {SPEED: float(self._speed)}
        if self._source.takes_faults:
            found |= {INJECT: "", CLEAR: "", INJECTED: json.dumps(self._source.injected())}
        return found | self._source.parameters()

    def set_parameters(self, given: dict[str, object]) -> None:
        """Set parameters as a viewer asks; what cannot be is said there, and here."""
        for name, value in given.items():
            try:
                self._set(name, value)
            except FlightError as error:
                self._status(f"{name}: {error}" if name not in str(error) else str(error), self._sdk.StatusLevel.Warning)

    def _set(self, name, value):
        if name == SPEED:
            if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0.0 <= value < 1e6:
                raise FlightError(f"{SPEED}: {value!r} is not allowed; allowed: simulated seconds a second, 0 to 1e6")
            self._speed = float(value)
        elif name == INJECT:
            if value:
                self._status(self._source.inject(yaml_text.parse(str(value), INJECT)), self._sdk.StatusLevel.Info)
        elif name == CLEAR:
            if value:
                self._status(self._source.clear(str(value)), self._sdk.StatusLevel.Info)
        elif name == INJECTED:
            raise FlightError(f"{INJECTED}: it is read only; {INJECT} injects, {CLEAR} ends")
        else:
            self._source.set(name, value)
            self._tell(f"{name} = {value} from t = {(self.now_ns - self._source.begin_ns) / SECOND:.9g} s")

    def _status(self, sentence, level):
        self._tell(sentence)
        self._server.publish_status(sentence, level)

    def playback(self, request):
        """Play, stand still, go to a time, as Foxglove's controls ask; what is so then."""
        play = request.playback_command == self._web.PlaybackCommand.Play
        self._is_playing = play
        if np.isfinite(request.playback_speed) and request.playback_speed >= 0:
            self._speed = float(request.playback_speed)
        if request.seek_time is not None:
            self._seek = int(request.seek_time)
        status = self._web.PlaybackStatus.Playing if play else self._web.PlaybackStatus.Paused
        return self._web.PlaybackState(status, self._seek or self.now_ns, self._speed, request.seek_time is not None,
                                       request.request_id)

    def _jump(self):
        """Go where a viewer has asked to go."""
        goal, self._seek = self._seek, None
        if goal is not None and self._source.can_seek:
            self.now_ns = min(max(goal, self._source.begin_ns), self._source.end_ns)
            self.send(self._source.seek(self.now_ns))

    def _state(self, status):
        if self._source.can_seek:
            self._server.broadcast_playback_state(self._web.PlaybackState(status, self.now_ns, self._speed, False, None))


def _listener(stream):
    """What the server calls when a viewer asks."""
    sdk, web = stream._sdk, stream._web

    class Listener(web.ServerListener):
        def on_subscribe(self, client, channel):
            stream.subscribed(channel.topic)

        def on_get_parameters(self, client, param_names, request_id=None):
            known = stream.parameters()
            return [sdk.Parameter(name, value=known[name]) for name in param_names or known if name in known]

        def on_set_parameters(self, client, parameters, request_id=None):
            stream.set_parameters({parameter.name: parameter.get_value() for parameter in parameters})
            known = stream.parameters()
            return [sdk.Parameter(parameter.name, value=known.get(parameter.name)) for parameter in parameters]

        def on_playback_control_request(self, playback_control_request):
            return stream.playback(playback_control_request)

    return Listener()
