"""The rover with its true inertia about the corner, wheels and wheel momentum, for the tests of the design rules.

The motion is `sim_nodes.cubli_dynamics.physical_step`; contact is judged, not simulated. The disturbance is the torque
I0 d with d of eq. (42), as Aerospace 2022, 9(11), 728 gives it.
"""

import math

import numpy as np

from cubli_ros import jump_condition
from cubli_ros.attitude import cardan_from_quaternion, invert_3x3, quaternion_from_cardan, quaternion_to_body
from flight_graph.component import Component
from flight_graph.kernel import kernel
from flight_graph.records import Array, State, Vec3, field
from flight_graph.timebase import SECOND
from msg_schemas import cubli
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from sim_nodes import cubli_dynamics
from sim_nodes.cubli_plant import CubliPlantParameters
from sim_nodes.reaction_wheels import deliverable_torque

CONTACT = named_vector("cubli/contact", "cubli_base", {
    "normal": Quantity(None, "1", "normal force in m g, under the torque of the interval that ends now"),
    "friction": Quantity(None, "1", "friction ratio at that time"),
}, Role.TRUTH)


class RoverParameters(CubliPlantParameters):
    tilt: float = field(0.0, unit="rad", ge=0, lt=1.5, doc="of the ground; contact is judged on its worst side")


class RoverState(State):
    motion: Array(10)
    slope: Array(10)
    angles: Vec3
    torque: Vec3
    push: Vec3
    amplitude: Vec3
    gravity: Vec3
    body_gravity: Vec3
    up: Vec3
    corner_inertia: Array(3, 3)
    body_inertia: Array(3, 3)
    inverse: Array(3, 3)
    work: Array(4, 10)
    normal: float = 1.0
    friction: float


@kernel
def start(p, x):
    quaternion_from_cardan(p.initial_angles, x.motion)
    scale = p.mass * p.length * p.length
    x.normal = 1.0
    for i in range(3):
        x.motion[4 + i] = p.initial_rates[i]
        x.gravity[i] = -p.gravity / math.sqrt(3.0)
        x.amplitude[i] = p.disturbance_amplitude[i] * scale / 6.0
        for j in range(3):
            x.corner_inertia[i, j] = -0.25 * scale
            if i == j:
                x.corner_inertia[i, j] += 11.0 / 12.0 * scale
            x.body_inertia[i, j] = x.corner_inertia[i, j]
        x.body_inertia[i, i] -= p.wheel_inertia
    invert_3x3(x.body_inertia, x.inverse)


@kernel
def output(t_ns, p, x, truth, attitude, contact):
    cardan_from_quaternion(x.motion, x.angles)
    for i in range(3):
        truth.angles[i] = x.angles[i]
        truth.rates[i] = x.motion[4 + i]
        truth.wheel_speed[i] = x.motion[7 + i]
        attitude.angular_velocity[i] = x.motion[4 + i]
    for i in range(4):
        attitude.orientation[i] = x.motion[i]
    contact.normal = x.normal
    contact.friction = x.friction


@kernel
def update(t_ns, p, x, command):
    t = t_ns / SECOND
    deliverable_torque(command.effort, x.motion[7:], p.torque_limit, p.speed_limit, p.wheel_inertia, p.period, x.torque)
    cubli_dynamics.disturbance(t, x.amplitude, p.disturbance_frequency, p.disturbance_phase, x.push)
    cubli_dynamics.physical_rates(x.motion, x.torque, x.push, x.gravity, p.mass, p.length, x.corner_inertia, x.inverse,
                                  p.wheel_inertia, x.slope)
    x.body_gravity[0], x.body_gravity[1], x.body_gravity[2] = quaternion_to_body(
        x.motion, x.gravity[0], x.gravity[1], x.gravity[2])
    touch(p, x)
    substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
    cubli_dynamics.physical_step(x.motion, t, p.period, substeps, x.torque, x.amplitude, p.disturbance_frequency,
                                 p.disturbance_phase, x.gravity, p.mass, p.length, x.corner_inertia, x.inverse,
                                 p.wheel_inertia, x.work)


@kernel
def touch(p, x):
    """Least normal force and largest friction ratio over twelve sides of the slope."""
    x.normal = 1e9
    x.friction = 0.0
    sides = 12 if p.tilt > 0.0 else 1
    norm = math.sqrt(x.body_gravity[0] ** 2 + x.body_gravity[1] ** 2)
    for side in range(sides):
        for i in range(3):
            x.up[i] = -x.body_gravity[i] / p.gravity
        if sides > 1:
            a = math.sin(p.tilt) * math.cos(2.0 * math.pi * side / sides)
            b = math.sin(p.tilt) * math.sin(2.0 * math.pi * side / sides)
            # two directions across "up": (up_y, -up_x, 0) / n and the cross product of "up" with it
            e_x = x.up[1] * p.gravity / norm
            e_y = -x.up[0] * p.gravity / norm
            n_x = -x.up[2] * e_y
            n_y = x.up[2] * e_x
            n_z = x.up[0] * e_y - x.up[1] * e_x
            x.up[0] = math.cos(p.tilt) * x.up[0] + a * e_x + b * n_x
            x.up[1] = math.cos(p.tilt) * x.up[1] + a * e_y + b * n_y
            x.up[2] = math.cos(p.tilt) * x.up[2] + b * n_z
        normal, _, friction = jump_condition.contact(x.motion[4:7], x.slope[4:7], x.body_gravity, x.up, p.length)
        x.normal = min(x.normal, normal)
        x.friction = max(x.friction, friction)


class PhysicalRover(Component):
    """The Cubli rover with its true inertia and wheels, always on its corner."""

    parameters, state = RoverParameters, RoverState
    inputs = {"command": cubli.COMMAND}
    outputs = {"truth": cubli.TRUTH, "attitude": cubli.TRUTH_ATTITUDE, "contact": CONTACT}
    start, output, update = start, output, update


def judge(scenario, signals) -> dict:
    """Settling (last |angle| > 0.008 rad), funnels, contact, and rates of a run."""
    truth, contact, funnel = signals["cubli/truth"], signals["cubli/contact"], signals["cubli/funnel"]
    t = np.arange(len(truth)) * scenario.graph.nodes["plant"].period_ns * 1e-9
    late = np.flatnonzero(np.abs(truth["angles"]).max(axis=1) > 0.008)
    omega = truth["rates"]
    across = omega - omega.mean(axis=1, keepdims=True)
    values = scenario.graph.nodes["plant"].values
    limit = math.sqrt(2.0 * values["gravity"] / (math.sqrt(3.0) * values["length"]))
    return {
        "settling_time_s": None if len(late) and late[-1] == len(t) - 1 else float(t[late[-1]]) if len(late) else 0.0,
        "xi_a_max": float(np.abs(funnel["attitude_xi"]).max()), "xi_u_max": float(np.abs(funnel["rate_xi"]).max()),
        "normal_force_min": float(contact["normal"].min()), "friction_ratio_max": float(contact["friction"].max()),
        "rate_share": float(np.sqrt((across * across).sum(axis=1)).max() / limit),
        "torque_peak": float(np.abs(signals["cubli/wheel_command"]["effort"]).max()),
        "wheel_speed_max": float(np.abs(truth["wheel_speed"]).max()),
        "clipped": float(funnel["clipped"][-1]), "tail_rad": float(np.abs(truth["angles"][-len(t) // 6:]).max()),
    }
