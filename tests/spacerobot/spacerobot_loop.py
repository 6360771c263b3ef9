"""The space robot's closed loop as one compiled function: truth, law and estimator at one control period.

At t_k: the least-squares update uses u_{k-1}, the state at t_k and the accelerations at t_k under u_{k-1}; then the
control law uses the new estimate; the Lyapunov update follows with the law's own regressor; u_k is held for a period.
"""

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flight_math import Quaternion, Vec3, conjugate, kernel, largest, norm, rotation_vector, stack_array, vec3
from flight_math.dense import copy
from sim_nodes.spacerobot.dynamics import forward_dynamics, momentum_and_energy, robot_state, state_size, step
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.adaptive_law import (
    PREDICTED,
    Present,
    control_torque,
    predicted_acceleration,
    reference_motion,
    with_acceleration,
)
from spacerobot_ros.dynamics import composite_parameters, inverse_dynamics
from spacerobot_ros.filtered_regressor import READY, Rows, filter_step, momentum_regressor
from spacerobot_ros.kinematics import actual_motion, posed
from spacerobot_ros.lyapunov_law import lyapunov_update
from spacerobot_ros.natural_adaptation import natural_update
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_files import find_model
from spacerobot_ros.trajectory import harmonic_reference

MODEL = Path(str(resources.files("spacerobot_ros"))) / "models" / "mini_space_robot.yaml"
ROBOT = find_model("mini_space_robot")
K_D0 = np.array([8.0, 8.0, 4.0, 1.5, 4.0, 1.5, 0.3])  # [N m s/rad]
THETA_0 = np.radians([90.0, 45.0, 45.0, 0.0])
NONE, RLS, LYAPUNOV, NATURAL, FILTERED = range(5)
IDEAL, DIFFERENCED = range(2)
ZERO = Vec3(0.0, 0.0, 0.0)


class Trajectory(NamedTuple):
    """Channels: roll, pitch, yaw, theta_1..4."""

    target: np.ndarray
    amplitude: np.ndarray
    cycle: np.ndarray
    phase: np.ndarray


STEP = Trajectory(np.radians([10.0, 0, 0, 90, 55, 55, 10]), np.zeros(7), np.ones(7), np.zeros(7))
HARMONIC = Trajectory(
    np.radians([0.0, 0, 0, 90, 45, 45, 0]),
    np.radians([10.0, 0, 0, 0, 20, 20, 25]),
    np.array([20.0, 20, 20, 16, 16, 12, 10]),
    np.zeros(7),
)


class Sampling(NamedTuple):
    """What `filter_step` reads of its parameters."""

    bandwidth: float
    period: float


class Parameters(NamedTuple):
    """Everything that the kernels read of their components' parameters, and what this loop needs besides."""

    parent: np.ndarray
    fixed_rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray
    target: np.ndarray
    amplitude: np.ndarray
    cycle: np.ndarray
    phase: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    stop_stiffness: float
    stop_damping: float
    form: int
    base_acceleration: int
    gain: np.ndarray
    damping: np.ndarray
    damping_scale: float
    torque_limit: np.ndarray
    period: float
    substeps: int
    estimator: int
    first_row: int
    acceleration_source: int
    g_diagonal: np.ndarray
    gamma: np.ndarray
    natural_gain: float
    bandwidth: float
    forgetting: float


class Reference(NamedTuple):
    """The desired motion, as the topic `reference` has it."""

    attitude: Quaternion
    rates: Vec3
    angular_acceleration: Vec3
    joints: np.ndarray
    joint_rates: np.ndarray
    joint_accelerations: np.ndarray


class Memory(NamedTuple):
    """What lives from one sample to the next; the filter's part has the names of an estimator's state."""

    state: np.ndarray
    u: np.ndarray
    w_before: np.ndarray
    thd_before: np.ndarray
    g: np.ndarray
    memory: np.ndarray
    filtered_torque: np.ndarray
    filtered: np.ndarray


class Sample(NamedTuple):
    """Measured motion and torques (6+n,)."""

    w: Vec3
    al: Vec3
    a: Vec3
    theta: np.ndarray
    thd: np.ndarray
    thdd: np.ndarray
    torques: np.ndarray


