"""The plant against an inertial-frame integration by scipy, and against the twistor form of the same motion."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from flight_graph.kernel import kernel
from lander_ros.landing_law import landing_law
from lander_ros.twistor import from_pose, pose_from_twistor, switch_to_shadow, to_pose
from lander_ros.twistor_dynamics import twistor_state_rate
from sim_nodes.ellipsoid_gravity import ellipsoid_gravity
from sim_nodes.lander_dynamics import (
    STATES,
    advance,
    approach_attitude,
    body_velocity,
    hold_step,
    lander_plant,
    site_gravity,
    state_rate,
    touched_down,
)
from tests.lander.reference_landing import start_state


def inertial_motion(reference, state, force, torque, duration, mass_flow=0.0):
    """r^D, R_DB and rates after ``duration`` [s] by Newton and Euler in an inertial frame, with scipy's DOP853."""
    plant, body = reference.plant, reference.body
    spin = np.array([0.0, 0.0, plant.spin])
    r_ad = plant.site_rotation
    attitude = r_ad @ Rotation.from_quat(state[6:10]).as_matrix()  # A and the inertial axes coincide at t = 0
    position = plant.site_position + r_ad @ state[0:3]
    velocity = r_ad @ state[3:6] + np.cross(spin, position)
    rates = state[10:13] + attitude.T @ spin

    def derivative(t, y):
        to_a = Rotation.from_rotvec(-spin * t).as_matrix()
        matrix = y[6:15].reshape(3, 3)
        w = y[15:18]
        gravity = to_a.T @ np.array(ellipsoid_gravity(body, *(to_a @ y[0:3])))
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        angular = np.linalg.solve(plant.inertia, torque - np.cross(w, plant.inertia @ w))
        acceleration = gravity + matrix @ force / (state[13] - mass_flow * t)
        return np.concatenate([y[3:6], acceleration, (matrix @ skew).ravel(), angular])

    start = np.concatenate([position, velocity, attitude.ravel(), rates])
    end = solve_ivp(derivative, (0.0, duration), start, method="DOP853", rtol=1e-13, atol=1e-12).y[:, -1]
    to_a = Rotation.from_rotvec(-spin * duration).as_matrix()
    matrix = r_ad.T @ to_a @ end[6:15].reshape(3, 3)
    r = r_ad.T @ (to_a @ end[0:3] - plant.site_position)
    v = r_ad.T @ (to_a @ end[3:6] - np.cross(spin, to_a @ end[0:3]))
    return r, v, matrix, end[15:18] - matrix.T @ (r_ad.T @ spin)


