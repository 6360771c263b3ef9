"""A small oscillator with a sensor, a controller and a slow watcher: the graph that the executors' tests run."""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Choice, Parameters, State, field
from flight_math import Vec3, gaussian, kernel, norm, sin
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, Signal, named_vector

TRUTH = named_vector("toy/truth", "toy", {"angle": Quantity(3, "rad"), "rate": Quantity(3, "rad/s")}, Role.TRUTH)
SENSED = Signal("toy/imu", "sensor_msgs/msg/Imu", Role.SENSOR, {"header.frame_id": "toy_imu"})
COMMAND = Signal("toy/command", "sensor_msgs/msg/JointState", Role.COMMAND,
                 {"header.frame_id": "toy", "name": ["x", "y", "z"], "effort": 3})
WATCH = named_vector("toy/watch", "toy", {"fresh": Quantity(None, "1"), "total": Quantity(None, "N m")}, Role.TELEMETRY)


class PlantParameters(Parameters):
    inertia: float = field(2.0, unit="kg m^2", gt=0)
    stiffness: float = field(1.0, unit="N m/rad", ge=0)
    angle: Vec3 = field((0.1, 0.2, -0.3), unit="rad")


class PlantState(State):
    angle: Vec3
    rate: Vec3


@kernel
def plant_start(p, x):
    x.angle = p.angle


@kernel
def plant_output(t_ns, p, x, truth):
    truth.angle, truth.rate = x.angle, x.rate


@kernel
def plant_update(t_ns, p, x, command):
    for _ in range(4):
        acceleration = (command.effort - p.stiffness * sin(x.angle)) / p.inertia
        x.rate += 0.25 * p.period * acceleration
        x.angle += 0.25 * p.period * x.rate


class Plant(Component):
    """Three oscillators."""

    parameters, state = PlantParameters, PlantState
    inputs, outputs = {"command": COMMAND}, {"truth": TRUTH}
    start, output, update = plant_start, plant_output, plant_update


POSE = Signal("toy/pose", "geometry_msgs/msg/PoseStamped", Role.TRUTH, {"header.frame_id": "toy_world"})


@kernel
def movable_output(t_ns, p, x, truth, pose):
    truth.angle, truth.rate = x.angle, x.rate
    pose.pose.position = x.angle


@kernel
def movable_place(p, x, placement):
    if placement.sets_position:
        x.angle = p.stiffness * placement.position
    if placement.sets_velocity:
        x.rate = placement.velocity
    if norm(x.angle) > 3.0:
        x.fault = 1


class Drifter(Plant):
    """Three oscillators whose angles are a position, and can be put elsewhere."""

    outputs = {"truth": TRUTH, "pose": POSE}
    output_rate_hz = {"pose": 20.0}
    optional_inputs = ("command",)
    output, place = movable_output, movable_place
    faults = {1: "it was put beyond 3 rad"}


class SensorParameters(Parameters):
    seed: int = field(0)
    sigma: float = field(1e-3, unit="rad/s", ge=0)


@kernel
def sense(t_ns, p, x, truth, imu):
    noise = Vec3(gaussian(p.seed, t_ns, 0), gaussian(p.seed, t_ns, 1), gaussian(p.seed, t_ns, 2))
    imu.angular_velocity = truth.rate + p.sigma * noise
    imu.linear_acceleration = truth.angle


class Sensor(Component):
    """Rates with noise."""

    parameters = SensorParameters
    inputs, outputs = {"truth": TRUTH}, {"imu": SENSED}
    kernel = sense


class ControllerParameters(Parameters):
    kp: float = field(0.5, unit="N m/rad", ge=0)
    kd: float = field(0.8, unit="N m s/rad", ge=0, le=10)
    law: Choice("pd", "p") = field("pd")
    angle_limit: float = field(100.0, unit="rad", gt=0)


@kernel
def control(t_ns, p, x, imu, command):
    kd = p.kd if p.law == 0 else 0.0
    command.effort = -p.kp * imu.linear_acceleration - kd * imu.angular_velocity
    if any(abs(imu.linear_acceleration) > p.angle_limit):
        x.fault = 1


class Controller(Component):
    """Proportional-derivative law."""

    parameters = ControllerParameters
    inputs, outputs = {"imu": SENSED}, {"command": COMMAND}
    kernel = control
    faults = {1: "the angle left the limit of {angle_limit} rad"}


class WatchState(State):
    count: int
    total: float


@kernel
def watch(t_ns, p, x, imu, command, seen):
    if same_stamp(command.header.stamp, seen.header.stamp):
        x.count += 1
    x.total += command.effort[0]
    seen.fresh = x.count
    seen.total = x.total


class Watcher(Component):
    """Sums the command of the tick before."""

    state = WatchState
    inputs, outputs = {"imu": SENSED, "command": COMMAND}, {"seen": WATCH}
    kernel = watch
    rate_hz = 50.0
    output_rate_hz = {"seen": 10.0}


def scenario(**overrides) -> dict:
    """A scenario's data: plant and sensor 200 Hz, controller 100 Hz, watcher 50 Hz with a delayed input."""
    data = {
        "name": "toy", "title": "three oscillators", "duration_s": 2.0, "seed": 7,
        "components": {
            "plant": {"use": f"{__file__}:Plant", "rate_hz": 200},
            "watcher": {"use": f"{__file__}:Watcher"},
            "controller": {"use": f"{__file__}:Controller"},
            "sensor": {"use": f"{__file__}:Sensor", "rate_hz": 200},
        },
        "connect": {"watcher.command": {"from": "controller.command", "delay": 1}},
    }
    data.update(overrides)
    return data