class Histories(NamedTuple):
    """One row a sample: ``attitude`` (3) [rad], ``joints`` (n) [rad], ``torque`` (3+n), ``prediction`` (), ``balance``
    (|p|, |L - impulse|, T - work, T), ``regressors`` (6+n, p) of the actual motion if it has rows."""

    attitude: np.ndarray
    joints: np.ndarray
    torque: np.ndarray
    prediction: np.ndarray
    balance: np.ndarray
    regressors: np.ndarray


@kernel
def measure(p, x, acceleration, noise, first, sample):
    """The sample with its angular acceleration, as it is or by the difference from the sample before; fills its arrays.

    ``noise``: of w, thd, theta, a, torques."""
    n, s = len(p.parent), robot_state(x.state)
    w = s.rates + vec3(noise[0:3])
    al = vec3(acceleration[3:6])
    if p.acceleration_source == DIFFERENCED:
        al = ZERO if first else (w - vec3(x.w_before)) / p.period
    x.w_before[:] = w
    for i in range(n):
        sample.thd[i] = s.joint_rates[i] + noise[3 + i]
        sample.theta[i] = s.joints[i] + noise[3 + n + i]
        sample.thdd[i] = acceleration[6 + i]
        if p.acceleration_source == DIFFERENCED:
            sample.thdd[i] = 0.0 if first else (sample.thd[i] - x.thd_before[i]) / p.period
        x.thd_before[i] = sample.thd[i]
    for i in range(3 + n):
        sample.torques[3 + i] = x.u[i] + noise[6 + 2 * n + i]
    return Sample(w, al, vec3(acceleration[0:3]) + vec3(noise[3 + 2 * n:6 + 2 * n]), sample.theta, sample.thd, sample.thdd,
                  sample.torques)


@kernel
def judge(p, x, pi_true, pi_hat, acceleration, out, k):
    """Histories of what only the truth can tell."""
    n, s = len(p.parent), robot_state(x.state)
    wrench, difference = stack_array(6 + n), stack_array(len(pi_true))
    for c in range(len(pi_true)):
        difference[c] = pi_hat[c] - pi_true[c]
    tree = posed(p, s.joints, stack_array(n, 3, 3))
    motion = actual_motion(s.rates, vec3(acceleration[3:6]), vec3(acceleration[0:3]), s.joint_rates, acceleration[6:])
    inverse_dynamics(tree, difference, motion, wrench)
    total = 0.0
    for r in range(3, 6 + n):
        total += wrench[r] * wrench[r]
    out.prediction[k] = math.sqrt(total)
    if k < len(out.regressors):
        regressor(tree, motion, out.regressors[k])
    linear, angular, energy = momentum_and_energy(p, pi_true, x.state)
    out.balance[k, 0], out.balance[k, 1] = norm(linear), largest(abs(angular - s.impulse))
    out.balance[k, 2], out.balance[k, 3] = energy - s.work, energy


@kernel
def identify(p, x, sample, tree, phase, pi_hat):
    """Least squares on the measured motion, or on the filtered one. Returns the filter's phase and the update's status."""
    n, count = len(p.parent), len(pi_hat)
    y = stack_array(6 + n, count)
    rows = Rows(stack_array(3 + n, count), stack_array(3 + n, count), stack_array(3 + n, count))
    status = rls.UPDATED
    if p.estimator == RLS:
        regressor(tree, actual_motion(sample.w, sample.al, sample.a, sample.thd, sample.thdd), y)
        status = rls.update(y[p.first_row:], sample.torques[p.first_row:], p.forgetting, pi_hat, x.g, p.g_diagonal)
    if p.estimator == FILTERED:
        momentum_regressor(tree, sample.w, sample.thd, sample.a, rows)
        phase = filter_step(p, x, phase, rows, sample.torques[3:])
        if phase == READY:
            status = rls.update(x.filtered, x.filtered_torque, p.forgetting, pi_hat, x.g, p.g_diagonal)
    return phase, status


@kernel
def act(p, x, sample, tree, reference, pi_hat):
    """The control law into x.u, and the laws of adaptation that follow it."""
    n = len(p.parent)
    sigma, signals, y = stack_array(3 + n), stack_array(3, n), stack_array(6 + n, len(pi_hat))
    present = Present(robot_state(x.state).attitude, sample.w, sample.theta, sample.thd)
    motion = reference_motion(p, present, reference, sigma, signals)
    a_r = predicted_acceleration(tree, pi_hat, motion) if p.base_acceleration == PREDICTED else sample.a
    motion = with_acceleration(motion, a_r)
    control_torque(p, tree, pi_hat, motion, sigma, x.u)
    if p.estimator == LYAPUNOV or p.estimator == NATURAL:
        regressor(tree, motion, y)
        if p.estimator == LYAPUNOV:
            lyapunov_update(y[3:], sigma, p.gamma, p.period, pi_hat)
        else:
            natural_update(y[3:], sigma, p.natural_gain, p.period, 2.0, pi_hat)


