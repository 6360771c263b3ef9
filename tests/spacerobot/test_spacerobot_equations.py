"""What judges the paper's equations is judged itself: point masses, Pinocchio, reference numbers, closed forms."""

import numpy as np
import pytest
from scipy.linalg import expm

from papers.spacerobot import equations_estimation, operations
from papers.spacerobot.equations_coordinates import coupling, shipped_arm
from papers.spacerobot.inertial_frame import (
    Arm,
    Motion,
    cross_matrix,
    floating,
    joint_wrenches,
    random_arm,
    random_motion,
    torques,
    total,
    turn,
)
from papers.spacerobot.lagrangian import coriolis_matrix, generalised, mass_matrix, motion_of, reduced_mass_matrix
from spacerobot_ros.robot_files import find_model
from tests.spacerobot.spacerobot_cases import PinocchioTwin, Signals, inverse

TEN, SEVEN, JOINT_ROWS = slice(None), slice(3, None), slice(6, None)


def at(theta, w, al, thd, thdd) -> Motion:
    return Motion(np.eye(3), w, al, np.zeros(3), np.zeros(3), theta, thd, thdd)


THETA_0 = np.radians([90.0, 45.0, 45.0, 0.0])
RATES = np.array([0.1, -0.2, 0.3]), np.array([0.4, -0.3, 0.2, -0.1])


def test_forces_and_moments_are_those_of_point_masses():
    """Bodies of six masses each; accelerations by differences of positions, moments by r x m a."""
    draw = np.random.default_rng(3)
    weights, places = draw.uniform(0.2, 1.0, (4, 6)), 0.3 * draw.standard_normal((4, 6, 3))
    mass = weights.sum(axis=1)
    center = (weights[:, :, None] * places).sum(axis=1) / mass[:, None]
    inertia = np.array([sum(m * ((p - c) @ (p - c) * np.eye(3) - np.outer(p - c, p - c)) for m, p in zip(ms, ps))
                        for ms, ps, c in zip(weights, places, center)])
    arm = Arm(*draw.uniform(-1.0, 1.0, (3, 3)), mass, center, inertia)
    motion = random_motion(draw, 3)

    def frames(t):
        rotation = motion.rotation @ expm(cross_matrix(motion.w * t + 0.5 * motion.al * t * t))
        origin = motion.v * t + 0.5 * motion.a * t * t
        found = [(rotation, origin)]
        for i in range(3):
            angle = motion.theta[i] + motion.thd[i] * t + 0.5 * motion.thdd[i] * t * t
            lift = np.array([arm.a[i], -np.sin(arm.alpha[i]) * arm.d[i], np.cos(arm.alpha[i]) * arm.d[i]])
            origin = origin + rotation @ lift
            rotation = rotation @ turn(0, arm.alpha[i]) @ turn(2, angle)
            found.append((rotation, origin))
        return found

    def positions(t):
        return np.array([[origin + rotation @ p for p in ps] for (rotation, origin), ps in zip(frames(t), places)])
    h = 1e-3
    second = (-positions(2 * h) + 16 * positions(h) - 30 * positions(0.0) + 16 * positions(-h) - positions(-2 * h)) / (
        12 * h * h)
    force, moment = joint_wrenches(arm.pi, arm, motion)
    now = positions(0.0)
    for k, (rotation, origin) in enumerate(frames(0.0)):
        pull = weights[k:, :, None] * second[k:]
        assert force[k] == pytest.approx(rotation.T @ pull.sum(axis=(0, 1)), abs=1e-7)
        assert moment[k] == pytest.approx(rotation.T @ np.cross(now[k:] - origin, pull).sum(axis=(0, 1)), abs=1e-7)


