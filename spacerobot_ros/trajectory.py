"""Desired motion of base attitude and joints: step, quintic slew, harmonics.

Source: Aerospace 2023, 10(8), 679, sections 4.1 (step from Theta_0 to Theta_f) and 4.3 (harmonics). A channel is one
of [roll, pitch, yaw (Euler ZYX), theta_1 .. theta_n]. Every motion returns the `Desired` attitude and fills ``joints``
(3, n): theta, theta_dot, theta_ddot. ``p``: the parameters of the trajectory generator.
"""

import math
from typing import NamedTuple

import numpy as np

from flight_math import Quaternion, Vec3, conjugate, kernel, quaternion_from_rotation_vector, rotation_vector, sincos, vec3
from spacerobot_ros.inertial_parameters import ModelError

ZERO = Vec3(0.0, 0.0, 0.0)


class Desired(NamedTuple):
    """Attitude, and angular velocity and acceleration in desired body axes [rad/s, rad/s^2]."""

    attitude: Quaternion
    rates: Vec3
    angular_acceleration: Vec3


@kernel
def euler_quaternion(angles):
    """Attitude of ZYX Euler angles [roll, pitch, yaw] [rad]."""
    sr, cr = sincos(0.5 * angles.x)
    sp, cp = sincos(0.5 * angles.y)
    sy, cy = sincos(0.5 * angles.z)
    return Quaternion(sr * cp * cy - cr * sp * sy,
                      cr * sp * cy + sr * cp * sy,
                      cr * cp * sy - sr * sp * cy,
                      cr * cp * cy + sr * sp * sy)


@kernel
def euler_attitude(angles, rates, accelerations):
    """Desired motion of ZYX Euler angles [roll, pitch, yaw] and their derivatives.

    w = [r' - y' sp, p' cr + y' cp sr, -p' sr + y' cp cr].
    """
    sr, cr = sincos(angles.x)
    sp, cp = sincos(angles.y)
    r1, p1, y1 = rates.x, rates.y, rates.z
    r2, p2, y2 = accelerations.x, accelerations.y, accelerations.z
    w = Vec3(r1 - y1 * sp,
             p1 * cr + y1 * cp * sr,
             -p1 * sr + y1 * cp * cr)
    w_dot = Vec3(r2 - y2 * sp - y1 * p1 * cp,
                 p2 * cr - p1 * r1 * sr + y2 * cp * sr - y1 * p1 * sp * sr + y1 * r1 * cp * cr,
                 -p2 * sr - p1 * r1 * cr + y2 * cp * cr - y1 * p1 * sp * cr - y1 * r1 * cp * sr)
    return Desired(euler_quaternion(angles), w, w_dot)


@kernel
def step_reference(p, joints):
    """Hold p.target [rad]: the whole step at once."""
    for i in range(joints.shape[1]):
        joints[0, i], joints[1, i], joints[2, i] = p.target[3 + i], 0.0, 0.0
    return Desired(euler_quaternion(vec3(p.target[0:3])), ZERO, ZERO)


@kernel
def harmonic(p, k, t):
    """Channel k: target + amplitude sin(2 pi t / cycle + phase), its rate and acceleration; ``t`` [s]."""
    frequency = 2.0 * math.pi / p.cycle[k]
    sine, cosine = sincos(frequency * t + p.phase[k])
    swing = p.amplitude[k] * sine
    return p.target[k] + swing, p.amplitude[k] * frequency * cosine, -frequency * frequency * swing


@kernel
def harmonic_reference(p, t, joints):
    """Every channel swings about p.target."""
    roll, pitch, yaw = harmonic(p, 0, t), harmonic(p, 1, t), harmonic(p, 2, t)
    for i in range(joints.shape[1]):
        joints[0, i], joints[1, i], joints[2, i] = harmonic(p, 3 + i, t)
    return euler_attitude(Vec3(roll[0], pitch[0], yaw[0]), Vec3(roll[1], pitch[1], yaw[1]), Vec3(roll[2], pitch[2], yaw[2]))


@kernel
def quintic(t, duration):
    """Rest-to-rest profile s, s_dot, s_ddot of s = 10 x^3 - 15 x^4 + 6 x^5, x = t / duration in [0, 1]."""
    x = t / duration
    if x <= 0.0:
        return 0.0, 0.0, 0.0
    if x >= 1.0:
        return 1.0, 0.0, 0.0
    return (x * x * x * (10.0 + x * (6.0 * x - 15.0)),
            30.0 * x * x * (1.0 - x) * (1.0 - x) / duration,
            60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (duration * duration))


@kernel
def slew_reference(p, t, joints):
    """Rest-to-rest slew from p.begin to p.target in p.duration [s]: base about one axis, joints straight, both by
    `quintic`."""
    s, rate, acceleration = quintic(t, p.duration)
    for i in range(joints.shape[1]):
        way = p.target[3 + i] - p.begin[3 + i]
        joints[0, i], joints[1, i], joints[2, i] = p.begin[3 + i] + s * way, rate * way, acceleration * way
    start = euler_quaternion(vec3(p.begin[0:3]))
    turn = rotation_vector(conjugate(start) * euler_quaternion(vec3(p.target[0:3])))
    return Desired(start * quaternion_from_rotation_vector(s * turn), rate * turn, acceleration * turn)


@kernel
def hold_within(p, joints):
    """Keep a desired joint motion inside [p.lower, p.upper] [rad]: at a bound it rests there. Returns the joints held."""
    held = 0
    for i in range(joints.shape[1]):
        if not (p.lower[i] <= joints[0, i] <= p.upper[i]):
            joints[0, i] = p.lower[i] if joints[0, i] < p.lower[i] else p.upper[i]
            joints[1, i] = joints[2, i] = 0.0
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
