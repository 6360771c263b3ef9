"""What a viewer is shown, moment by moment."""

from flight_graph.errors import FlightError
from flight_graph.viewers.messages import Message, Stream
from flight_graph.viewers.typed_topics import TypedTopic


class Source:
    """Messages in the order of their log times.

    begin_ns, end_ns: first and last log time; end_ns None: nobody knows it, and now_ns is the time that has come. units: as
    `flight_graph.viewers.messages.in_memory` takes them. can_seek: whether ``seek(t_ns)`` goes to any time.
    """

    name = ""
    streams: list[Stream]
    typed: list[TypedTopic]
    units: dict[str, str]
    begin_ns: int = 0
    end_ns: int | None = None
    can_seek = False
    takes_faults = False
    stopped = ""  # the sentence of what has ended it before its time

    @property
    def is_over(self) -> bool:
        """Whether nothing more will come."""
        return False

    def take(self, until_ns: int) -> list[Message]:
        """The messages up to a time, from where the last call ended."""
        raise NotImplementedError

    def parameters(self) -> dict[str, object]:
        """Name -> value, of all that may be set while it goes on."""
        return {}

    def set(self, key: str, value) -> None:
        """Set a parameter. Raises FlightError."""
        raise FlightError(f"{key}: nothing can be set here: what was recorded stays as it is")

    def close(self) -> None:
        """Let go of what it holds."""
