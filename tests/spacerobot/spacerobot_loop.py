"""The space robot's closed loop as one compiled function: truth, law and estimator at one control period.

At t_k: the least-squares update uses u_{k-1}, the state at t_k and the accelerations at t_k under u_{k-1}; then the
control law uses the new estimate; the Lyapunov update follows with the law's own regressor; u_k is held for a period.
"""

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

from flight_graph.kernel import kernel
from sim_nodes.spacerobot_dynamics import forward_dynamics, momentum_and_energy, state_size, step, work_size
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.adaptive_law import adaptive_control, control_work_size
from spacerobot_ros.dynamics import composite_parameters, inverse_dynamics
from spacerobot_ros.filtered_regressor import READY, filter_step, momentum_regressor
from spacerobot_ros.kinematics import attitude_difference, joint_rotations, rotation_vector
from spacerobot_ros.lyapunov_law import lyapunov_update
from spacerobot_ros.model import find_model
from spacerobot_ros.natural_adaptation import natural_update
from spacerobot_ros.regressor import regressor
from spacerobot_ros.trajectory import harmonic_reference

MODEL = Path(str(resources.files("spacerobot_ros"))) / "models" / "mini_space_robot.yaml"
ROBOT = find_model("mini_space_robot")
K_D0 = np.array([8.0, 8.0, 4.0, 1.5, 4.0, 1.5, 0.3])  # [N m s/rad]
THETA_0 = np.radians([90.0, 45.0, 45.0, 0.0])
NONE, RLS, LYAPUNOV, NATURAL, FILTERED = range(5)
IDEAL, DIFFERENCED = range(2)

# channels: roll, pitch, yaw, theta_1..4
STEP = (np.radians([10.0, 0, 0, 90, 55, 55, 10]), np.zeros(7), np.ones(7), np.zeros(7))
HARMONIC = (
    np.radians([0.0, 0, 0, 90, 45, 45, 0]),
    np.radians([10.0, 0, 0, 0, 20, 20, 25]),
    np.array([20.0, 20, 20, 16, 16, 12, 10]),
    np.zeros(7),
)


@kernel
def plant(tree, pi, state, u, period, substeps, unbounded, still, wrench, work):
    parent, fixed_rotation, offset, axis = tree
    for k in range(3):
        wrench[k] = 0.0
    for k in range(u.shape[0]):
        wrench[3 + k] = u[k]
    for _ in range(substeps):
        step(
            parent, fixed_rotation, offset, axis, pi, state, wrench, still, -unbounded, unbounded, 0.0, 0.0,
            period / substeps, work,
        )  # fmt: skip


