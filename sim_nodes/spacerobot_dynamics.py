"""The truth of the space robot: a base that floats freely and its arm, moved by torques alone.

Source: Aerospace 2023, 10(10), 679, equations (5), (7), (21)-(28). The rigid-body kernels are those of `spacerobot_ros`
(they are the same mathematics, checked against Pinocchio); the parameters given here are the true ones and may change
during a run, as when link 4 takes a payload.

State (20+2n,): base origin r (3) and its velocity (3), inertial axes [m, m/s]; attitude quaternion (4), scalar first,
body to inertial; angular velocity (3), body axes [rad/s]; theta (n) [rad]; theta_dot (n) [rad/s]; work done on the
bodies [J]; impulse (3) of external moments about the inertial origin [N m s]; momentum (3) of the reaction wheels, base
axes [N m s].
"""

import math

from flight_graph.kernel import kernel
from spacerobot_ros.dynamics import inverse_dynamics, mass_matrix, reduced_mass_matrix
from spacerobot_ros.kinematics import joint_rotations, rotation_matrix
from spacerobot_ros.small_matrices import cholesky, cholesky_solve

ATTITUDE = 6  # [-] first index of the quaternion in the state
RATE = 10  # [-] first index of the angular velocity
JOINTS = 13  # [-] first index of the joint angles; the joint rates follow


def state_size(joints: int) -> int:
    """Length of the state vector of a robot with ``joints`` joints."""
    return 20 + 2 * joints


def work_size(joints: int) -> int:
    """Length of the flat work array that the kernels of this module need."""
    n = joints
    return (6 + n) * (6 + n) + 28 * (n + 1) + (3 + n) * (3 + n) + 9 * n + 9 + 4 * (6 + n) + 3 * state_size(n)


@kernel
def forward_dynamics(parent, rotation, offset, axis, pi, w, thd, wrench, acceleration, work):
    """Accelerations under a wrench, equation (28): H [a, w_dot, thdd] + bias = wrench, linear momentum eliminated.

    ``wrench`` (6+n,): force on the base origin and moment on the base, base axes [N, N m], joint torques [N m].
    ``acceleration`` (6+n,): inertial acceleration of the base origin in base axes [m/s^2], w_dot, theta_ddot [rad/s^2].
    """
    n = parent.shape[0]
    size = 6 + n
    first = 0
    h = work[first : first + size * size].reshape((size, size))
    first += size * size
    composite = work[first : first + 10 * (n + 1)].reshape((n + 1, 10))
    first += 10 * (n + 1)
    load = work[first : first + 6 * (n + 1)].reshape((n + 1, 6))
    first += 6 * (n + 1)
    motion = work[first : first + 12 * (n + 1)].reshape((n + 1, 12))
    first += 12 * (n + 1)
    reduced = work[first : first + (3 + n) * (3 + n)].reshape((3 + n, 3 + n))
    first += (3 + n) * (3 + n)
    bias = work[first : first + size]
    first += size
    zero = work[first : first + size]
    for k in range(size):
        zero[k] = 0.0
    inverse_dynamics(
        parent, rotation, offset, axis, pi, w, w, zero, zero, thd, thd, zero, bias, motion, load
    )  # fmt: skip
    mass_matrix(parent, rotation, offset, axis, pi, h, composite, load)
    reduced_mass_matrix(h, reduced)
    for k in range(3):
        bias[k] = (wrench[k] - bias[k]) / h[k, k]
    for k in range(3, size):
        value = wrench[k] - bias[k]
        for m in range(3):
            value -= h[m, k] * bias[m]
        acceleration[k] = value
    cholesky(reduced, 3 + n)
    cholesky_solve(reduced, 3 + n, acceleration[3:])
    for k in range(3):
        value = bias[k]
        for m in range(3, size):
            value -= h[k, m] * acceleration[m] / h[k, k]
        acceleration[k] = value


@kernel
def stop_torque(theta, theta_dot, lower, upper, stiffness, damping):
    """Torque of one joint's mechanical stops [N m]: outside [lower, upper] a spring whose force grows with the rate of
    compression, k x (1 + c x_dot), and never pulls (Hunt and Crossley 1975: no jump at the touch).

    ``stiffness`` k [N m/rad], ``damping`` c [s/rad].
    """
    if theta > upper:
        return -stiffness * (theta - upper) * max(0.0, 1.0 + damping * theta_dot)
    if theta < lower:
        return stiffness * (lower - theta) * max(0.0, 1.0 - damping * theta_dot)
    return 0.0