@kernel
def loop(p, pi_true, pi_hat, x, noise, out):
    """Fill the histories; returns the union of the least squares' codes."""
    n = len(p.parent)
    wrench, acceleration, joints = stack_array(6 + n), stack_array(6 + n), stack_array(3, n)
    rotation = stack_array(n, 3, 3)
    empty = Sample(ZERO, ZERO, ZERO, stack_array(n), stack_array(n), stack_array(n), stack_array(6 + n))
    status, phase = 0, 0
    for k in range(len(out.attitude)):
        attitude, rates, angular_acceleration = harmonic_reference(p, k * p.period, joints)
        reference = Reference(attitude, rates, angular_acceleration, joints[0], joints[1], joints[2])
        s = robot_state(x.state)
        copy(x.u, wrench[3:])
        forward_dynamics(posed(p, s.joints, rotation), pi_true, s.rates, s.joint_rates, wrench, acceleration)
        sample = measure(p, x, acceleration, noise[k], k == 0, empty)
        tree = posed(p, sample.theta, rotation)
        if not (p.acceleration_source == DIFFERENCED and k == 0):
            phase, code = identify(p, x, sample, tree, phase, pi_hat)
            status |= code
        judge(p, x, pi_true, pi_hat, acceleration, out, k)
        out.attitude[k] = rotation_vector(conjugate(s.attitude) * reference.attitude)
        for i in range(n):
            out.joints[k, i] = joints[0, i] - s.joints[i]
        act(p, x, sample, tree, reference, pi_hat)
        copy(x.u, out.torque[k])
        copy(x.u, wrench[3:])
        for _ in range(p.substeps):
            step(p, pi_true, x.state, wrench, ZERO, p.period / p.substeps)
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
    state, composite = np.zeros(state_size(n)), np.zeros(10 * (n + 1))
    composite_parameters(posed(robot.geometry, theta, np.zeros((n, 3, 3))), robot.pi, composite)
    state[:3] = -composite[6:9] / composite[9]
    state[9] = 1.0
    state[13 : 13 + n] = theta
    return state


def run(
    trajectory=STEP, duration=20.0, prior=None, estimator=NONE, first_row=0, g_diagonal=None, gamma=None,
    natural_gain=3.0, bandwidth=2.0, forgetting=1.0, form=0, option=0, gain=1.0, damping=K_D0, limit=np.inf,
    period=0.02, step_size=0.01, acceleration_source=IDEAL, noise=None, pi_true=None, keep_regressors=False,
    robot=ROBOT,
):  # fmt: skip
    n = robot.joints
    count = 10 * (n + 1)
    steps = int(round(duration / period))
    pi_hat = np.array(robot.pi if prior is None else prior)
    g_diagonal = np.ones(count) if g_diagonal is None else g_diagonal
    p = Parameters(
        *robot.geometry, *trajectory, np.full(n, -np.inf), np.full(n, np.inf), 0.0, 0.0, form, option,
        np.full(3 + n, float(gain)), damping, 1.0, np.broadcast_to(np.asarray(limit, float), 3 + n).copy(), period,
        max(1, int(round(period / step_size))), estimator, first_row, acceleration_source, g_diagonal,
        np.zeros(count) if gamma is None else gamma, natural_gain, bandwidth, forgetting,
    )  # fmt: skip
    x = Memory(initial_state(robot=robot), np.zeros(3 + n), np.zeros(3), np.zeros(n), np.diag(g_diagonal),
               np.zeros((2, 3 + n, count)), np.zeros(3 + n), np.zeros((3 + n, count)))
    out = Histories(np.zeros((steps, 3)), np.zeros((steps, n)), np.zeros((steps, 3 + n)), np.zeros(steps),
                    np.zeros((steps, 4)), np.zeros((steps if keep_regressors else 0, 6 + n, count)))
    noise = np.zeros((steps, 9 + 3 * n)) if noise is None else noise
    status = loop(p, robot.pi if pi_true is None else pi_true, pi_hat, x, noise, out)
    return Run(period, *out, pi_hat, x.state, status)
