"""The ROS domain of a run: that of $ROS_DOMAIN_ID, else a free one of its own, so that runs do not hear each other.

Who runs a graph holds one socket a topic, bound to a name in Linux's abstract namespace: it exists once on the machine,
and goes with its process. So two runs that start at the same moment cannot take the same topic of the same domain.
"""

import contextlib
import os
import socket
from pathlib import Path

from flight_graph.errors import FlightError

VARIABLE = "ROS_DOMAIN_ID"
CLOCK = "clock"
_CHOICE = range(101, 0, -1)  # domains whose ports lie below those that Linux gives away; people tend to take low ones
_LARGEST = 232
_PORT, _PORTS = 7400, 250  # DDS: ports of a domain begin at 7400 + 250 n


class Domain:
    """A domain whose topics are this run's: ``with Domain(topics) as domain``. Raises FlightError where they are taken.

    number: the id; is_own: whether it was chosen here. topics: what the graph publishes; /clock is always among them.
    """

    def __init__(self, topics):
        self._topics, self._held = [CLOCK, *sorted({topic.strip("/") for topic in topics} - {CLOCK})], []
        text = os.environ.get(VARIABLE, "")
        self.is_own = not text
        self.number = self._choose() if self.is_own else self._named(text)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._release()

    def environment(self) -> dict[str, str]:
        """What the environment of the nodes gets."""
        return {VARIABLE: str(self.number)}

    def sentence(self) -> str:
        """Where to find the nodes, for a person."""
        return (f"the nodes are on ROS domain {self.number}, which was free (set {VARIABLE} before a run to choose); to "
                f"reach them:\nexport {VARIABLE}={self.number}")

    def _named(self, text):
        if not text.isdecimal() or int(text) > _LARGEST:
            raise FlightError(f"{VARIABLE}={text}: allowed: a whole number from 0 to {_LARGEST}")
        if taken := self._hold(int(text)):
            raise FlightError(f"{VARIABLE}={text}: another run on this machine publishes {', '.join(taken)} there; "
                              f"give this one another domain, or unset {VARIABLE}: each run then takes a free one")
        return int(text)

    def _choose(self):
        for number in _CHOICE:
            if not _is_in_use(number) and not self._hold(number):
                return number
        raise FlightError(f"no ROS domain from {_CHOICE[-1]} to {_CHOICE[0]} is free; set {VARIABLE} to choose one")

    def _hold(self, number) -> list[str]:
        """Take all topics of a domain; return those that somebody else has, and hold none then."""
        taken = []
        for topic in self._topics:
            held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                held.bind(_name(number, topic))
            except OSError:
                held.close()
                taken.append("/" + topic)
            else:
                self._held.append(held)
        if taken:
            self._release()
        return taken

    def _release(self):
        while self._held:
            self._held.pop().close()


def _name(number, topic) -> str:
    return f"\0flight_graph/{number}/{topic}"[:100]  # Linux allows 107 bytes


def _is_in_use(number) -> bool:
    """Whether any process of this machine has a port of the domain open."""
    first = _PORT + _PORTS * number
    return any(first <= port < first + _PORTS for port in _udp_ports())


def _udp_ports() -> set[int]:
    ports = set()
    for table in ("udp", "udp6"):
        with contextlib.suppress(OSError):
            for line in Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]:
                ports.add(int(line.split()[1].rpartition(":")[2], 16))
    return ports