@kernel
def state_rate(
    parent, fixed_rotation, offset, axis, pi, state, wrench, wheel_rate, lower, upper, stiffness, damping, rate, work
):
    """Time derivative of the state. ``wrench`` as in `forward_dynamics`, from outside and from the joint drives;
    ``wheel_rate`` (3,): rate of the wheels' momentum in base axes [N m]; it acts on the base as -h_dot - w x h.
    ``lower``, ``upper`` (n,) [rad], ``stiffness`` [N m/rad], ``damping`` [s/rad]: the joint stops.
    """
    n = parent.shape[0]
    turned = 20 + 2 * n - 3  # wheel momentum
    first = work.shape[0] - 9 * n - 9 - 2 * (6 + n)
    rotation = work[first : first + 9 * n].reshape((n, 3, 3))
    attitude = work[first + 9 * n : first + 9 * n + 9].reshape((3, 3))
    total = work[first + 9 * n + 9 : first + 9 * n + 15 + n]
    acceleration = work[first + 9 * n + 15 + n : first + 9 * n + 21 + 2 * n]
    q = state[ATTITUDE : ATTITUDE + 4]
    w = state[RATE : RATE + 3]
    theta = state[JOINTS : JOINTS + n]
    thd = state[JOINTS + n : JOINTS + 2 * n]
    joint_rotations(fixed_rotation, axis, theta, rotation)
    rotation_matrix(q, attitude)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        total[k] = wrench[k]
        total[3 + k] = wrench[3 + k] - wheel_rate[k] - (w[i] * state[turned + j] - w[j] * state[turned + i])
        rate[turned + k] = wheel_rate[k]
    for i in range(n):
        total[6 + i] = wrench[6 + i] + stop_torque(theta[i], thd[i], lower[i], upper[i], stiffness, damping)
    forward_dynamics(parent, rotation, offset, axis, pi, w, thd, total, acceleration, work)
    rate[6] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2])
    rate[7] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1])
    rate[8] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2])
    rate[9] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0])
    power = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        velocity, push, moment, arm, other = 0.0, 0.0, 0.0, 0.0, 0.0
        for m in range(3):
            push += attitude[k, m] * acceleration[m]
            moment += attitude[k, m] * wrench[3 + m]
            arm += attitude[j, m] * wrench[m]
            other += attitude[i, m] * wrench[m]
            velocity += attitude[m, k] * state[3 + m]
        rate[k] = state[3 + k]
        rate[3 + k] = push
        rate[RATE + k] = acceleration[3 + k]
        rate[turned - 3 + k] = moment + state[i] * arm - state[j] * other
        power += total[k] * velocity + total[3 + k] * w[k]
    for i in range(n):
        rate[JOINTS + i] = thd[i]
        rate[JOINTS + n + i] = acceleration[6 + i]
        power += total[6 + i] * thd[i]
    rate[JOINTS + 2 * n] = power


@kernel
def step(
    parent, fixed_rotation, offset, axis, pi, state, wrench, wheel_rate, lower, upper, stiffness, damping, period, work
):
    """Move ``state`` by ``period`` [s], one Runge-Kutta step of order four, with wrench and wheel rate held."""
    size = state.shape[0]
    first = work.shape[0] - 9 * parent.shape[0] - 9 - 2 * (6 + parent.shape[0]) - 3 * size
    slope = work[first : first + size]
    stage = work[first + size : first + 2 * size]
    mean = work[first + 2 * size : first + 3 * size]
    for k in range(size):
        stage[k] = state[k]
        mean[k] = 0.0
    for part in range(4):
        state_rate(
            parent, fixed_rotation, offset, axis, pi, stage, wrench, wheel_rate, lower, upper, stiffness, damping,
            slope, work,
        )  # fmt: skip
        weight = 1.0 if part == 0 or part == 3 else 2.0
        reach = period if part == 2 else 0.5 * period
        for k in range(size):
            mean[k] += weight * slope[k]
            stage[k] = state[k] + reach * slope[k]
    for k in range(size):
        state[k] += period / 6.0 * mean[k]
    norm = 0.0
    for k in range(ATTITUDE, ATTITUDE + 4):
        norm += state[k] * state[k]
    norm = math.sqrt(norm)
    for k in range(ATTITUDE, ATTITUDE + 4):
        state[k] /= norm


@kernel
def momentum_and_energy(parent, fixed_rotation, offset, axis, pi, state, linear, angular, work):
    """Returns the kinetic energy [J] of base and arm; ``linear`` (3,) [kg m/s] and ``angular`` (3,) [N m s] about the
    inertial origin, inertial axes, equations (21), (22). Wheel momentum is not in ``angular``.

    With velocities put in the place of accelerations, inverse dynamics returns the momenta.
    """
    n = parent.shape[0]
    rotation = work[0 : 9 * n].reshape((n, 3, 3))
    first = 9 * n
    attitude = work[first : first + 9].reshape((3, 3))
    first += 9
    motion = work[first : first + 12 * (n + 1)].reshape((n + 1, 12))
    first += 12 * (n + 1)
    load = work[first : first + 6 * (n + 1)].reshape((n + 1, 6))
    first += 6 * (n + 1)
    momenta = work[first : first + 6 + n]
    first += 6 + n
    zero = work[first : first + 3 + n]
    first += 3 + n
    velocity = work[first : first + 3]
    w = state[RATE : RATE + 3]
    thd = state[JOINTS + n : JOINTS + 2 * n]
    joint_rotations(fixed_rotation, axis, state[JOINTS : JOINTS + n], rotation)
    rotation_matrix(state[ATTITUDE : ATTITUDE + 4], attitude)
    for k in range(3 + n):
        zero[k] = 0.0
    for k in range(3):
        velocity[k] = attitude[0, k] * state[3] + attitude[1, k] * state[4] + attitude[2, k] * state[5]
    inverse_dynamics(
        parent, rotation, offset, axis, pi, zero, zero, w, velocity, zero, zero, thd, momenta, motion, load
    )  # fmt: skip
    energy = 0.0
    for k in range(3):
        energy += 0.5 * (velocity[k] * momenta[k] + w[k] * momenta[3 + k])
        linear[k] = attitude[k, 0] * momenta[0] + attitude[k, 1] * momenta[1] + attitude[k, 2] * momenta[2]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        about_base = attitude[k, 0] * momenta[3] + attitude[k, 1] * momenta[4] + attitude[k, 2] * momenta[5]
        angular[k] = about_base + state[i] * linear[j] - state[j] * linear[i]
    for i in range(n):
        energy += 0.5 * thd[i] * momenta[6 + i]
    return energy
