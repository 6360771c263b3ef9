"""Compiled and plain Python (NUMBA_DISABLE_JIT=1) give the same bits, kernel by kernel and over a short closed loop."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from cubli_ros import appc, attitude, attitude_filter, funnel, jump_condition
from cubli_ros.backstepping import backstepping
from cubli_ros.pd import proportional_derivative
from flight_graph import noise
from sim_nodes import cubli_dynamics, reaction_wheels, sensors

ROOT = Path(__file__).resolve().parents[2]


def short_run():
    """Every kernel family along 60 samples of a disturbed, noisy, clipped run; the numbers of each sample."""
    record = []
    key = noise.stream_key(42, "imu")
    state = np.array([-0.3, 0.3, 0.3, 0.01, -0.02, 0.03])
    physical = np.concatenate([[0.1, -0.2, 0.05, 0.97], [0.01, -0.02, 0.03], [1.0, 2.0, -3.0]])
    attitude.quaternion_normalise(physical)
    gravity = cubli_dynamics.level_gravity(0.002)
    theta = cubli_dynamics.corner_inertia(2.0, 0.2)
    inverse = np.empty((3, 3))
    attitude.invert_3x3(theta - 1e-3 * np.eye(3), inverse)
    zero, one = np.zeros(3), np.ones(3)
    m_g, u, delivered, error, xi, epsilon, delta, acceleration = (np.zeros(3) for _ in range(8))
    rho_a, rho_u, e_u, eps_u, predicted, alpha = (np.zeros(3) for _ in range(6))
    v_a, v_u, bias = np.full(3, 0.05), np.full(3, 0.1), np.full(3, 2e-4)
    start_bound, start_time = np.full(3, 0.4), np.zeros(3)
    q, filter_bias, covariance, innovation = np.zeros(4), np.zeros(3), np.zeros((6, 6)), np.zeros(3)
    attitude_filter.start(np.array([0.1, 0.2, 0.3, 0.9273618495495703]), 1e-2, 1e-3, q, filter_bias, covariance)
    work, star_work, gyro, previous = np.zeros((3, 6, 6)), np.zeros((2, 4)), np.zeros(3), np.zeros(3)
    measured, specific, slope = np.zeros(4), np.zeros(3), np.zeros(6)
    gains = [np.full(3, value) for value in (0.041, 0.01, 0.005, 0.008, -0.29, 0.1, 0.005, -0.25)]
    gain, k, eta, final_a, l_a, rho_u0, final_u, l_u = gains
    amplitude, phase = np.full(3, 0.02), np.array([0.0, 2.1, 4.2])
    h = 0.01  # [s]
    for step in range(60):
        t = step * h
        attitude.gravity_torque(state, gravity, 1.0, 2.0, 0.2, m_g)
        widened = funnel.rearm(t, state[:3], final_a, l_a, start_bound, start_time)
        appc.attitude_bounds(t, start_bound, start_time, final_a, l_a, rho_a)
        appc.rate_bounds(t, rho_u0, final_u, l_u, rho_u)
        cap = np.full(3, funnel.matched_cap(h, 0.041, rho_u[0], 0.98))
        if step % 3 == 0:
            appc.attitude_loop(state, zero, zero, rho_a, gain, k, v_a, 0.01, one, error, xi, epsilon, delta)
            appc.rate_loop(state[3:], delta, rho_u, gain, k, v_u, 0.01, cap, e_u, xi, eps_u, acceleration)
        else:
            appc.normalise(state[3:], delta, rho_u, e_u, xi)
            appc.implicit_attitude_loop(
                state, state[3:], zero, zero, rho_a, gain, k, v_a, h, predicted, epsilon, delta
            )
            appc.implicit_rate_loop(state[3:], delta, rho_u, gain, k, v_u, h, eps_u, acceleration)
        appc.torque_demand(theta, acceleration, m_g, 1.0, u)
        frozen = appc.limit_torque(u, 0.02, delivered)
        appc.adapt(h, eta, epsilon, xi, frozen, 1.0, v_a)
        appc.adapt(h, eta, eps_u, xi, frozen, 1.0, v_u)
        clipped = reaction_wheels.deliverable_torque(u, physical[7:], 0.02, 628.0, 1e-3, h, delivered)
        record += [m_g, rho_a, rho_u, delta, acceleration, u, delivered, v_a, v_u, [widened, frozen, clipped]]

        cubli_dynamics.paper_rates(state, delivered, zero, gravity, 1.0, 2.0, 0.2, 0.0133, slope)
        record.append(jump_condition.contact(state[3:], slope[3:], gravity, -gravity / 0.002, 0.2))
        across = jump_condition.rate_across_diagonal(slope[3:])
        record.append([jump_condition.corner_rate_limit(0.002, 0.2, 0.9), across])
        sensors.gyro_sample(key, step, physical[4:7], 1e-4, 1e-6, bias, gyro)
        sensors.accelerometer_sample(key, step, physical[4:7], slope[3:], gravity, 0.2, 1e-5, specific)
        sensors.star_tracker_sample(key + 1, step, physical, 5e-5, measured, star_work)
        attitude_filter.predict(q, filter_bias, covariance, previous, gyro, h, 1e-4, 1e-6, work)
        if step % 5 == 0:
            result = attitude_filter.update(q, filter_bias, covariance, measured, 5e-5, 1e9, innovation, work)
            record.append(result)
        previous[:] = gyro
        attitude.cardan_from_quaternion(q, predicted)
        backstepping(predicted, predicted, gyro, 1.0, 2.0, theta, m_g, u, alpha)
        record += [gyro, specific, measured, q, filter_bias, covariance, predicted, u, alpha]
        proportional_derivative(predicted, gyro, one, one, theta, u)
        record += [u, [noise.uniform(key, step, 7), noise.gaussian(key, step, 8)]]

        cubli_dynamics.paper_step(
            state, t, h, 2, delivered, amplitude, 1.0, phase, gravity, 1.0, 2.0, 0.2, 0.0133, np.zeros((4, 6))
        )
        cubli_dynamics.physical_step(
            physical, t, h, 2, delivered, 1e-4 * one, 1.0, phase, gravity, 2.0, 0.2, theta, inverse, 1e-3,
            np.zeros((4, 10)),
        )  # fmt: skip
        reaction_wheels.spin(delivered, gyro, 1e-3, h, alpha)
        record += [state, physical, alpha]
        record = [np.concatenate([np.ravel(np.asarray(item, dtype=float)) for item in record])]
    return record[0]


def test_plain_python_gives_the_same_bits(tmp_path):
    script = (
        "import sys, numpy as np; from tests.cubli.test_plain_python import short_run\n"
        "with np.errstate(over='ignore'): np.save(sys.argv[1], short_run())"
    )
    path = tmp_path / "plain.npy"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-c", script, path], check=True, env=environment, cwd=ROOT, timeout=120)
    plain, compiled = np.load(path), short_run()
    assert np.all(np.isfinite(compiled))
    assert compiled.size > 5000
    different = np.flatnonzero(plain.view(np.int64) != compiled.view(np.int64))
    assert different.size == 0, f"{different.size} of {plain.size} numbers differ, first at {different[:5]}"
