"""An open chain: a world, a gauge that measures it, a follower that reads the gauge, a bystander that reads it too.

Nothing is fed back, so what a fault does to one number can be computed from a run without it. The gauge has a slow output of
float32 numbers; the follower has memory, a start, and an input that nobody feeds.
"""

import numpy as np

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Parameters, State, field
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from flight_graph.timebase import SECOND
from flight_math import Vec3, kernel, sin
from msg_schemas.modes import mode, mode_request
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, Signal, named_vector

TRUTH = named_vector("chain/truth", "chain", {"angle": Quantity(3, "rad"), "rate": Quantity(3, "rad/s")}, Role.TRUTH)
IMU = Signal("chain/imu", "sensor_msgs/msg/Imu", Role.SENSOR, {"header.frame_id": "chain"})
RANGE = Signal("chain/range", "sensor_msgs/msg/Range", Role.SENSOR, {"header.frame_id": "chain"})
AID = named_vector("chain/aid", "chain", {"push": Quantity(None, "1")}, Role.COMMAND)
ECHO = named_vector("chain/echo", "chain", {
    "rate": Quantity(3, "rad/s"), "angle": Quantity(3, "rad"), "height": Quantity(None, "m"), "push": Quantity(None, "1"),
    "total": Quantity(None, "rad/s"), "held": Quantity(3, "rad/s"), "count": Quantity(None, "1"),
    "fresh": Quantity(None, "1"), "second": Quantity(None, "s"), "nano": Quantity(None, "ns")}, Role.ESTIMATE)
SEEN = named_vector("chain/seen", "chain", {"rate": Quantity(3, "rad/s")}, Role.TELEMETRY)


class WorldParameters(Parameters):
    rate: Vec3 = field((0.3, -0.2, 0.1), unit="rad/s")


class WorldState(State):
    angle: Vec3


@kernel
def world_output(t_ns, p, x, truth):
    truth.angle, truth.rate = x.angle, p.rate


@kernel
def world_update(t_ns, p, x):
    x.angle += p.period * p.rate


class World(Component):
    """Turns at a constant rate."""

    parameters, state = WorldParameters, WorldState
    outputs = {"truth": TRUTH}
    output, update = world_output, world_update


class GaugeParameters(Parameters):
    gain: float = field(1.0, unit="1", ge=0, le=10)
    offset: Vec3 = field((0.0, 0.0, 0.0), unit="rad/s")
    steps: int = field(3)


@kernel
def gauge(t_ns, p, x, truth, imu, range):
    wave = Vec3(sin(truth.angle[0]), sin(2.0 * truth.angle[1]), sin(3.0 * truth.angle[2]))
    imu.angular_velocity = p.gain * wave + p.offset
    imu.linear_acceleration = truth.angle
    range.range = 10.0 + truth.angle[0]
    range.radiation_type = 200


class Gauge(Component):
    """Measures rates and a distance, the distance five times slower."""

    parameters = GaugeParameters
    inputs, outputs = {"truth": TRUTH}, {"imu": IMU, "range": RANGE}
    kernel = gauge
    output_rate_hz = {"range": 20.0}


class FollowerParameters(Parameters):
    initial: float = field(7.0, unit="rad/s")


class FollowerState(State):
    total: float
    held: Vec3
    count: int


@kernel
def follower_start(p, x):
    x.total = p.initial
    x.count = 100


@kernel
def follow(t_ns, p, x, imu, range, aid, echo):
    x.total += imu.angular_velocity[0]
    x.held = x.held + imu.angular_velocity
    x.count += 1
    echo.rate, echo.angle, echo.height, echo.push = imu.angular_velocity, imu.linear_acceleration, range.range, aid.push
    echo.total, echo.held, echo.count = x.total, x.held, x.count
    echo.fresh = 1.0 if same_stamp(imu.header.stamp, echo.header.stamp) else 0.0
    echo.second, echo.nano = imu.header.stamp.sec, imu.header.stamp.nanosec


class Follower(Component):
    """Says what it sees, and sums it up."""

    parameters, state = FollowerParameters, FollowerState
    inputs, outputs = {"imu": IMU, "range": RANGE, "aid": AID}, {"echo": ECHO}
    optional_inputs = ("aid",)
    start, kernel = follower_start, follow


