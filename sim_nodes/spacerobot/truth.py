"""What the space robot's plant says of the truth: state and accelerations, frames, and the motion of the base.

Source: Aerospace 2023, 10(8), 679, equations (5), (7), (21)-(28).
"""

from flight_graph.components.placement import TrueMotion
from flight_math import Quaternion, Vec3, kernel, mat3, quaternion_from_matrix, rotate, stack_array, vec3
from flight_math.dense import copy
from sim_nodes.spacerobot.actuators import WHEELS
from sim_nodes.spacerobot.dynamics import accelerations, momentum_and_energy, total_wrench
from spacerobot_ros.kinematics import posed
from spacerobot_ros.reaction_wheels import effective_base_torque


@kernel
def base_torque(p, x, s):
    """Torque on the base over the last interval [N m]."""
    if p.base_actuator == WHEELS:
        return effective_base_torque(x.wheel_rate, s.rates, s.wheels)
    return vec3(x.torque[0:3])


@kernel
def write_truth(p, x, s, truth):
    """The state, and the accelerations now under the torque of the last interval."""
    n = len(s.joints)
    wrench, total, acceleration = stack_array(6 + n), stack_array(6 + n), stack_array(6 + n)
    copy(x.torque, wrench[3:])
    for i in range(n):
        if x.friction[i] != 0.0:
            wrench[6 + i] += x.friction[i]
    total_wrench(p, s, wrench, x.wheel_rate, total)
    accelerations(p, x.pi, s, total, acceleration)
    truth.position, truth.velocity, truth.attitude, truth.rates = s.position, s.velocity, s.attitude, s.rates
    truth.joints, truth.joint_rates = s.joints, s.joint_rates
    truth.acceleration, truth.angular_acceleration = vec3(acceleration[0:3]), vec3(acceleration[3:6])
    truth.joint_accelerations = acceleration[6:]
    truth.base_torque, truth.joint_torque = base_torque(p, x, s), x.torque[3:]
    truth.momentum, truth.angular_momentum, truth.kinetic_energy = momentum_and_energy(p, x.pi, x.motion)
    truth.impulse, truth.work, truth.wheel_momentum, truth.limited = s.impulse, s.work, s.wheels, x.limited


@kernel
def write_frames(p, s, frames):
    """Where the base stands, and each link in its parent's axes."""
    n = len(p.parent)
    tree = posed(p, s.joints, stack_array(n, 3, 3))
    parents, offsets, rotations = stack_array(n), stack_array(3 * n), stack_array(4 * n)
    for i in range(n):
        q = quaternion_from_matrix(mat3(tree.rotation[i]))
        rotations[4 * i], rotations[4 * i + 1], rotations[4 * i + 2], rotations[4 * i + 3] = q.x, q.y, q.z, q.w
        parents[i] = p.parent[i]
        for k in range(3):
            offsets[3 * i + k] = p.offset[i][k]
    frames.position, frames.attitude = s.position, s.attitude
    frames.parents, frames.offsets, frames.rotations = parents, offsets, rotations
    frames.joints = s.joints


def motion(outputs) -> TrueMotion:
    """The motion of the base in inertial axes; accelerations: under the torque of the last interval."""
    truth = outputs["truth"]
    turn = Quaternion(*truth.attitude.tolist())
    rates, acceleration, angular_acceleration = (list(rotate(turn, Vec3(*numbers.tolist())).parts()) for numbers in (
        truth.rates, truth.acceleration, truth.angular_acceleration))
    return TrueMotion(truth.position.tolist(), truth.attitude.tolist(), truth.velocity.tolist(), rates, acceleration,
                  angular_acceleration)
