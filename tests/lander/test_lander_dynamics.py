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

from flight_math import DualVector, Mat3, Vec3, kernel, rk4
from lander_ros.landing_law import landing_law
from lander_ros.twistor import from_pose, pose_from_twistor, switch_to_shadow, to_pose
from lander_ros.twistor_dynamics import twistor_state_rate
from sim_nodes.gravity.ellipsoid import ellipsoid_gravity
from sim_nodes.lander.descent import Watch
from sim_nodes.lander.dynamics import (
    attitude_matrix,
    hold_step,
    motor,
    rate_under,
    require_truth,
    site_gravity,
    touched_down,
)
from sim_nodes.lander.start import approach_attitude, require_approach
from tests.lander.reference_landing import matrix, numbers, start_motion

pytestmark = pytest.mark.xdist_group("the lander's dynamics")  # compiled once

ZERO = Vec3(0.0, 0.0, 0.0)


def inertial_motion(reference, state, force, torque, duration, mass_flow=0.0):
    """r^D, R_DB and rates after ``duration`` [s] by Newton and Euler in an inertial frame, with scipy's DOP853."""
    truth, body = reference.truth, reference.body
    spin = np.array([0.0, 0.0, truth.body_spin])
    r_ad, rho, inertia = matrix(truth.site_rotation), np.array(truth.site_position), matrix(truth.inertia)
    attitude = r_ad @ Rotation.from_quat(state[6:10]).as_matrix()  # A and the inertial axes coincide at t = 0
    position = rho + r_ad @ state[0:3]
    velocity = r_ad @ state[3:6] + np.cross(spin, position)
    rates = state[10:13] + attitude.T @ spin

    def derivative(t, y):
        to_a = Rotation.from_rotvec(-spin * t).as_matrix()
        turn = y[6:15].reshape(3, 3)
        w = y[15:18]
        gravity = to_a.T @ np.array(ellipsoid_gravity(body, Vec3(*(to_a @ y[0:3]))))
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        angular = np.linalg.solve(inertia, torque - np.cross(w, inertia @ w))
        acceleration = gravity + turn @ force / (state[13] - mass_flow * t)
        return np.concatenate([y[3:6], acceleration, (turn @ skew).ravel(), angular])

    start = np.concatenate([position, velocity, attitude.ravel(), rates])
    end = solve_ivp(derivative, (0.0, duration), start, method="DOP853", rtol=1e-13, atol=1e-12).y[:, -1]
    to_a = Rotation.from_rotvec(-spin * duration).as_matrix()
    turn = r_ad.T @ to_a @ end[6:15].reshape(3, 3)
    r = r_ad.T @ (to_a @ end[0:3] - rho)
    v = r_ad.T @ (to_a @ end[3:6] - np.cross(spin, to_a @ end[0:3]))
    return r, v, turn, end[15:18] - turn.T @ (r_ad.T @ spin)


def held(truth, motion, wrench, flow, steps):
    """The motion after steps of 0.1 s under a held wrench."""
    for _ in range(steps):
        motion = hold_step(truth, truth, motion, site_gravity(truth, truth, motion.position), wrench, flow, 0.1)
    return motion