@kernel
def see(t_ns, p, x, imu, seen):
    seen.rate = imu.angular_velocity


class Bystander(Component):
    """Says what it sees."""

    inputs, outputs = {"imu": IMU}, {"seen": SEEN}
    kernel = see


class SpareParameters(Parameters):
    level: Vec3 = field((1.0, 2.0, 3.0), unit="1")


@kernel
def spare(t_ns, p, x, out):
    out.level = p.level


class Spare(Component):
    """A component by itself, whose output is called ``x_y``: as node ``n``, next to node ``n_x`` with an output ``y``."""

    parameters = SpareParameters
    outputs = {"x_y": named_vector("chain/spare", "chain", {"level": Quantity(3, "1")}, Role.TELEMETRY)}
    kernel = spare


class Other(Component):
    """A component by itself."""

    parameters = SpareParameters
    outputs = {"y": named_vector("chain/other", "chain", {"level": Quantity(3, "1")}, Role.TELEMETRY)}
    kernel = spare


class Third(Component):
    """A component by itself, with an output of the same name."""

    parameters = SpareParameters
    outputs = {"y": named_vector("chain/third", "chain", {"level": Quantity(3, "1")}, Role.TELEMETRY)}
    kernel = spare


class ManagerState(State):
    mode: float
    requests: float
    entered: float
    changes: float
    cause: float


@kernel
def manage(t_ns, p, x, request, status):
    if t_ns == 0:
        x.cause = -1.0
    if request.requests != x.requests:
        x.requests = request.requests
        if request.mode != x.mode:
            x.mode, x.cause, x.entered, x.changes = request.mode, request.cause, 1e-9 * t_ns, x.changes + 1.0
    status.mode, status.entered, status.changes, status.cause = x.mode, x.entered, x.changes, x.cause


class Manager(Component):
    """Takes the mode that it is asked for."""

    state = ManagerState
    inputs, outputs = {"request": mode_request("chain", "chain")}, {"mode": mode("chain", "chain")}
    optional_inputs = ("request",)
    modes = ("nominal", "hold", "rest")
    kernel = manage


def data(faults=None, duration_s=1.0, **changes) -> dict:
    """A scenario's data: world, gauge and bystander at 100 Hz, follower and manager at 50 Hz."""
    found = {
        "name": "chain", "title": "an open chain", "duration_s": duration_s, "seed": 3,
        "components": {
            "world": {"use": f"{__file__}:World"}, "gauge": {"use": f"{__file__}:Gauge"},
            "follower": {"use": f"{__file__}:Follower", "rate_hz": 50}, "bystander": {"use": f"{__file__}:Bystander"},
            "manager": {"use": f"{__file__}:Manager", "rate_hz": 50},
        },
    }
    if faults:
        found["faults"] = faults
    found.update(changes)
    return found


def scenario(faults=None, duration_s=1.0, **changes) -> Scenario:
    return Scenario(data(faults, duration_s, **changes), "chain.yaml")


class Flown:
    """A compiled run: ``flown["chain/imu"]`` are its records, ``flown.ticks(...)`` the times of their messages [ms]."""

    def __init__(self, faults=None, duration_s=1.0, **changes):
        self.scenario = scenario(faults, duration_s, **changes)
        self.recording = CompiledRun(self.scenario).run()
        self._tracks = {track.topic: track for track in self.recording.tracks}

    def __getitem__(self, topic) -> np.ndarray:
        return self._tracks[topic].records

    def ms(self, topic) -> list[int]:
        """When the messages came [ms since the start]."""
        return (self._tracks[topic].stamps_ns // 1_000_000).tolist()

    def stamps_ms(self, topic) -> list[int]:
        """The stamps in the messages [ms since the start]."""
        stamp = self[topic]["header"]["stamp"]
        stamps = stamp["sec"].astype(np.int64) * SECOND + stamp["nanosec"] - self.scenario.epoch_ns
        return (stamps // 1_000_000).tolist()


def fault(type, at, id="it", **keys) -> dict:
    return {"id": id, "at": at, "type": type, **keys}
