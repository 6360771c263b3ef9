"""Thrusters of the lander that fail: valves that stick, valves that leak, a watchdog that shuts them. All off by default.

Where all is off, nothing is computed, and not a bit of a run changes. The thrusters are an ideal wrench on the body axes:

  stuck    the valves of an axis hold a value, whatever is commanded: 0 is stuck shut, the axis's limit is stuck open
  leaking  force_leak [N] in B is added to what is delivered, at leak_place [m] in B from the centre of mass: its moment is
           leak_place x force_leak; torque_leak [N m] is a couple of its own. A leak costs propellant, and no limit holds it
  watchdog a wrench command without a successor for more than command_timeout [s] counts as zero; 0: it is held for ever
"""

from flight_graph.components.records import Parameters, State, field
from flight_math import DualVector, Vec3, cross, kernel, where


class ThrusterFailures(Parameters):
    force_stuck: Vec3 = field(0.0, unit="1", ge=0, le=1, doc="1: the force valves of a body axis are stuck")
    force_stuck_at: Vec3 = field(0.0, unit="N", doc="what stuck force valves deliver")
    torque_stuck: Vec3 = field(0.0, unit="1", ge=0, le=1, doc="1: the torque valves of a body axis are stuck")
    torque_stuck_at: Vec3 = field(0.0, unit="N m", doc="what stuck torque valves deliver")
    force_leak: Vec3 = field(0.0, unit="N", doc="force of a leaking valve, in B")
    torque_leak: Vec3 = field(0.0, unit="N m", doc="torque of a leaking pair of valves, in B")
    leak_place: Vec3 = field(0.0, unit="m", doc="where force_leak acts, from the centre of mass, in B")
    command_timeout: float = field(0.0, unit="s", ge=0, doc="an older command counts as zero; 0: never")


class Watchdog(State):
    """Stamp of the newest command, and the time since it came [s]."""

    command_sec: int
    command_nanosec: int
    command_age: float


@kernel
def failed(p, force, torque):
    """Force [N] and torque [N m] in B that stuck and leaking valves make of those that healthy ones would deliver."""
    if any(p.force_stuck != 0.0):
        force = where(p.force_stuck != 0.0, p.force_stuck_at, force)
    if any(p.torque_stuck != 0.0):
        torque = where(p.torque_stuck != 0.0, p.torque_stuck_at, torque)
    if any(p.force_leak != 0.0):
        force = force + p.force_leak
        torque = torque + cross(p.leak_place, p.force_leak)
    if any(p.torque_leak != 0.0):
        torque = torque + p.torque_leak
    return force, torque


@kernel
def watched_command(p, x, command):
    """The wrench that reaches the valves, force [N] + eps torque [N m]: the command, or zero when it is too old."""
    if p.command_timeout > 0.0:
        stamp = command.header.stamp
        if stamp.sec == x.command_sec and stamp.nanosec == x.command_nanosec:
            x.command_age += p.period
        else:
            x.command_sec, x.command_nanosec, x.command_age = stamp.sec, stamp.nanosec, 0.0
        if x.command_age > p.command_timeout:
            return DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
    return DualVector(command.wrench.force, command.wrench.torque)
