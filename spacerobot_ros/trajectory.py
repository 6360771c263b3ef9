"""Desired motion of base attitude and joints: step, quintic slew, harmonics.

Source: Aerospace 2023, 10(10), 679, sections 4.1 (step from Theta_0 to Theta_f) and 4.3 (harmonics). A channel is one
of [roll, pitch, yaw (Euler ZYX), theta_1 .. theta_n]; every kernel fills the desired quaternion (scalar first), the
angular velocity and acceleration in desired body axes [rad/s, rad/s^2], and theta, theta_dot, theta_ddot of the joints.
"""

import math

import numpy as np

from flight_graph.kernel import kernel
from spacerobot_ros.inertial_parameters import ModelError


@kernel
def euler_attitude(angles, rates, accelerations, q_d, w_d, wdot_d):
    """Quaternion, body rate and its derivative of ZYX Euler angles [roll, pitch, yaw] (3,) and their derivatives.

    w = [r' - y' sp, p' cr + y' cp sr, -p' sr + y' cp cr].
    """
    cr, sr = math.cos(angles[0]), math.sin(angles[0])
    cp, sp = math.cos(angles[1]), math.sin(angles[1])
    r1, p1, y1 = rates[0], rates[1], rates[2]
    r2, p2, y2 = accelerations[0], accelerations[1], accelerations[2]
    w_d[0] = r1 - y1 * sp
    w_d[1] = p1 * cr + y1 * cp * sr
    w_d[2] = -p1 * sr + y1 * cp * cr
    wdot_d[0] = r2 - y2 * sp - y1 * p1 * cp
    wdot_d[1] = p2 * cr - p1 * r1 * sr + y2 * cp * sr - y1 * p1 * sp * sr + y1 * r1 * cp * cr
    wdot_d[2] = -p2 * sr - p1 * r1 * cr + y2 * cp * cr - y1 * p1 * sp * cr - y1 * r1 * cp * sr
    cr, sr = math.cos(0.5 * angles[0]), math.sin(0.5 * angles[0])
    cp, sp = math.cos(0.5 * angles[1]), math.sin(0.5 * angles[1])
    cy, sy = math.cos(0.5 * angles[2]), math.sin(0.5 * angles[2])
    q_d[0] = cr * cp * cy + sr * sp * sy
    q_d[1] = sr * cp * cy - cr * sp * sy
    q_d[2] = cr * sp * cy + sr * cp * sy
    q_d[3] = cr * cp * sy - sr * sp * cy


@kernel
def step_reference(target, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, work):
    """Hold ``target`` (3+n,) [rad]: the whole step at once. Work: (3, 3)."""
    for k in range(3):
        work[0, k] = target[k]
        work[1, k] = 0.0
        work[2, k] = 0.0
    euler_attitude(work[0], work[1], work[2], q_d, w_d, wdot_d)
    for i in range(theta_d.shape[0]):
        theta_d[i] = target[3 + i]
        thd_d[i] = 0.0
        thdd_d[i] = 0.0


@kernel
def harmonic_reference(t, mean, amplitude, period, phase, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, work):
    """Channel k: mean + amplitude sin(2 pi t / period + phase); arrays (3+n,) [rad, rad, s, rad], ``t`` [s].

    Work: (3, 3).
    """
    for k in range(mean.shape[0]):
        frequency = 2.0 * math.pi / period[k]
        angle = frequency * t + phase[k]
        sine = amplitude[k] * math.sin(angle)
        value = mean[k] + sine
        rate = amplitude[k] * frequency * math.cos(angle)
        acceleration = -frequency * frequency * sine
        if k < 3:
            work[0, k] = value
            work[1, k] = rate
            work[2, k] = acceleration
        else:
            theta_d[k - 3] = value
            thd_d[k - 3] = rate
            thdd_d[k - 3] = acceleration
    euler_attitude(work[0], work[1], work[2], q_d, w_d, wdot_d)


@kernel
def quintic(t, duration, profile):
    """Rest-to-rest profile (3,) = [s, s_dot, s_ddot], s = 10 x^3 - 15 x^4 + 6 x^5, x = t / duration in [0, 1]."""
    x = t / duration
    if x <= 0.0:
        profile[0], profile[1], profile[2] = 0.0, 0.0, 0.0
    elif x >= 1.0:
        profile[0], profile[1], profile[2] = 1.0, 0.0, 0.0
    else:
        profile[0] = x * x * x * (10.0 + x * (6.0 * x - 15.0))
        profile[1] = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration
        profile[2] = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (duration * duration)


@kernel
def slew_reference(t, duration, q_start, turn, theta_start, theta_end, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, work):
    """Rest-to-rest slew of ``duration`` [s]: base about one axis, joints straight, both by `quintic`.

    ``q_start`` (4,) attitude at t <= 0; ``turn`` (3,) rotation vector of the whole slew in body axes [rad]. Work: (3,).
    """
    quintic(t, duration, work)
    s, rate, acceleration = work[0], work[1], work[2]
    angle = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    factor = math.sin(0.5 * s * angle) / angle if angle > 0.0 else 0.0
    c, x, y, z = math.cos(0.5 * s * angle), factor * turn[0], factor * turn[1], factor * turn[2]
    t0, t1, t2, t3 = q_start[0], q_start[1], q_start[2], q_start[3]
    q_d[0] = t0 * c - t1 * x - t2 * y - t3 * z
    q_d[1] = t0 * x + t1 * c + t2 * z - t3 * y
    q_d[2] = t0 * y - t1 * z + t2 * c + t3 * x
    q_d[3] = t0 * z + t1 * y - t2 * x + t3 * c
    for k in range(3):
        w_d[k] = rate * turn[k]
        wdot_d[k] = acceleration * turn[k]
    for i in range(theta_d.shape[0]):
        difference = theta_end[i] - theta_start[i]
        theta_d[i] = theta_start[i] + s * difference
        thd_d[i] = rate * difference
        thdd_d[i] = acceleration * difference


@kernel
def hold_within(theta_d, thd_d, thdd_d, lower, upper):
    """Keep a desired joint motion inside [lower, upper] [rad]: at a bound it rests there. Returns the joints held."""
    held = 0
    for i in range(theta_d.shape[0]):
        if not (lower[i] <= theta_d[i] <= upper[i]):
            theta_d[i] = lower[i] if theta_d[i] < lower[i] else upper[i]
            thd_d[i] = 0.0
            thdd_d[i] = 0.0
            held += 1
    return held


def check_range(robot, lowest, highest) -> None:
    """Refuse a desired motion whose joints go past a stop. ``lowest``, ``highest`` (n,) [rad]. Raises `ModelError`."""
    for name, low, high, lower, upper in zip(robot.joint_names, lowest, highest, robot.lower, robot.upper, strict=True):
        if not (np.isfinite(low) and np.isfinite(high)):
            raise ModelError(f"joint '{name}': the commanded angle is not a finite number")
        if low < lower or high > upper:
            raise ModelError(
                f"joint '{name}' is commanded to [{np.degrees(low):g}, {np.degrees(high):g}] deg, past its stop; "
                f"allowed: [{np.degrees(lower):g}, {np.degrees(upper):g}] deg"
            )