def test_numbers_of_an_independent_program():
    """Mass matrix and inverse dynamics of the shipped robot, by a program that agrees with SPART and Pinocchio."""
    arm = shipped_arm()
    q = np.concatenate([np.zeros(6), THETA_0])
    order = [2, 1, 0, 3, 4, 5, 6]  # roll, pitch, yaw, joints
    reduced = reduced_mass_matrix(arm, q)[np.ix_(order, order)]
    assert np.diag(reduced) == pytest.approx([3.739603273, 3.483605090, 1.221861165, 0.363191106, 1.537135098,
                                              0.425652568, 0.049130157], abs=1e-8)
    assert [reduced[0, 4], reduced[0, 5], reduced[1, 3], reduced[4, 5]] == pytest.approx(
        [2.018956372, 0.922000150, -0.838451013, 0.700639363], abs=1e-8)
    accelerations = np.array([0.01, 0.02, -0.03]), np.array([0.05, -0.06, 0.07, -0.08])
    motion = floating(arm, at(THETA_0, RATES[0], accelerations[0], RATES[1], accelerations[1]))
    assert torques(arm.pi, arm, motion)[3:] == pytest.approx(
        [0.495376277, -0.266884874, 0.016741225, 0.113363556, 0.287376822, 0.205686623, -0.026005557], abs=1e-8)


def test_pinocchio_agrees():
    pin = pytest.importorskip("pinocchio", reason="Pinocchio, the reference of this test, is not here: make develop")
    robot, arm, draw = find_model("mini_space_robot"), shipped_arm(), np.random.default_rng(8)
    twin = PinocchioTwin(pin, robot)
    for _ in range(20):
        s = Signals(draw, robot)
        expected = pin.rnea(twin.model, twin.data, *twin.state(s))[twin.rows]
        assert torques(arm.pi, arm, Motion(np.eye(3), s.w, s.al, s.v, s.a, s.theta, s.thd, s.thdd)) == pytest.approx(
            expected, rel=1e-11, abs=1e-11)


def test_the_code_that_flies_agrees():
    draw, arm, robot = np.random.default_rng(4), shipped_arm(), find_model("mini_space_robot")
    for _ in range(5):
        motion = random_motion(draw)
        expected = torques(arm.pi, arm, motion)
        a = motion.rotation.T @ motion.a
        got = inverse(robot, motion.theta, motion.w, motion.w, motion.al, a, motion.thd, motion.thd, motion.thdd)
        assert got == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_lagrange_and_the_rates_of_momentum_agree():
    draw = np.random.default_rng(5)
    arm, (q, rate, second) = random_arm(draw), draw.standard_normal((3, 10))

    def matrix(point):
        return mass_matrix(arm, point)
    velocity = coriolis_matrix(matrix, q, rate) @ rate
    force = generalised(q, torques(arm.pi, arm, motion_of(q, rate, second)))
    assert matrix(q) @ second + velocity == pytest.approx(force, abs=1e-11)


@pytest.mark.parametrize(("rows", "expected"), [(TEN, 38), (SEVEN, 37), (JOINT_ROWS, 28)])
def test_parameters_that_random_motions_show(rows, expected):
    """10 + 4 x 7: each revolute joint merges three of a body's ten; seven rows lose the base's mass."""
    assert equations_estimation.rank(4, rows) == expected


def test_regressor_times_parameters_is_the_torque():
    draw = np.random.default_rng(6)
    arm = random_arm(draw)
    motion = random_motion(draw)
    assert equations_estimation.regressor(arm, motion) @ arm.pi.ravel() == pytest.approx(
        torques(arm.pi, arm, motion), abs=1e-11)


@pytest.mark.parametrize(("inertia", "possible"), [
    ((1.0, 1.0, 1.9), True), ((1.0, 1.0, 2.1), False), ((1.0, 1.0, -0.1), False)])
def test_bodies_that_can_exist(inertia, possible):
    """Two equal moments allow a third up to their sum (a flat disc)."""
    xx, yy, zz = inertia
    assert equations_estimation.is_possible(np.array([xx, 0, 0, yy, 0, zz, 0, 0, 0, 2.0])) is possible


