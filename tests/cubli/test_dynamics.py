"""Plants and wheels: the equations in NumPy, SciPy's integrator, conserved quantities, eigenvalues at balance."""

import math

import numpy as np
import pytest
import scipy.integrate
from scipy.spatial.transform import Rotation

from cubli_ros.attitude import level_gravity
from flight_math import Quaternion, Vec3, kernel, same
from sim_nodes.cubli import dynamics, reaction_wheels
from sim_nodes.cubli.physical_plant import PhysicalPlantParameters
from sim_nodes.cubli.plant import CubliPlantParameters
from tests.cubli.records import made

MASS, LENGTH, WHEEL = 2.0, 0.2, 1.0e-3  # [kg], [m], [kg m^2]
I0 = MASS * LENGTH**2 / 6.0
THETA = MASS * LENGTH**2 * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))
ARM = np.full(3, 0.5 * LENGTH)


def paper_right_hand_side(t, y, u, amplitude, frequency, phase, gravity, sign):
    a = Rotation.from_euler("XYZ", y[:3]).as_matrix().T
    _, theta, psi = y[:3]
    g = np.array(
        [
            [math.cos(psi) / math.cos(theta), -math.sin(psi) / math.cos(theta), 0.0],
            [math.sin(psi), math.cos(psi), 0.0],
            [-math.cos(psi) * math.tan(theta), math.sin(psi) * math.tan(theta), 1.0],
        ]
    )
    torque = np.cross(sign * ARM, a @ (MASS * gravity)) + u
    return np.concatenate([g @ y[3:], torque / I0 + amplitude * np.sin(frequency * t + phase)])


def physical_right_hand_side(t, y, u, amplitude, frequency, phase, gravity):
    rotation = Rotation.from_quat(y[:4])
    omega, speed = y[4:7], y[7:]
    torque = np.cross(ARM, rotation.inv().apply(MASS * gravity)) + u + amplitude * np.sin(frequency * t + phase)
    omega_dot = np.linalg.solve(THETA - WHEEL * np.eye(3), torque - np.cross(omega, THETA @ omega + WHEEL * speed))
    x, y_, z, w = y[:4]
    q_dot = 0.5 * np.array([[w, -z, y_], [z, w, -x], [-y_, x, w], [-x, -y_, -z]]) @ omega
    return np.concatenate([q_dot, omega_dot, -u / WHEEL - omega_dot])


@kernel
def steps(held, t, period, number, motion):
    """The paper's plant over a period in a number of steps."""
    begin, h = dynamics.disturbance(held[0], t), period / number
    for k in range(number):
        motion, begin = dynamics.paper_step(held, begin, t + k * h, h, motion)
    return motion


@kernel
def standing_steps(held, t, period, number, motion):
    """The physical plant over a period in a number of steps."""
    h = period / number
    for k in range(number):
        motion = dynamics.standing_step(held, t + k * h, h, motion)
    return motion


def paper(state, t, period, number, u=(0.0, 0.0, 0.0), gravity=None, **values):
    """`steps` on arrays; gravity: level unless given."""
    p = made(CubliPlantParameters, **{"disturbance_amplitude": 0.0, **values})
    held = (p, level_gravity(p) if gravity is None else Vec3(*gravity), Vec3(*u))
    return np.concatenate(steps(held, t, period, number, (Vec3(*state[:3]), Vec3(*state[3:]))))


def physical(state, t, period, number, u=(0.0, 0.0, 0.0), gravity=(0.0, 0.0, 0.0), **values):
    """`standing_steps` on arrays."""
    p = made(PhysicalPlantParameters, **{"disturbance_amplitude": 0.0, **values})
    motion = (Quaternion(*state[:4]), Vec3(*state[4:7]), Vec3(*state[7:]))
    return np.concatenate(standing_steps((p, Vec3(*gravity), Vec3(*u)), t, period, number, motion))


def test_inertias():
    p = made(PhysicalPlantParameters)
    assert dynamics.centre_inertia(p) == I0
    centre = I0 * np.eye(3)  # a solid cube about its centre; parallel axes to the corner
    theta = centre + MASS * (ARM @ ARM * np.eye(3) - np.outer(ARM, ARM))
    vector = np.array([0.3, -0.7, 1.1])
    np.testing.assert_allclose(dynamics.corner_momentum(p, Vec3(*vector)), theta @ vector, rtol=1e-14)
    expected = np.linalg.solve(theta - WHEEL * np.eye(3), vector)
    np.testing.assert_allclose(dynamics.standing_acceleration(p, Vec3(*vector)), expected, rtol=1e-13)


