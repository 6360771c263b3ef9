"""The toy graph's plant and controller written with values, and one part that takes its ports in bundles."""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Parameters, State, field
from flight_math import Mat3, Quaternion, Vec3, clip, kernel, norm, normalised, quaternion, rotate, stack_array, where
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, Signal, named_vector
from tests.graph import toy

POSE = Signal("toy/pose", "geometry_msgs/msg/PoseStamped", Role.TRUTH, {"header.frame_id": "toy"})
SEEN = named_vector("toy/seen", "toy", {"error": Quantity(3, "rad"), "length": Quantity(None, "rad"), "row": Quantity(5, "1")},
                    Role.TELEMETRY)


class PlantParameters(Parameters):
    inertia: Mat3 = field((0.5, 0.0, 0.01, 0.0, 0.4, 0.0, 0.01, 0.0, 0.3), unit="1/kg/m^2")
    stiffness: float = field(1.0, unit="N m/rad", ge=0)
    angle: Vec3 = field((0.1, 0.2, -0.3), unit="rad")


class PlantState(State):
    angle: Vec3
    rate: Vec3
    attitude: Quaternion
    kept: Array(4, 3)


@kernel
def plant_start(p, x):
    x.angle = p.angle
    x.attitude = Quaternion(0.0, 0.0, 0.0, 1.0)


@kernel
def plant_output(t_ns, p, x, outputs):
    outputs.truth.angle, outputs.truth.rate = x.angle, x.rate
    outputs.pose.pose.orientation = x.attitude
    outputs.pose.pose.position = rotate(x.attitude, x.angle)


@kernel
def plant_update(t_ns, p, x, command):
    for i in range(4):
        x.rate = x.rate + 0.25 * p.period * (p.inertia @ (command.effort - p.stiffness * x.angle))
        x.angle = x.angle + 0.25 * p.period * x.rate
        x.attitude = normalised(x.attitude + 0.125 * p.period * x.attitude * quaternion(x.rate, 0.0))
        x.kept[i] = x.angle


class Plant(Component):
    """Three oscillators, and an attitude."""

    parameters, state = PlantParameters, PlantState
    inputs, outputs = {"command": toy.COMMAND}, {"truth": toy.TRUTH, "pose": POSE}
    start, output, update = plant_start, plant_output, plant_update


class LawParameters(Parameters):
    gain: Vec3 = field((0.5, 1.0, 2.0), unit="N m/rad", gt=0)
    limit: float = field(0.2, unit="N m", gt=0)


class LawState(State):
    last: Vec3
    fired: int


@kernel
def law(t_ns, p, x, inputs, outputs):
    if same_stamp(inputs.truth.header.stamp, outputs.command.header.stamp):
        x.fired += 1
    error = inputs.truth.angle
    work = stack_array(5)
    work[:3] = where(abs(error) > 0.01, error, 0.0)
    work[3] = x.fired
    outputs.command.effort = clip(-p.gain * error - 0.1 * inputs.truth.rate, -p.limit, p.limit)
    outputs.seen.error = error - x.last
    outputs.seen.length = norm(error)
    outputs.seen.row = outputs.seen.row + 1.0
    x.last = error


class Law(Component):
    """A law with limits."""

    parameters, state = LawParameters, LawState
    inputs, outputs = {"truth": toy.TRUTH}, {"command": toy.COMMAND, "seen": SEEN}
    kernel = law


def scenario(duration_s=1.0) -> dict:
    """A scenario of the two in a loop."""
    return {
        "name": "values", "title": "values in records", "duration_s": duration_s,
        "components": {"plant": {"use": f"{__file__}:Plant", "rate_hz": 200}, "law": {"use": f"{__file__}:Law", "rate_hz": 100}},
    }
