"""Compiled and plain Python (NUMBA_DISABLE_JIT=1) give the same bits, kernel by kernel and over a short closed loop."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from cubli_ros import appc, attitude, attitude_filter, funnel, jump_condition, sampled_appc
from cubli_ros.appc_controller import AppcParameters, AppcState
from cubli_ros.attitude_estimator import AttitudeEstimatorParameters, AttitudeEstimatorState
from cubli_ros.backstepping import backstepping
from cubli_ros.backstepping_controller import BacksteppingParameters
from cubli_ros.pd import proportional_derivative
from cubli_ros.pd_controller import PdParameters
from flight_math import Quaternion, Vec3, noise, normalised, same, sincos
from sim_nodes.cubli import dynamics, reaction_wheels
from sim_nodes.cubli.plant import CubliPlantParameters
from sim_nodes.cubli.sensors import ImuParameters, StarTrackerParameters
from sim_nodes.sensors import inertial, star_tracker
from sim_nodes.sensors.inertial import ImuState
from tests.cubli.records import made

ROOT = Path(__file__).resolve().parents[2]


THETA = 2.0 * 0.2**2 * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))  # [kg m^2]


class RunParameters(
    CubliPlantParameters, BacksteppingParameters, PdParameters, AppcParameters, AttitudeEstimatorParameters, ImuParameters):
    """Of every kernel in one record."""


def short_run():
    """Every kernel family along 60 samples of a disturbed, noisy, clipped run; the numbers of each sample."""
    record = []
    h, key = 0.01, noise.stream_key(42, "imu")
    p = made(RunParameters, h, smoothing=0.01, disturbance_phase=[0.0, 2.1, 4.2], gravity=0.002, inertia=THETA.tolist(),
             adaptive_a_limit=1.0, adaptive_u_limit=1.0, seed=key, gyro_walk_sigma=1e-6, accelerometer_sigma=1e-5,
             gate=1e9, c1=1.0, c2=2.0)
    laws = made(AppcState, adaptive_a=0.05, adaptive_u=0.1, start_bound=0.4)
    gyro, estimate = made(ImuState, bias=2e-4), made(AttitudeEstimatorState)
    star = made(StarTrackerParameters, seed=key + 1)
    angles, omega = Vec3(-0.3, 0.3, 0.3), Vec3(0.01, -0.02, 0.03)
    standing = normalised(Quaternion(0.1, -0.2, 0.05, 0.97)), omega, Vec3(1.0, 2.0, -3.0)
    attitude_filter.start(p, estimate, Quaternion(0.1, 0.2, 0.3, 0.9273618495495703))
    alpha, gravity, zero = same(0.0), attitude.level_gravity(p), same(0.0)
    for step in range(60):
        t = step * h
        turn = sincos(angles)
        body_gravity = attitude.to_body(turn, gravity)
        m_g = attitude.gravity_torque(p, body_gravity)
        funnel.rearm(p, laws, t, angles)
        rho_a, rho_u = funnel.attitude_bound(p, laws, t), funnel.rate_bound(p, t)
        cap = funnel.matched_cap(h, p.lambda_u, rho_u, 0.98)
        xi_a = angles / rho_a
        if step % 3 == 0:
            epsilon_a, laws.virtual_rate = appc.attitude_loop(p, laws, turn, xi_a, zero)
            xi_u = (omega - laws.virtual_rate) / rho_u
            epsilon_u, acceleration = appc.rate_loop(p, laws, xi_u)
        else:
            xi_u = (omega - laws.virtual_rate) / rho_u
            epsilon_a, epsilon_u, acceleration = sampled_appc.sampled_law(p, laws, t, angles, turn, omega)
        u = appc.torque_demand(p, acceleration, m_g)
        laws.adaptive_a = appc.adapted(h, laws.adaptive_a, p.eta_a, epsilon_a, xi_a, p.adaptive_a_limit)
        laws.adaptive_u = appc.adapted(h, laws.adaptive_u, p.eta_u, epsilon_u, xi_u, p.adaptive_u_limit)
        delivered = reaction_wheels.deliverable_torque(p, u, standing[2])
        record += [m_g, rho_a, rho_u, cap, funnel.capped_error(xi_u, cap), laws.virtual_rate, acceleration, u, delivered]
        record += [laws.adaptive_a, laws.adaptive_u, [laws.rearmed]]

        omega_dot = dynamics.paper_acceleration(p, body_gravity, delivered, zero)
        record.append(jump_condition.contact(omega, omega_dot, gravity, -gravity / 0.002, 0.2))
        across = jump_condition.rate_across_diagonal(omega_dot)
        record.append([jump_condition.corner_rate_limit(0.002, 0.2, 0.9), across])
        rates = inertial.gyro(step, p, gyro, standing[1])
        specific = inertial.accelerometer(step, p, omega_dot - gravity)
        measured = star_tracker.measured_attitude(step, star, standing[0])
        attitude_filter.predict(p, estimate, rates)
        if step % 5 == 0:
            record.append([attitude_filter.update(p, estimate, measured), estimate.innovation_squared])
        estimate.gyro_before = rates
        found = attitude.cardan_from_quaternion(estimate.quaternion)
        alpha, acceleration = backstepping(p, sincos(found), found, rates)
        record += [rates, specific, measured, estimate.quaternion, estimate.bias, found, alpha, acceleration]
        record += [block.parts() for block in (
            estimate.attitude_covariance, estimate.cross_covariance, estimate.bias_covariance)]
        record += [proportional_derivative(p, found, rates), [noise.uniform(key, step, 7), noise.gaussian(key, step, 8)]]

        (angles, omega), _ = dynamics.paper_step((p, gravity, delivered), dynamics.disturbance(p, t), t, h, (angles, omega))
        standing = dynamics.standing_step((p, gravity, delivered), t, h, standing)
        record += [angles, omega, *standing, reaction_wheels.spun(p, alpha, delivered, rates)]
        record = [np.concatenate([np.ravel(np.array(item, dtype=float)) for item in record])]
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