@pytest.mark.parametrize("mass_flow", [0.0, 0.05])
def test_plant_against_the_inertial_frame(reference, mass_flow):
    start = reference.start._replace(rates=Vec3(0.02, -0.03, 0.05))  # [rad/s]
    force, torque = np.array([5.0, -8.0, 12.0]), np.array([0.1, -0.2, 0.15])
    r, v, attitude, rates = inertial_motion(reference, numbers(start), force, torque, 40.0, mass_flow)
    end = held(reference.truth, start, DualVector(Vec3(*force), Vec3(*torque)), mass_flow, 400)
    np.testing.assert_allclose(end.position, r, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(end.velocity, v, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(Rotation.from_quat(end.attitude).as_matrix(), attitude, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(end.rates, rates, rtol=0.0, atol=1e-10)
    assert end.mass == pytest.approx(500.0 - 40.0 * mass_flow, abs=1e-9)


def test_gravity_gradient_torque_is_the_central_fields(reference):
    """Against the torque of a dumb-bell: six masses with the inertia's principal moments in a point-mass field."""
    truth = reference.truth
    motion = start_motion([0, 0, 0], [0, 0, 0], Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_quat(), [0, 0, 0])
    with_torque, without = (
        rate_under(truth._replace(gravity_gradient=on), truth, motion, ZERO, DualVector(ZERO, ZERO), 0.0)
        for on in (True, False))
    torque = matrix(truth.inertia) @ np.array(with_torque.rates - without.rates)
    moments, axes = np.linalg.eigh(matrix(truth.inertia))
    half = np.sqrt((0.5 * moments.sum() - moments) / 2.0)  # one unit mass at +- half on each principal axis
    to_site = matrix(attitude_matrix(motion.attitude))
    centre = to_site.T @ (matrix(truth.site_rotation).T @ np.array(truth.site_position))
    total = np.zeros(3)
    for i in range(3):
        for sign in (1.0, -1.0):
            arm = sign * half[i] * axes[:, i]
            x = centre + arm
            total += np.cross(arm, -reference.body.mu * x / np.linalg.norm(x) ** 3)
    np.testing.assert_allclose(torque, total, rtol=1e-4, atol=1e-10)


@kernel
def wrench_of_law(law_p, truth, twistor, velocity):
    """The law's wrench at a twistor and a motor, under the true gravity."""
    r, q = pose_from_twistor(twistor)
    return landing_law(law_p, r, q, velocity, site_gravity(truth, truth, r))[0]


@kernel
def twistor_rates(given, t, state):
    """dB/dt and dV/dt under the wrench that is held, or that of the law, and the true gravity."""
    law_p, inverse, truth, held, hold = given
    twistor, velocity = state
    r, _ = pose_from_twistor(twistor)
    wrench = held if hold else wrench_of_law(law_p, truth, twistor, velocity)
    return twistor_state_rate(law_p, inverse, twistor, velocity, wrench, site_gravity(truth, truth, r))


@kernel
def twistor_flight(law_p, inverse, truth, start, dt, steps, hold):
    """Fly the law with (B, V) as the state: the law in every Runge-Kutta stage or held; counts shadow switches."""
    twistor, velocity = start
    switches = 0
    for _ in range(steps):
        held = wrench_of_law(law_p, truth, twistor, velocity)
        given = (law_p, inverse, truth, held, hold)
        twistor, velocity = rk4(twistor_rates, given, 0.0, (twistor, velocity), dt)
        twistor, switched = switch_to_shadow(twistor, 1.0)
        switches += switched
    return twistor, velocity, switches


def fly_as_twistor(reference, start, dt, duration, hold):
    inverse = Mat3(np.linalg.inv(matrix(reference.law.inertia)))
    first = (from_pose(start.position, start.attitude), motor(start))
    return twistor_flight(reference.law, inverse, reference.truth, first, dt, round(duration / dt), hold)


def compare(twistor, velocity, motion, metres):
    r, q = to_pose(twistor)
    np.testing.assert_allclose(r, motion.position, rtol=0.0, atol=metres)
    assert (Rotation.from_quat(q) * Rotation.from_quat(motion.attitude).inv()).magnitude() < 1e-9
    np.testing.assert_allclose(velocity.real, motion.rates, rtol=0.0, atol=1e-10)


def test_twistor_integration_is_rigid_body_integration_over_a_minute(reference):
    _, end, _ = reference.fly_law(duration=60.0, dt=0.02)
    twistor, velocity, switches = fly_as_twistor(reference, reference.start, 0.02, 60.0, False)
    assert switches == 0
    compare(twistor, velocity, end, 1e-8)


def test_twistor_integration_across_a_shadow_switch(reference):
    """A craft that turns through 180 deg, with b as the state: the switch changes nothing."""
    q = approach_attitude(reference.r0, math.radians(179.5), math.radians(5.0), 0.3)
    start = start_motion(reference.r0, [0.3, -0.2, 0.1], q, [0.5, -0.3, -8.0])
    if from_pose(start.position, q).real.z * start.rates.z < 0.0:
        start = start._replace(rates=Vec3(start.rates.x, start.rates.y, -start.rates.z))
    _, end, _ = reference.fly_law(start=start, duration=60.0, dt=0.02, control_period=0.02)
    twistor, velocity, switches = fly_as_twistor(reference, start, 0.02, 60.0, True)
    assert switches >= 1
    compare(twistor, velocity, end, 1e-8)


def test_a_held_law_is_hold_steps(reference):
    """The reference descent at 1 Hz is ten steps of 0.1 s with the wrench of the law, byte for byte."""
    _, end, _ = reference.fly_law(duration=20.0, control_period=1.0)
    motion = reference.start
    for _ in range(20):
        motion = held(reference.truth, motion, reference.evaluate(motion).wrench, 0.0, 10)
    assert numbers(motion).tobytes() == numbers(end).tobytes()


def test_contact_trigger_needs_height_and_nearness():
    assert touched_down(Watch(), Vec3(1.0, 1.0, 0.09))
    assert not touched_down(Watch(), Vec3(1.0, 1.0, 0.11))
    assert not touched_down(Watch(), Vec3(25.0, 0.0, 0.05))


def test_bad_plants_and_starts_are_refused(reference):
    truth = reference.truth
    with pytest.raises(ValueError, match="inertia"):
        require_truth(truth._replace(inertia=Mat3(np.diag([1.0, -1.0, 1.0]))))
    with pytest.raises(ValueError, match="site_rotation"):
        require_truth(truth._replace(site_rotation=2.0 * truth.site_rotation))
    with pytest.raises(ValueError, match="least rotation"):
        require_approach([0.0, 0.0, -1.0])
    with pytest.raises(ValueError, match="multiple"):
        reference.fly_law(control_period=0.25)


def test_records_and_plain_python_give_the_same_bits(reference):
    """The kernels' plain source against their compiled form, bit for bit, over the nominal start."""
    program = (
        "import json\n"
        "from tests.lander.reference_landing import numbers, reference_landing\n"
        "site = reference_landing()\n"
        "_, end, history = site.fly_law(duration=3.0, dt=0.5, record_period=0.5)\n"
        "_, other, _ = site.fly_pd(duration=3.0, dt=0.5)\n"
        "print(json.dumps([float(x).hex() for x in [*history.ravel(), *numbers(other)]]))\n"
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
    assert json.loads(plain.stdout) == [float(x).hex() for x in [*history.ravel(), *numbers(other)]]
