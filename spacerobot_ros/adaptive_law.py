"""Adaptive control of base attitude and joints (Slotine and Li) on the estimated parameters.

Source: Aerospace 2023, 10(8), 679, equations (31)-(33), (38). Errors and gains have 3+n elements: attitude, joints.
Attitude error by quaternion: dq = q^-1 q_d, e = 2 sgn(dq0) dq_v (body axes). References:
w_r = dR w_d + Lambda e, al_r = dR w_d_dot - w x (dR w_d) + Lambda e_dot, likewise for joints;
sigma = [w_r - w, thd_r - thd]; u = Y(theta, v, v_r, v_r_dot) pi_hat + K_D sigma.

The base's translation is not commanded: its reference acceleration a_r is the one that makes the estimated force on
the system vanish, a_r = -f0(pi_hat) / M_hat. At pi_hat = pi this is Slotine-Li on the system without linear momentum.

``p``: the controller's parameters. ``reference``: the desired motion, with the entries of the topic `reference`.
"""

from typing import NamedTuple

import numpy as np

from flight_math import Quaternion, Vec3, clip, conjugate, cross, kernel, rotate, stack_array, vec3, vector_part
from spacerobot_ros.dynamics import inverse_dynamics, total_mass
from spacerobot_ros.kinematics import Motion

SLOTINE_LI = 0  # Y(theta, v, v_r, v_r_dot): the form that has a proof
PRINTED = 1  # Y(theta, v_r, v_r_dot) of equation (38): reference velocities in both places
ACTUAL = 2  # Y(theta, v, v_r_dot): actual velocities in both places
DESIRED_FEEDFORWARD = 3  # v_r, v_r_dot := desired motion, sigma := e + Lambda e_dot (a reading that fits Fig. 10)

PREDICTED = 0  # a_r from the estimated force rows
MEASURED = 1  # a_r := accelerometer of the previous control period

ZERO = Vec3(0.0, 0.0, 0.0)


class Present(NamedTuple):
    """Measured motion: attitude; rates [rad/s] in body axes; joint angles [rad] and rates [rad/s], (n,)."""

    attitude: Quaternion
    rates: Vec3
    joints: np.ndarray
    joint_rates: np.ndarray


@kernel
def attitude_error(q, w, reference):
    """Equation (31): error and its rate, and the desired rate and acceleration seen in present body axes."""
    difference = conjugate(q) * reference.attitude
    sign, vector = (1.0 if difference.w >= 0.0 else -1.0), vector_part(difference)
    rate = rotate(difference, reference.rates)
    acceleration = rotate(difference, reference.angular_acceleration) - cross(w, rate)
    error_rate = sign * (difference.w * (rate - w) + cross(rate - w, vector))
    return 2.0 * sign * vector, error_rate, rate, acceleration


@kernel
def reference_signals(form, gain, error, error_rate, desired, actual):
    """Equations (32), (33), of the attitude (vectors) or of one joint (numbers): sigma, v, v_r, v_r_dot.

    ``desired``: velocity and acceleration; ``actual``: velocity.
    """
    velocity, acceleration = desired
    if form == DESIRED_FEEDFORWARD:
        sigma, reference, reference_rate = error + gain * error_rate, velocity, acceleration
    else:
        reference, reference_rate = velocity + gain * error, acceleration + gain * error_rate
        sigma = reference - actual
    return sigma, reference if form == PRINTED else actual, actual if form == ACTUAL else reference, reference_rate


@kernel
def reference_motion(p, present, reference, sigma, joints):
    """Errors to the `Motion` of the regressor, without a_r. Fills ``sigma`` (3+n,) [rad/s] and ``joints`` (3, n): thd,
    thd_r, thdd_r, which the motion keeps."""
    error, error_rate, rate, acceleration = attitude_error(present.attitude, present.rates, reference)
    s, w, w_r, al_r = reference_signals(
        p.form, vec3(p.gain[0:3]), error, error_rate, (rate, acceleration), present.rates)
    sigma[0:3] = s
    for i in range(len(p.parent)):
        sigma[3 + i], joints[0, i], joints[1, i], joints[2, i] = reference_signals(
            p.form, p.gain[3 + i], reference.joints[i] - present.joints[i],
            reference.joint_rates[i] - present.joint_rates[i],
            (reference.joint_rates[i], reference.joint_accelerations[i]), present.joint_rates[i])
    return Motion(w, w_r, al_r, ZERO, joints[0], joints[1], joints[2])


@kernel
def with_acceleration(motion, a_r):
    """The motion with the base's acceleration a_r."""
    return Motion(motion.w, motion.w_r, motion.al_r, a_r, motion.thd, motion.thd_r, motion.thdd_r)


@kernel
def predicted_acceleration(tree, pi_hat, motion):
    """a_r = -f0(pi_hat) / M_hat [m/s^2], f0 the estimated force rows of a motion without a_r."""
    wrench = stack_array(6 + len(tree.parent))
    inverse_dynamics(tree, pi_hat, motion, wrench)
    return -vec3(wrench[0:3]) / total_mass(pi_hat)


@kernel
def control_torque(p, tree, pi_hat, motion, sigma, u):
    """u (3+n,) = Y7 pi_hat + K_D sigma [N m], equation (38), clipped. Returns the number of clipped torques."""
    wrench = stack_array(6 + len(tree.parent))
    inverse_dynamics(tree, pi_hat, motion, wrench)
    clipped = 0
    for k in range(len(u)):
        demand = wrench[3 + k] + p.damping_scale * p.damping[k] * sigma[k]
        u[k] = clip(demand, -p.torque_limit[k], p.torque_limit[k])
        clipped += u[k] != demand
    return clipped