@kernel
def loop(
    tree, pi_true, pi_hat, state, trajectory, estimator, first_row, acceleration_source, form, option, gain, damping,
    limit, period, substeps, gamma, natural_gain, bandwidth, forgetting, g, g_diagonal, noise, attitude, joints, torque,
    prediction, balance, regressors, work, rls_work,
):  # fmt: skip
    """Histories (steps, ...): ``attitude`` (3) [rad], ``joints`` (n) [rad], ``torque`` (3+n), ``prediction`` (),
    ``balance`` (|p|, |L - impulse|, T - work, T), ``regressors`` (6+n, p) of the actual motion if it has rows."""
    parent, fixed_rotation, offset, axis = tree
    mean, amplitude, periods, phase = trajectory
    n = parent.shape[0]
    p = pi_true.shape[0]
    rotation = np.zeros((n, 3, 3))
    true_rotation = np.zeros((n, 3, 3))
    q_d, w_d, wdot_d = np.zeros(4), np.zeros(3), np.zeros(3)
    theta_d, thd_d, thdd_d = np.zeros(n), np.zeros(n), np.zeros(n)
    square = np.zeros((3, 3))
    difference = np.zeros(4)
    u, sigma = np.zeros(3 + n), np.zeros(3 + n)
    wrench, acceleration = np.zeros(6 + n), np.zeros(6 + n)
    measured = np.zeros(6 + n)
    base_signals, joint_signals = np.zeros((4, 3)), np.zeros((3, n))
    y = np.zeros((6 + n, p))
    motion, still_motion, block = np.zeros((n + 1, 12)), np.zeros((n + 1, 12)), np.zeros((2, 6, 10))
    load = np.zeros((n + 1, 6))
    control_work = np.zeros(32 * n + 128)
    w, theta, thd, a = np.zeros(3), np.zeros(n), np.zeros(n), np.zeros(3)
    w_before, thd_before = np.zeros(3), np.zeros(n)
    alpha, thdd = np.zeros(3), np.zeros(n)
    linear, angular, still = np.zeros(3), np.zeros(3), np.zeros(3)
    zero = np.zeros(3 + n)
    unbounded = np.full(n, np.inf)
    y_momentum, y_rate, y_push = np.zeros((3 + n, p)), np.zeros((3 + n, p)), np.zeros((3 + n, p))
    filtered, memory, torque_filtered = np.zeros((3 + n, p)), np.zeros((2, 3 + n, p)), np.zeros(3 + n)
    natural_work = np.zeros((20, 4))
    ready = np.int64(0)
    status = 0
    for k in range(attitude.shape[0]):
        harmonic_reference(
            k * period, mean, amplitude, periods, phase, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, square
        )
        for i in range(3):
            wrench[i] = 0.0
        for i in range(3 + n):
            wrench[3 + i] = u[i]
        joint_rotations(fixed_rotation, axis, state[13 : 13 + n], true_rotation)
        forward_dynamics(
            parent, true_rotation, offset, axis, pi_true, state[10:13], state[13 + n : 13 + 2 * n], wrench,
            acceleration, work,
        )  # fmt: skip
        for i in range(3):
            w[i] = state[10 + i] + noise[k, i]
            a[i] = acceleration[i] + noise[k, 3 + 2 * n + i]
            alpha[i] = acceleration[3 + i]
            if acceleration_source == DIFFERENCED:
                alpha[i] = (w[i] - w_before[i]) / period if k > 0 else 0.0
            w_before[i] = w[i]
            measured[i] = 0.0
        for i in range(n):
            thd[i] = state[13 + n + i] + noise[k, 3 + i]
            theta[i] = state[13 + i] + noise[k, 3 + n + i]
            thdd[i] = acceleration[6 + i]
            if acceleration_source == DIFFERENCED:
                thdd[i] = (thd[i] - thd_before[i]) / period if k > 0 else 0.0
            thd_before[i] = thd[i]
        for i in range(3 + n):
            measured[3 + i] = u[i] + noise[k, 6 + 2 * n + i]
        joint_rotations(fixed_rotation, axis, theta, rotation)
        if estimator == RLS and not (acceleration_source == DIFFERENCED and k == 0):
            regressor(parent, rotation, offset, axis, w, w, alpha, a, thd, thd, thdd, y, motion, block[0])
            status |= rls.update(y, first_row, measured, forgetting, pi_hat, g, g_diagonal, rls_work)
        if estimator == FILTERED:
            momentum_regressor(
                parent, rotation, offset, axis, w, thd, a, y_momentum, y_rate, y_push, motion, still_motion, block, zero
            )
            ready = filter_step(
                y_momentum, y_rate, y_push, measured[3:], bandwidth, period, ready, memory, torque_filtered, filtered
            )
            if ready == READY:
                status |= rls.update(
                    filtered, np.int64(0), torque_filtered, forgetting, pi_hat, g, g_diagonal, rls_work
                )
        for i in range(p):
            y[0, i] = pi_hat[i] - pi_true[i]
        inverse_dynamics(
            parent, true_rotation, offset, axis, y[0], state[10:13], state[10:13], acceleration[3:6], acceleration[0:3],
            state[13 + n : 13 + 2 * n], state[13 + n : 13 + 2 * n], acceleration[6:], wrench, motion, load,
        )  # fmt: skip
        total = 0.0
        for i in range(3 + n):
            total += wrench[3 + i] * wrench[3 + i]
        prediction[k] = math.sqrt(total)
        if k < regressors.shape[0]:
            regressor(
                parent, true_rotation, offset, axis, state[10:13], state[10:13], acceleration[3:6], acceleration[0:3],
                state[13 + n : 13 + 2 * n], state[13 + n : 13 + 2 * n], acceleration[6:], regressors[k], motion,
                block[0],
            )  # fmt: skip
        attitude_difference(state[6:10], q_d, difference)
        rotation_vector(difference, attitude[k])
        for i in range(n):
            joints[k, i] = theta_d[i] - state[13 + i]
        energy = momentum_and_energy(parent, fixed_rotation, offset, axis, pi_true, state, linear, angular, work)
        balance[k, 0] = math.sqrt(linear[0] * linear[0] + linear[1] * linear[1] + linear[2] * linear[2])
        for i in range(3):
            balance[k, 1] = max(balance[k, 1], abs(angular[i] - state[14 + 2 * n + i]))
        balance[k, 2] = energy - state[13 + 2 * n]
        balance[k, 3] = energy
        adaptive_control(
            form, option, parent, rotation, offset, axis, pi_hat, state[6:10], w, theta, thd, q_d, w_d, wdot_d, theta_d,
            thd_d, thdd_d, a, gain, damping, limit, u, sigma, base_signals, joint_signals, control_work,
        )  # fmt: skip
        for i in range(3 + n):
            torque[k, i] = u[i]
        if estimator == LYAPUNOV or estimator == NATURAL:
            regressor(
                parent, rotation, offset, axis, base_signals[0], base_signals[1], base_signals[2], base_signals[3],
                joint_signals[0], joint_signals[1], joint_signals[2], y, motion, block[0],
            )  # fmt: skip
            if estimator == LYAPUNOV:
                lyapunov_update(y, 3, sigma, gamma, period, pi_hat)
            else:
                natural_update(y, 3, sigma, natural_gain, period, 2.0, pi_hat, natural_work)
        plant(tree, pi_true, state, u, period, substeps, unbounded, still, wrench, work)
    return status


