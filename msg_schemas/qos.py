"""Quality of service by role, in one table.

Depths are such that lockstep cannot overflow a reader: the clock master never runs more than `WINDOW` ticks ahead of the
slowest node (see the ros engine), and a stream keeps more than that. A node by itself, in realtime, asks for less
(`alone`): sensors of others are best effort, as a rule, and a controller that has fallen behind wants no old ones.
"""

from dataclasses import dataclass
from enum import Enum

WINDOW = 500  # [ticks] how far the clock master may run ahead of any node in lockstep

WINDOW_LIVE = 50  # [ticks] where faults may be injected: they begin some windows later
WINDOW_FOREIGN = 8  # [ticks] where a foreign node that the clock does not wait for may read with a depth of 10


@dataclass(frozen=True)
class Qos:
    """The settings that differ between roles; all are KEEP_LAST, liveliness automatic, no deadline."""

    depth: int
    reliable: bool = True
    transient_local: bool = False


class Role(Enum):
    """What a topic is for."""

    SENSOR = "sensor"
    COMMAND = "command"
    ESTIMATE = "estimate"
    TRUTH = "truth"
    TELEMETRY = "telemetry"
    DIAGNOSTICS = "diagnostics"
    LATCHED = "latched"

    @property
    def qos(self) -> Qos:
        """Reliability, durability and depth of this role."""
        return QOS[self]


_STREAM = Qos(depth=4 * WINDOW)
QOS = {
    Role.SENSOR: _STREAM,
    Role.COMMAND: _STREAM,
    Role.ESTIMATE: _STREAM,
    Role.TRUTH: _STREAM,
    Role.TELEMETRY: _STREAM,
    Role.DIAGNOSTICS: Qos(depth=100),
    Role.LATCHED: Qos(depth=1, transient_local=True),
}
RECORDER = Qos(depth=20_000)  # reader history of the recorder, drained on a period


def alone(role: Role) -> Qos:
    """What an input of a node that runs by itself asks for; commands and latched topics stay reliable."""
    if role is Role.LATCHED:
        return role.qos
    return Qos(depth=1, reliable=role is Role.COMMAND)