@pytest.mark.parametrize("phase", [(0.0, 0.0, 0.0), (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_paper_step(sign, phase):
    u = np.array([1e-3, -2e-3, 5e-4])
    amplitude, shift = np.array([0.02, 0.02, 0.03]), np.array(phase)
    gravity = np.array([-0.3, -0.2, -0.4])
    state = np.array([-0.3, 0.3, 0.3, 0.1, -0.2, 0.05])
    reference = scipy.integrate.solve_ivp(
        paper_right_hand_side, (0.7, 1.2), state, "DOP853", rtol=1e-12, atol=1e-13,
        args=(u, amplitude, 2.0, shift, gravity, sign),
    )  # fmt: skip
    state = paper(state, 0.7, 0.5, 500, u, gravity, gravity_sign=int(sign), disturbance_amplitude=amplitude,
                  disturbance_frequency=2.0, disturbance_phase=shift)
    np.testing.assert_allclose(state, reference.y[:, -1], atol=1e-10)


def test_physical_step_on_tilted_ground():
    u = np.array([1e-2, -2e-2, 5e-3])
    amplitude, phase = np.array([1e-3, 2e-3, 0.0]), np.array([0.1, 0.0, 2.0])
    gravity = np.array([-1.0, -2.0, -4.0])
    q = Rotation.from_euler("XYZ", [-0.3, 0.3, 0.3]).as_quat()
    state = np.concatenate([q, [0.5, -0.4, 0.2], [30.0, -10.0, 5.0]])
    reference = scipy.integrate.solve_ivp(
        physical_right_hand_side, (0.3, 0.8), state, "DOP853", rtol=1e-12, atol=1e-13,
        args=(u, amplitude, 3.0, phase, gravity),
    )  # fmt: skip
    state = physical(state, 0.3, 0.5, 500, u, gravity, disturbance_amplitude=amplitude / I0, disturbance_frequency=3.0,
                     disturbance_phase=phase)
    np.testing.assert_allclose(state, reference.y[:, -1], atol=1e-9)


def test_fourth_order():
    ends = [paper([-0.3, 0.3, 0.3, 0.0, 0.0, 0.0], 0.0, 0.2, number, gravity=same(-9.8 / math.sqrt(3.0)))
            for number in (10, 20, 40, 2000)]
    errors = [np.abs(end - ends[-1]).max() for end in ends[:3]]
    assert 3.7 < math.log2(errors[0] / errors[1]) < 4.5
    assert 3.7 < math.log2(errors[1] / errors[2]) < 4.5


def test_paper_energy():
    """No torque: I0 |omega|^2 / 2 + s m (-gravity) . A^T r keeps its value."""
    gravity = np.full(3, -0.002 / math.sqrt(3.0))
    for sign in (1.0, -1.0):
        state = np.array([-0.3, 0.3, 0.3, 0.02, -0.01, 0.03])

        def energy(y, sign=sign):
            height = Rotation.from_euler("XYZ", y[:3]).apply(sign * ARM) @ -gravity
            return 0.5 * I0 * y[3:] @ y[3:] + MASS * height

        before = energy(state)
        state = paper(state, 0.0, 10.0, 10_000, gravity=gravity, gravity_sign=int(sign))
        assert math.isclose(energy(state), before, rel_tol=1e-10)


def test_physical_energy_and_momentum():
    """Free wheels: energy in gravity; without gravity the angular momentum in the balance frame, torque or not."""
    def momentum(y):
        return Rotation.from_quat(y[:4]).apply(THETA @ y[4:7] + WHEEL * y[7:])

    def energy(y, gravity):
        body = 0.5 * y[4:7] @ (THETA - WHEEL * np.eye(3)) @ y[4:7]
        wheels = 0.5 * WHEEL * ((y[7:] + y[4:7]) @ (y[7:] + y[4:7]))
        return body + wheels - MASS * Rotation.from_quat(y[:4]).apply(ARM) @ gravity

    q = Rotation.from_euler("XYZ", [-0.3, 0.3, 0.3]).as_quat()
    start = np.concatenate([q, [0.5, -0.4, 0.2], [30.0, -10.0, 5.0]])
    gravity = np.array([-1.0, -2.0, -4.0])
    state = physical(start, 0.0, 2.0, 4000, gravity=gravity)
    assert math.isclose(energy(state, gravity), energy(start, gravity), rel_tol=1e-10)
    state = physical(start, 0.0, 2.0, 4000, (1e-2, -2e-2, 5e-3))
    np.testing.assert_allclose(momentum(state), momentum(start), atol=1e-11)


@pytest.mark.parametrize(
    ("g", "paper", "physical"), [(9.8, 15.95655, 6.8508), (0.002, 0.2279507, 0.097868)], ids=["Earth", "asteroid"]
)
def test_eigenvalues_at_the_balance_point(g, paper, physical):
    """+-sqrt(s 3 sqrt(3) g / l), each twice, and a double zero; the same with the corner inertia and wheels."""
    gravity = same(-g / math.sqrt(3.0))

    def jacobian(function, point):
        columns = []
        for i in range(len(point)):
            ends = []
            for step in (1e-6, -1e-6):
                moved = point.copy()
                moved[i] += step
                ends.append(function(moved))
            columns.append((ends[0] - ends[1]) / 2e-6)
        return np.array(columns).T

    for sign in (1.0, -1.0):
        held = (made(CubliPlantParameters, gravity_sign=int(sign)), gravity, same(0.0))
        matrix = jacobian(lambda y, held=held: np.concatenate(
            dynamics.paper_rates(held, same(0.0), (Vec3(*y[:3]), Vec3(*y[3:])))), np.zeros(6))
        values = np.linalg.eigvals(matrix)
        parts = np.sort(values.real if sign > 0 else values.imag)
        np.testing.assert_allclose(parts[[0, 1, 4, 5]], paper * np.array([-1, -1, 1, 1]), rtol=1e-5)
        np.testing.assert_allclose(parts[2:4], 0.0, atol=1e-4 * paper)

    balance = np.zeros(10)
    balance[3] = 1.0
    held = (made(PhysicalPlantParameters), gravity, same(0.0))
    matrix = jacobian(lambda y: np.concatenate(dynamics.standing_rates(
        held, same(0.0), (Quaternion(*y[:4]), Vec3(*y[4:7]), Vec3(*y[7:])))), balance)
    matrix = matrix[np.ix_([0, 1, 2, 4, 5, 6], [0, 1, 2, 4, 5, 6])]  # attitude and rate; the wheels only follow
    values = np.sort(np.linalg.eigvals(matrix).real)
    np.testing.assert_allclose(values[[0, 1, 4, 5]], physical * np.array([-1, -1, 1, 1]), rtol=2e-5)


def test_wheel_torque_limit_and_saturation():
    period = 0.01  # [s]
    p = made(CubliPlantParameters, period, torque_limit=0.02, speed_limit=628.0)
    out = reaction_wheels.deliverable_torque(p, Vec3(0.5, -0.5, 0.01), same(0.0))
    np.testing.assert_array_equal(out, [0.02, -0.02, 0.01])

    # The first wheel is at its top speed: u < 0 would spin it up, u > 0 slows it down; the second is just below
    speed = Vec3(628.0, 627.95, -628.0)
    out = reaction_wheels.deliverable_torque(p, same(-0.01), speed)
    np.testing.assert_allclose(out, [0.0, -WHEEL * 0.05 / period, -0.01], atol=1e-12)
    np.testing.assert_allclose(reaction_wheels.spun(p, speed, out, same(0.0)), [628.0, 628.0, -627.9], rtol=1e-12)


def test_wheels_take_the_momentum_that_the_body_gets():
    before, u, change = Vec3(1.0, 2.0, 3.0), Vec3(1e-3, -2e-3, 0.0), Vec3(0.1, 0.0, -0.2)
    speed = reaction_wheels.spun(made(CubliPlantParameters, 0.1), before, u, change)
    np.testing.assert_allclose(WHEEL * (speed + change - before), -u * 0.1, atol=1e-18)