def test_counted_updates_are_updates():
    draw = np.random.default_rng(7)
    y, pi, tau = draw.standard_normal((3, 6)), draw.standard_normal(6), draw.standard_normal(3)
    g = np.diag(draw.uniform(1.0, 2.0, 6))
    gain = g @ y.T @ np.linalg.inv(y @ g @ y.T + np.eye(3))
    new, left, _ = operations.least_squares_update(y, tau, pi, g)
    assert new == pytest.approx(pi + gain @ (tau - y @ pi)) and left == pytest.approx(g - gain @ y @ g)
    moved, _ = operations.lyapunov_update(y, tau, g, pi, period=0.5)
    assert moved == pytest.approx(pi + 0.5 * g @ y.T @ tau)
    assert operations.lyapunov_update(y, tau, g, pi, 0.5, inverse_kept=False)[0] == pytest.approx(
        pi + 0.5 * np.linalg.solve(g, y.T @ tau))


@pytest.mark.parametrize(("r", "p"), [(7, 50), (2, 5)])
def test_operations_are_those_of_the_formulas(r, p):
    """Product (m, n)(n, k): m n k multiplications, m (n - 1) k additions; inverse (r, r) on 2 r columns."""
    least, lyapunov = operations.tallies(r, p)
    products = [(p, p, r), (r, p, r), (p, r, r), (r, p, 1), (p, r, 1), (p, r, p), (p, p, p)]
    eliminated = 2 * r * r * (r - 1)
    sums = r * r + r + p + p * p  # + E, tau - Y pi, pi + ..., E - K Y
    assert least["*"] == sum(m * n * k for m, n, k in products) + eliminated
    assert least["+"] == sum(m * (n - 1) * k for m, n, k in products) + eliminated + sums
    assert least["/"] == 2 * r * r
    assert lyapunov == {"*": p * r + p * p + p, "+": p * (r - 1) + p * (p - 1) + p, "/": 0}


def test_a_joint_turns_the_base_as_angular_momentum_says():
    """Posture of section 4.1: the base's rates that leave no angular momentum while a joint turns."""
    arm, still = shipped_arm(), np.zeros(4)
    whole = np.array([total(arm, floating(arm, at(THETA_0, axis, np.zeros(3), still, still))).angular for axis in np.eye(3)])
    found = []
    for joint in np.eye(4):
        momentum = total(arm, floating(arm, at(THETA_0, np.zeros(3), np.zeros(3), joint, still))).angular
        found.append(np.abs(np.linalg.solve(whole.T, momentum)).max())
    _, text = coupling()
    assert text.endswith(", ".join(f"{one:.3f}" for one in found))


def test_velocity_terms_are_quadratic_and_the_mass_matrix_has_the_euler_angles_singularity():
    """Twice the rates, four times the terms: a linear form is off by a half; det M has cos(beta)^2 as a factor."""
    from papers.spacerobot import equations_coordinates
    assert "difference 5.0e-01" in equations_coordinates.matrix_of_theta()[1]
    draw = np.random.default_rng(1)
    arm, q = random_arm(draw, 4), np.concatenate([np.zeros(3), draw.uniform(-1.0, 1.0, 7)])
    still, turned = q.copy(), q.copy()
    still[4], turned[4] = 0.0, np.radians(80.0)
    ratio = np.linalg.det(reduced_mass_matrix(arm, turned)) / np.linalg.det(reduced_mass_matrix(arm, still))
    assert ratio == pytest.approx(np.cos(turned[4]) ** 2, rel=1e-9)
    assert [held for held, _ in equations_coordinates.energy_is_positive().values()] == [True, False]


def test_a_half_turn_has_two_quaternions_and_neither_has_a_positive_scalar():
    from papers.spacerobot import equations_attitude
    found = equations_attitude.unique_quaternion()
    assert [held for held, _ in found.values()] == [True, False] and "0 with q0 > 0" in found["a turn of 180 deg"][1]


def test_the_moment_about_the_centre_of_mass_is_not_linear():
    """Two point masses on one line: about the origin inertias add, m c^2 of the sum does not."""
    from papers.spacerobot import equations_appendix
    assert equations_appendix.nonlinear()[0] and not equations_appendix.nonlinear(about_origin=True)[0]