@pytest.mark.parametrize("mass_flow", [0.0, 0.05])
def test_plant_against_the_inertial_frame(reference, mass_flow):
    state = reference.state.copy()
    state[10:13] = 0.02, -0.03, 0.05  # [rad/s]
    force, torque = np.array([5.0, -8.0, 12.0]), np.array([0.1, -0.2, 0.15])
    expected = inertial_motion(reference, state.copy(), force, torque, 40.0, mass_flow)
    matrix, work = np.zeros((3, 3)), np.zeros((3, STATES))
    for _ in range(400):
        hold_step(
            reference.body, reference.plant, state, force, torque, mass_flow, 0.1, matrix, work
        )
    r, v, attitude, rates = expected
    np.testing.assert_allclose(state[0:3], r, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(state[3:6], v, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(Rotation.from_quat(state[6:10]).as_matrix(), attitude, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(state[10:13], rates, rtol=0.0, atol=1e-10)
    assert state[13] == pytest.approx(500.0 - 40.0 * mass_flow, abs=1e-9)


def test_gravity_gradient_torque_is_the_central_fields(reference):
    """Against the torque of a dumb-bell: six masses with the inertia's principal moments in a point-mass field."""
    plant = reference.plant._replace(gravity_gradient_mu=reference.body.mu)
    state = start_state([0, 0, 0], [0, 0, 0], Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_quat(), [0, 0, 0])
    zero, matrix = np.zeros(3), np.zeros((3, 3))
    with_torque, without = np.zeros(STATES), np.zeros(STATES)
    state_rate(reference.body, plant, state, zero, zero, 0.0, matrix, with_torque)
    state_rate(reference.body, reference.plant, state, zero, zero, 0.0, matrix, without)
    torque = plant.inertia @ (with_torque - without)[10:13]
    moments, axes = np.linalg.eigh(plant.inertia)
    half = np.sqrt((0.5 * moments.sum() - moments) / 2.0)  # one unit mass at +- half on each principal axis
    centre = matrix.T @ (plant.site_rotation.T @ plant.site_position)
    total = np.zeros(3)
    for i in range(3):
        for sign in (1.0, -1.0):
            arm = sign * half[i] * axes[:, i]
            x = centre + arm
            total += np.cross(arm, -reference.body.mu * x / np.linalg.norm(x) ** 3)
    np.testing.assert_allclose(torque, total, rtol=1e-4, atol=1e-10)


@kernel
def twistor_flight(
    law_p, inverse, field, plant, twistor, dt, steps, held, plant_state, work, dual_work, vectors, matrix
):
    """Fly the law with (B, V) as the state: the law in every Runge-Kutta stage or held; counts shadow switches."""
    rate, total, stage = work[0], work[1], work[2]
    switches = 0
    for _ in range(steps):
        for i in range(16):
            stage[i] = twistor[i]
            total[i] = 0.0
        for k in range(4):
            pose_from_twistor(stage[0:8], plant_state[0:3], plant_state[6:10])
            site_gravity(field, plant, plant_state, vectors[2])
            if k == 0 or not held:
                landing_law(
                    law_p,
                    plant_state[0:3],
                    plant_state[6:10],
                    stage[12:15],
                    stage[8:11],
                    vectors[2],
                    matrix,
                    work[3, 0:6],
                    vectors[0],
                    vectors[1],
                )
            twistor_state_rate(law_p, inverse, vectors[2], stage, vectors[0], vectors[1], dual_work, rate)
            advance(twistor, rate, k, dt, total, stage)
        switches += switch_to_shadow(twistor[0:8], 1.0)
    return switches


def fly_as_twistor(reference, state, dt, duration, held):
    alpha = np.zeros(3)
    body_velocity(state, np.zeros((3, 3)), alpha)
    twistor = np.concatenate([from_pose(state[:3], state[6:10]), state[10:13], [0.0], alpha, [0.0]])
    switches = twistor_flight(
        reference.law,
        np.linalg.inv(reference.law.inertia),
        reference.body,
        reference.plant,
        twistor,
        dt,
        round(duration / dt),
        held,
        state.copy(),
        np.zeros((4, 16)),
        np.zeros((8, 8)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
    )
    return twistor, switches


def compare(twistor, state, metres):
    r, q = to_pose(twistor[:8])
    np.testing.assert_allclose(r, state[:3], rtol=0.0, atol=metres)
    assert (Rotation.from_quat(q) * Rotation.from_quat(state[6:10]).inv()).magnitude() < 1e-9
    np.testing.assert_allclose(twistor[8:11], state[10:13], rtol=0.0, atol=1e-10)


def test_twistor_integration_is_rigid_body_integration_over_a_minute(reference):
    _, end, _ = reference.fly_law(duration=60.0, dt=0.02)
    twistor, switches = fly_as_twistor(reference, reference.state, 0.02, 60.0, False)
    assert switches == 0
    compare(twistor, end, 1e-8)


def test_twistor_integration_across_a_shadow_switch(reference):
    """A craft that turns through 180 deg, with b as the state: the switch changes nothing."""
    q = approach_attitude(reference.r0, math.radians(179.5), math.radians(5.0), 0.3)
    state = start_state(reference.r0, [0.3, -0.2, 0.1], q, [0.5, -0.3, -8.0])
    b = from_pose(state[:3], q)
    if b[2] * state[12] < 0.0:
        state[12] = -state[12]
    _, end, _ = reference.fly_law(state=state, duration=60.0, dt=0.02, control_period=0.02)
    twistor, switches = fly_as_twistor(reference, state, 0.02, 60.0, True)
    assert switches >= 1
    compare(twistor, end, 1e-8)


def test_a_held_law_is_hold_steps(reference):
    """The reference descent at 1 Hz is ten steps of 0.1 s with the wrench of the law, byte for byte."""
    _, end, _ = reference.fly_law(duration=20.0, control_period=1.0)
    state, matrix, work = reference.state.copy(), np.zeros((3, 3)), np.zeros((3, STATES))
    for _ in range(20):
        at = reference.evaluate(state)
        for _ in range(10):
            hold_step(
                reference.body, reference.plant, state, at.force, at.torque, 0.0, 0.1, matrix, work
            )
    assert state.tobytes() == end.tobytes()


def test_contact_trigger_needs_height_and_nearness():
    state = start_state([1.0, 1.0, 0.09], [0, 0, 0], [0, 0, 0, 1], [0, 0, 0])
    assert touched_down(state, 0.1, 20.0)
    state[2] = 0.11
    assert not touched_down(state, 0.1, 20.0)
    state[:3] = 25.0, 0.0, 0.05
    assert not touched_down(state, 0.1, 20.0)


def test_bad_plants_and_starts_are_refused(reference):
    rotation, rho = reference.rotation, reference.rho
    with pytest.raises(ValueError, match="inertia"):
        lander_plant(np.diag([1.0, -1.0, 1.0]), rotation, rho, 0.0)
    with pytest.raises(ValueError, match="site_rotation"):
        lander_plant(np.eye(3), 2.0 * rotation, rho, 0.0)
    with pytest.raises(ValueError, match="least rotation"):
        approach_attitude([0.0, 0.0, -1.0], 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="multiple"):
        reference.fly_law(control_period=0.25)


def test_records_and_plain_python_give_the_same_bits(reference):
    """The kernels' plain source against their compiled form, bit for bit, over the nominal start."""
    program = (
        "import json\n"
        "from tests.lander.reference_landing import reference_landing\n"
        "site = reference_landing()\n"
        "_, end, history = site.fly_law(duration=3.0, dt=0.5, record_period=0.5)\n"
        "_, other, _ = site.fly_pd(duration=3.0, dt=0.5)\n"
        "print(json.dumps([float(x).hex() for x in [*history.ravel(), *other]]))\n"
    )
    plain = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    _, end, history = reference.fly_law(duration=3.0, dt=0.5, record_period=0.5)
    _, other, _ = reference.fly_pd(duration=3.0, dt=0.5)
    assert json.loads(plain.stdout) == [float(x).hex() for x in [*history.ravel(), *other]]
