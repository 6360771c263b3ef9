"""The Cubli rover on its corner, by the paper's model: cube, gravity, disturbance, three reaction wheels.

Source: Aerospace 2022, 9(11), 728, equations (1)-(5), (42). The equations are in `sim_nodes.cubli_dynamics`.
"""

import math

from cubli_ros.attitude import quaternion_from_cardan, quaternion_multiply, to_body
from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from msg_schemas import cubli
from msg_schemas.definitions import TYPESTORE
from sim_nodes import cubli_dynamics
from sim_nodes.reaction_wheels import deliverable_torque, spin

# Quaternion x, y, z, w that turns balance-frame coordinates into the site frame: [1, 1, 1] / sqrt(3) goes up.
_HALF = 0.5 * math.acos(1.0 / math.sqrt(3.0))  # [rad]
SITE_FROM_BALANCE = (math.sin(_HALF) / math.sqrt(2.0), -math.sin(_HALF) / math.sqrt(2.0), 0.0, math.cos(_HALF))


class RoverParameters(Parameters):
    """Start, disturbance and wheels: what every plant of the rover has."""

    initial_angles: Vec3 = field((-0.3, 0.3, 0.3), unit="rad", source="section 5", doc="Cardan angles at the start")
    initial_rates: Vec3 = field(0.0, unit="rad/s", doc="body rates at the start")
    disturbance_amplitude: Vec3 = field(0.02, unit="rad/s^2", ge=0, source="eq. (42)", doc="of each axis")
    disturbance_frequency: float = field(1.0, unit="rad/s", ge=0, source="eq. (42); not given there", doc="of all axes")
    disturbance_phase: Vec3 = field(0.0, unit="rad", doc="of each axis")
    torque_limit: float = field(0.02, unit="N m", gt=0, doc="each wheel's largest torque")
    speed_limit: float = field(628.0, unit="rad/s", gt=0, doc="each wheel's largest speed")
    wheel_inertia: float = field(1.0e-3, unit="kg m^2", gt=0, doc="of each wheel about its axis")
    largest_step: float = field(1.0e-3, unit="s", gt=0, doc="Runge-Kutta steps are no longer than this")


class CubliPlantParameters(RoverParameters):
    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    gravity: float = field(0.002, unit="m/s^2", ge=0, source="section 5.2", doc="surface gravity, level ground")
    gravity_sign: int = field(1, ge=-1, le=1, source="eq. (4)", doc="+1: inverted pendulum; -1: as printed (hanging)")


class CubliPlantState(State):
    motion: Array(6)
    accelerations: Vec3
    wheel_speed: Vec3
    torque: Vec3
    gravity: Vec3
    before: Vec3
    quaternion: Array(4)
    site_from_balance: Array(4)
    slope: Array(6)
    disturbance: Vec3
    work: Array(4, 6)


@kernel
def start(p, x):
    for i in range(3):
        x.motion[i] = p.initial_angles[i]
        x.motion[3 + i] = p.initial_rates[i]
        x.gravity[i] = -p.gravity / math.sqrt(3.0)
    for i in range(4):
        x.site_from_balance[i] = SITE_FROM_BALANCE[i]
    cubli_dynamics.disturbance(0.0, p.disturbance_amplitude, p.disturbance_frequency, p.disturbance_phase, x.disturbance)
    rates(p, x)


@kernel
def rates(p, x):
    """Angular acceleration now, under the torque of the last interval."""
    cubli_dynamics.paper_rates(x.motion, x.torque, x.disturbance, x.gravity, p.gravity_sign, p.mass, p.length,
                               p.mass * p.length * p.length / 6.0, x.slope)
    for i in range(3):
        x.accelerations[i] = x.slope[3 + i]


@kernel
def output(t_ns, p, x, truth, attitude, wheels, pose):
    quaternion_from_cardan(x.motion, x.quaternion)
    g_x, g_y, g_z = to_body(x.motion, x.gravity[0], x.gravity[1], x.gravity[2])
    truth.gravity[0] = g_x
    truth.gravity[1] = g_y
    truth.gravity[2] = g_z
    for i in range(3):
        truth.angles[i] = x.motion[i]
        truth.rates[i] = x.motion[3 + i]
        truth.accelerations[i] = x.accelerations[i]
        truth.wheel_speed[i] = x.wheel_speed[i]
        truth.torque[i] = x.torque[i]
        truth.disturbance[i] = x.disturbance[i]
        attitude.angular_velocity[i] = x.motion[3 + i]
        wheels.velocity[i] = x.wheel_speed[i]
        wheels.effort[i] = x.torque[i]
    for i in range(4):
        attitude.orientation[i] = x.quaternion[i]
    quaternion_multiply(x.site_from_balance, x.quaternion, pose.pose.orientation)
    centre(p.length, pose.pose.orientation, pose.pose.position)


@kernel
def centre(length, q, out):
    """The cube's centre in the site frame: R(q) l/2 [1, 1, 1]."""
    half = 0.5 * length
    x, y, z, w = q[0], q[1], q[2], q[3]
    out[0] = half * (1.0 - 2.0 * (y * y + z * z) + 2.0 * (x * y - w * z) + 2.0 * (x * z + w * y))
    out[1] = half * (2.0 * (x * y + w * z) + 1.0 - 2.0 * (x * x + z * z) + 2.0 * (y * z - w * x))
    out[2] = half * (2.0 * (x * z - w * y) + 2.0 * (y * z + w * x) + 1.0 - 2.0 * (x * x + y * y))


@kernel
def update(t_ns, p, x, command):
    """One period under the wheels' torque: clipped to what they can deliver, held."""
    deliverable_torque(command.effort, x.wheel_speed, p.torque_limit, p.speed_limit, p.wheel_inertia, p.period, x.torque)
    for i in range(3):
        x.before[i] = x.motion[3 + i]
    t = t_ns / SECOND
    substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
    cubli_dynamics.paper_step(
        x.motion, t, p.period, substeps, x.torque, p.disturbance_amplitude, p.disturbance_frequency,
        p.disturbance_phase, x.gravity, p.gravity_sign, p.mass, p.length, p.mass * p.length * p.length / 6.0, x.work)
    cubli_dynamics.disturbance(t + p.period, p.disturbance_amplitude, p.disturbance_frequency, p.disturbance_phase,
                               x.disturbance)
    rates(p, x)
    for i in range(3):
        x.before[i] = x.motion[3 + i] - x.before[i]
    spin(x.torque, x.before, p.wheel_inertia, p.period, x.wheel_speed)


def transform(record):
    """site -> cubli_base as a TFMessage."""
    types = TYPESTORE.types
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    pose = record.pose
    return types["tf2_msgs/msg/TFMessage"]([types["geometry_msgs/msg/TransformStamped"](
        types["std_msgs/msg/Header"](time, cubli.SITE), cubli.BASE, types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](*map(float, pose.position)),
            types["geometry_msgs/msg/Quaternion"](*map(float, pose.orientation))))])


class CubliPlant(Component):
    """The Cubli rover by the paper's model, with reaction wheels that have limits."""

    parameters, state = CubliPlantParameters, CubliPlantState
    inputs = {"command": cubli.COMMAND}
    outputs = {"truth": cubli.TRUTH, "attitude": cubli.TRUTH_ATTITUDE, "wheels": cubli.WHEEL_STATE,
               "pose": cubli.TRUTH_POSE}
    output_rate_hz = {"pose": 10.0}
    rate_hz = 100.0
    start, output, update = start, output, update
    formatted = (Formatted("tf", "tf2_msgs/msg/TFMessage", "pose", transform),)

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
