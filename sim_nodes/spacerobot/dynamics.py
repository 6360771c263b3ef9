"""The truth of the space robot: a base that floats freely and its arm, moved by torques alone.

Source: Aerospace 2023, 10(8), 679, equations (5), (7), (21)-(28). The rigid-body kernels are those of `spacerobot_ros`
(they are the same mathematics, checked against Pinocchio); the parameters pi given here are the true ones and may change
during a run, as when link 4 takes a payload.

``p`` is the plant's parameters: the robot's geometry and its stops.
"""

from typing import NamedTuple

import numpy as np

from flight_math import (
    Quaternion,
    Vec3,
    cross,
    dot,
    kernel,
    normalised,
    quaternion4,
    quaternion_rates,
    rk4_array,
    rotate,
    rotate_back,
    stack_array,
    vec3,
)
from flight_math.dense import cholesky, cholesky_solve, copy
from spacerobot_ros.dynamics import inverse_dynamics, mass_matrix, reduced_mass_matrix
from spacerobot_ros.kinematics import Motion, actual_motion, posed
from spacerobot_ros.reaction_wheels import effective_base_torque

ZERO = Vec3(0.0, 0.0, 0.0)


class RobotState(NamedTuple):
    """The state vector's parts, in its order, (20+2n,): base origin and its velocity, inertial axes [m, m/s]; attitude,
    body to inertial; rates, body axes [rad/s]; joints (n,) [rad]; joint_rates (n,) [rad/s]; work done on the bodies [J];
    impulse of external moments about the inertial origin [N m s]; momentum of the reaction wheels, base axes [N m s]."""

    position: Vec3
    velocity: Vec3
    attitude: Quaternion
    rates: Vec3
    joints: np.ndarray
    joint_rates: np.ndarray
    work: float
    impulse: Vec3
    wheels: Vec3


class Held(NamedTuple):
    """What does not change during a step: the plant's parameters, inertial parameters, wrench (6+n,) as in
    `forward_dynamics`, from outside and from the joint drives, and the rate of the wheels' momentum, base axes [N m]."""

    p: object
    pi: np.ndarray
    wrench: np.ndarray
    wheel_rate: Vec3


def state_size(joints: int) -> int:
    """Length of the state vector of a robot with ``joints`` joints."""
    return 20 + 2 * joints


@kernel
def robot_state(state):
    """Parts of a state vector; the joints' are read by reference."""
    n = (len(state) - 20) // 2
    after = 13 + 2 * n
    return RobotState(vec3(state[0:3]), vec3(state[3:6]), quaternion4(state[6:10]), vec3(state[10:13]), state[13:13 + n],
                      state[13 + n:after], state[after], vec3(state[after + 1:after + 4]), vec3(state[after + 4:after + 7]))


@kernel
def write_state(state, s):
    """Fill a state vector, or the rate of one, from its parts."""
    n = len(s.joints)
    after = 13 + 2 * n
    state[0:3], state[3:6], state[6:10], state[10:13] = s.position, s.velocity, s.attitude, s.rates
    copy(s.joints, state[13:13 + n])
    copy(s.joint_rates, state[13 + n:after])
    state[after], state[after + 1:after + 4], state[after + 4:after + 7] = s.work, s.impulse, s.wheels


@kernel
def forward_dynamics(tree, pi, w, thd, wrench, acceleration):
    """Accelerations under a wrench, equation (28): H [a, w_dot, thdd] + bias = wrench, linear momentum eliminated.

    ``wrench`` (6+n,): force on the base origin and moment on the base, base axes [N, N m], joint torques [N m].
    ``acceleration`` (6+n,): inertial acceleration of the base origin in base axes [m/s^2], w_dot, theta_ddot [rad/s^2].
    """
    n, size = len(thd), 6 + len(thd)
    h, reduced, bias, still = stack_array(size, size), stack_array(3 + n, 3 + n), stack_array(size), stack_array(n)
    inverse_dynamics(tree, pi, actual_motion(w, ZERO, ZERO, thd, still), bias)
    mass_matrix(tree, pi, h)
    reduced_mass_matrix(h, reduced)
    for k in range(3):
        bias[k] = (wrench[k] - bias[k]) / h[k, k]
    for k in range(3, size):
        acceleration[k] = wrench[k] - bias[k]
        for m in range(3):
            acceleration[k] -= h[m, k] * bias[m]
    cholesky(reduced, 3 + n)
    cholesky_solve(reduced, 3 + n, acceleration[3:])
    for k in range(3):
        acceleration[k] = bias[k]
        for m in range(3, size):
            acceleration[k] -= h[k, m] * acceleration[m] / h[k, k]


