"""What nodes cannot publish because its type is not installed here (``/tf``), made from what they do publish."""

from flight_graph.recordings.recording import RecordedTopic, formatted_payload
from flight_graph.ros.installed import is_installed
from flight_graph.viewers.messages import LATCHED, Message, Stream
from msg_schemas.definitions import definition
from msg_schemas.signal import SignalMismatch


class Unsaid:
    """The formatted messages of a run that do not travel. topics: of the run; first: the number of their first stream."""

    def __init__(self, topics: list[RecordedTopic], epoch_ns: int, first: int):
        self._epoch_ns, self._made, self.streams = epoch_ns, {}, []
        numbers: dict[str, int] = {}
        for topic in topics:
            if topic.formatted is not None and not is_installed(topic.type_name):
                name = f"/{topic.topic}"
                if name not in numbers:
                    numbers[name] = first + len(self.streams)
                    self.streams.append(Stream(name, topic.type_name, definition(topic.type_name).text,
                                               latched=name in LATCHED))
                self._made.setdefault(f"/{topic.signal.topic}", []).append((numbers[name], topic))

    def messages(self, topic: str, stamp_ns: int, payload: bytes) -> list[Message]:
        """What belongs to a message of a topic; nothing where that is not the scenario's own."""
        found = []
        for number, made in self._made.get(topic, ()):
            if (said := self._said(made, stamp_ns, payload)) is not None:
                found.append(Message(number, stamp_ns, said))
        return found

    def _said(self, made: RecordedTopic, stamp_ns, payload) -> bytes | None:
        if made.formatted.once and stamp_ns != self._epoch_ns:
            return None
        target, record = made.signal.new()
        try:
            made.signal.receive(payload, target)
        except SignalMismatch:  # somebody else's message; it is shown as it is
            return None
        return formatted_payload(made.formatted, record)