@dataclass
class Run:
    """Histories of one run: t [s], errors [rad] -> deg by the properties, torque [N m], prediction error pe [N m]."""

    period: float
    attitude: np.ndarray
    joints: np.ndarray
    torque: np.ndarray
    prediction: np.ndarray
    balance: np.ndarray
    regressors: np.ndarray
    pi_hat: np.ndarray
    state: np.ndarray
    status: int

    @property
    def t(self):
        return self.period * np.arange(len(self.attitude))

    @property
    def attitude_norm(self):
        return np.degrees(np.linalg.norm(self.attitude, axis=1))

    @property
    def joint_norm(self):
        return np.degrees(np.linalg.norm(self.joints, axis=1))

    @property
    def joint_largest(self):
        return np.degrees(np.abs(self.joints).max(axis=1))

    def rms(self, values, start, end=np.inf):
        chosen = values[(self.t >= start) & (self.t < end)]
        return math.sqrt(np.mean(chosen**2))

    def settling(self, values, bound=0.2):
        """First time [s] from which ``values`` [deg] stay below ``bound``."""
        outside = np.flatnonzero(values >= bound)
        return self.t[outside[-1] + 1]

    @property
    def roll(self):
        return np.degrees(self.attitude[:, 0])

    @property
    def overshoot(self):
        """Of roll after a positive step [deg]."""
        return max(0.0, -self.roll.min())


def initial_state(theta=THETA_0, robot=ROBOT):
    """At rest, attitude identity, the system's centre of mass at the inertial origin."""
    n = robot.joints
    state = np.zeros(state_size(n))
    rotation, composite = np.zeros((n, 3, 3)), np.zeros((n + 1, 10))
    joint_rotations(robot.fixed_rotation, robot.axis, theta, rotation)
    composite_parameters(robot.parent, rotation, robot.offset, robot.pi, composite)
    state[:3] = -composite[0, 6:9] / composite[0, 9]
    state[6] = 1.0
    state[13 : 13 + n] = theta
    return state


def run(
    trajectory=STEP, duration=20.0, prior=None, estimator=NONE, first_row=0, g_diagonal=None, gamma=None,
    natural_gain=3.0, bandwidth=2.0, forgetting=1.0, form=0, option=0, gain=1.0, damping=K_D0, limit=np.inf,
    period=0.02, step_size=0.01, acceleration_source=IDEAL, noise=None, pi_true=None, keep_regressors=False,
    robot=ROBOT,
):  # fmt: skip
    n = robot.joints
    p = 10 * (n + 1)
    steps = int(round(duration / period))
    pi_hat = np.array(robot.pi if prior is None else prior)
    pi_true = robot.pi if pi_true is None else pi_true
    state = initial_state(robot=robot)
    noise = np.zeros((steps, 9 + 3 * n)) if noise is None else noise
    g_diagonal = np.ones(p) if g_diagonal is None else g_diagonal
    gamma = np.zeros(p) if gamma is None else gamma
    histories = [np.zeros((steps, 3)), np.zeros((steps, n)), np.zeros((steps, 3 + n)), np.zeros(steps)]
    histories += [np.zeros((steps, 4)), np.zeros((steps if keep_regressors else 0, 6 + n, p))]
    tree = (robot.parent, robot.fixed_rotation, robot.offset, robot.axis)
    status = loop(
        tree, pi_true, pi_hat, state, trajectory, estimator, first_row, acceleration_source, form, option,
        np.full(3 + n, float(gain)), damping, np.broadcast_to(np.asarray(limit, float), 3 + n).copy(), period,
        max(1, int(round(period / step_size))), gamma, natural_gain, bandwidth, forgetting, np.diag(g_diagonal),
        g_diagonal, noise, *histories, np.zeros(work_size(n)), np.zeros((rls.work_rows(6 + n, p), p)),
    )  # fmt: skip
    assert control_work_size(n) <= 32 * n + 128
    return Run(period, *histories, pi_hat, state, status)