@kernel
def stop_torque(p, i, theta, theta_dot):
    """Torque of joint i's mechanical stops [N m]: outside [lower, upper] a spring whose force grows with the rate of
    compression, k x (1 + c x_dot), and never pulls (Hunt and Crossley 1975: no jump at the touch).

    p.stop_stiffness k [N m/rad], p.stop_damping c [s/rad].
    """
    if theta > p.upper[i]:
        return -p.stop_stiffness * (theta - p.upper[i]) * max(0.0, 1.0 + p.stop_damping * theta_dot)
    if theta < p.lower[i]:
        return p.stop_stiffness * (p.lower[i] - theta) * max(0.0, 1.0 - p.stop_damping * theta_dot)
    return 0.0


@kernel
def total_wrench(p, s, wrench, wheel_rate, total):
    """Fill ``total`` (6+n,): the outer wrench with the drives' torques, the wheels' torque on the base, and the stops'."""
    total[0:3] = vec3(wrench[0:3])
    total[3:6] = vec3(wrench[3:6]) + effective_base_torque(wheel_rate, s.rates, s.wheels)
    for i in range(len(s.joints)):
        total[6 + i] = wrench[6 + i] + stop_torque(p, i, s.joints[i], s.joint_rates[i])


@kernel
def accelerations(p, pi, s, total, acceleration):
    """Fill ``acceleration`` (6+n,) of the state ``s`` under the `total_wrench`."""
    tree = posed(p, s.joints, stack_array(len(s.joints), 3, 3))
    forward_dynamics(tree, pi, s.rates, s.joint_rates, total, acceleration)


@kernel
def state_rate(held, t, state, rate):
    """Fill ``rate`` with the time derivative of the state, under what is `Held`."""
    p, pi, wrench, wheel_rate = held
    s = robot_state(state)
    n = len(s.joints)
    total, acceleration = stack_array(6 + n), stack_array(6 + n)
    total_wrench(p, s, wrench, wheel_rate, total)
    accelerations(p, pi, s, total, acceleration)
    force, moment = rotate(s.attitude, vec3(wrench[0:3])), rotate(s.attitude, vec3(wrench[3:6]))
    power = dot(vec3(total[0:3]), rotate_back(s.attitude, s.velocity)) + dot(vec3(total[3:6]), s.rates)
    for i in range(n):
        power += total[6 + i] * s.joint_rates[i]
    write_state(rate, RobotState(
        s.velocity, rotate(s.attitude, vec3(acceleration[0:3])), quaternion_rates(s.attitude, s.rates),
        vec3(acceleration[3:6]), s.joint_rates, acceleration[6:], power, moment + cross(s.position, force), wheel_rate))


@kernel
def step(p, pi, state, wrench, wheel_rate, period):
    """Move ``state`` by ``period`` [s], one Runge-Kutta step of order four, with wrench and wheel rate held."""
    rk4_array(state_rate, Held(p, pi, wrench, wheel_rate), 0.0, state, period)
    state[6:10] = normalised(quaternion4(state[6:10]))


@kernel
def momentum_and_energy(p, pi, state):
    """Linear [kg m/s] and angular momentum [N m s] about the inertial origin, inertial axes, equations (21), (22), and
    kinetic energy [J], of base and arm. Wheel momentum is not in them.

    With velocities put in the place of accelerations, inverse dynamics returns the momenta.
    """
    s = robot_state(state)
    n = len(s.joints)
    momenta, still = stack_array(6 + n), stack_array(n)
    velocity = rotate_back(s.attitude, s.velocity)
    tree = posed(p, s.joints, stack_array(n, 3, 3))
    inverse_dynamics(tree, pi, Motion(ZERO, ZERO, s.rates, velocity, still, still, s.joint_rates), momenta)
    linear, angular = vec3(momenta[0:3]), vec3(momenta[3:6])
    energy = 0.5 * (dot(velocity, linear) + dot(s.rates, angular))
    for i in range(n):
        energy += 0.5 * s.joint_rates[i] * momenta[6 + i]
    linear = rotate(s.attitude, linear)
    return linear, rotate(s.attitude, angular) + cross(s.position, linear), energy
