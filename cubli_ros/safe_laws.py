"""The laws of the rover's safe states, which need no more than a rate, and what a lost wheel leaves of them.

*Hold* kills the rates and keeps the attitude it was entered at, turned ever since by theta (rotation vector, by the
rates):

    u = -J (d omega + k theta)

Gravity does not enter: it pulls with at most m g r theta_tilt, which leans the rover by m g r sin(tilt) / (J k) more,
4 % of the tilt for k = 0.25 1/s^2 on g = 0.002 m/s^2. So hold works without any attitude.

*Rest* lets the rover down to the side it leans to, about the axis e (level, through the corner) at a rate w:

    u = J d (w e - omega)

Gravity ends it: J omega' = m g r sin(tilt) - J d (omega - w), a rate of w + m g r sin(tilt) / (J d) once the lag 1/d
has passed, which is slower than falling and touches down at l times it. If e points the wrong way, the rover goes
over the top and down on the other side. Once it lies still the wheels are braked, u = J_w b Omega, limited to a
torque that does not tip it: less than m g l / 2, gravity's about an edge of the face it lies on.

*A lost wheel* i leaves two torques for three axes. About e, across the diagonal and the lost axis e_i, they give what
the law wants: e has no part along e_i. Together they turn the rover about p = [1, 1, 1] - 3 e_i (to length one) and
about the diagonal d at once, tau_d = sqrt(2) tau_p, which is a cart and a pole: the lean theta_p falls over at the
rate l = sqrt(m g r / J_p), and the spin is the cart. With c = sqrt(2) J_p / J_d,

    theta_p'' = l^2 theta_p - a,  omega_d' = -c a,  a = k_1 theta_p + k_2 omega_p + k_3 omega_d,

has its three poles at -q for c k_3 = -q^3 / l^2, k_2 = 3 q - c k_3, k_1 = 3 q^2 + l^2. So without a wheel the rover
is upright about p and does not spin. That is for small leans, where a turn about the diagonal does not change the
lean; beyond `lost_wheel_lean` (its sine), on the way down, the two torques damp the spin with the rate d of rest, and
the lean about p is left to gravity.
"""

import math

from cubli_ros.sensor_admission import UP
from flight_math import Vec3, clip, cross, kernel, largest, maximum, norm, normalised


@kernel
def hold_torque(p, omega, turned):
    """Torque [N m] that kills the rates omega [rad/s] and brings back what the rover has turned [rad]."""
    return -(p.inertia @ (p.hold_damping * omega + p.hold_stiffness * turned))


@kernel
def rest_axis(level, lost):
    """Unit axis to let the rover down about: ``level``, or the nearer way of the one that needs no wheel ``lost``."""
    axis = level
    if lost >= 0:
        axis = cross(UP, axis_of(lost))
        axis = -axis if axis @ level < 0.0 else axis
    return normalised(axis)


@kernel
def rest_torque(p, omega, wanted):
    """Torque [N m] that lets the rover down at a wanted rate w e [rad/s]."""
    return p.inertia @ (p.rest_damping * (wanted - omega))


@kernel
def brake_torque(p, wheel_speed):
    """Torque [N m] on the body that brakes the wheels slowly: exponentially, and no faster than brake_limit allows."""
    return clip(p.wheel_inertia * p.brake_rate * wheel_speed, -p.brake_limit, p.brake_limit)


@kernel
def axis_of(wheel):
    """Unit vector of a wheel's axis, body frame."""
    return Vec3(1.0 if wheel == 0 else 0.0, 1.0 if wheel == 1 else 0.0, 1.0 if wheel == 2 else 0.0)


@kernel
def cart_gains(q, square, coupling):
    """k_1 [1/s^2], k_2 [1/s], k_3 [1/s] that put all three poles of cart and pole at -q [1/s]; square: l^2, coupling: c."""
    c_k_3 = -q * q * q / square
    return 3.0 * q * q + square, 3.0 * q - c_k_3, c_k_3 / coupling


@kernel
def without_wheel(p, torque, lost, omega, up):
    """Torques [N m] of the other wheels: the law's ``torque`` about e, and the cart's; up: unit vector, body frame."""
    missing = axis_of(lost)
    e, across = normalised(cross(UP, missing)), normalised(1.0 - 3.0 * missing)
    j_p, j_d = across @ (p.inertia @ across), UP @ (p.inertia @ UP)
    coupling = math.sqrt(2.0) * j_p / j_d
    if norm(cross(up, UP)) < p.lost_wheel_lean:
        square = p.mass * p.gravity * 0.5 * math.sqrt(3.0) * p.length / j_p
        k_1, k_2, k_3 = cart_gains(p.lost_wheel_rate, square, coupling)
        acceleration = k_1 * (cross(up, UP) @ across) + k_2 * (omega @ across) + k_3 * (omega @ UP)
    else:
        acceleration = p.rest_damping / coupling * (omega @ UP)
    return (torque @ e) * e - 0.5 * math.sqrt(6.0) * j_p * acceleration * (1.0 - missing)


@kernel
def within(torque, limit):
    """A torque with no axis beyond a limit [N m], in the same direction."""
    return torque * (limit / maximum(limit, largest(abs(torque))))
