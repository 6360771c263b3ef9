"""The Cubli rover free of its corner: flying, and sliding on it.

The cube is rigid with its centre of mass at the centre, moment of inertia I = m l^2 / 6 about any axis through it
(wheels locked), and wheels of axial inertia J_w. With j = I - J_w, r = -l/2 [1, 1, 1] the arm from the centre to the
corner (body frame) and F the ground's force on that corner, Newton and Euler give

    m a = m g + F,   j omega' = u + M_d + r x F - omega x (I omega + J_w Omega),   Omega' = -u / J_w - omega',

so the corner accelerates with a_0 + W F: a_0 if nothing held it, W F = F / m - r x (r x F) / j. *Flying*: F = 0.
*Sliding* along the unit vector s with friction coefficient mu: F = N (n - mu s), and N keeps the corner in the plane:
N = -n.a_0 / n.W(n - mu s). The disturbance M_d is a pure torque. An inertia of the user's own is a full
matrix in the place of I, and j then one too. (Standing needs none of this: its state is about the
corner, `sim_nodes.cubli.dynamics`; the force that holds it is m (a - g).)

A motion is (q, omega, Omega, position, velocity): attitude (body to balance frame), body rates and wheel speeds [rad/s],
position [m] and velocity [m/s] of the centre in the site frame: x east, y north, z up against gravity, origin where the
corner stood first. There g(x) = (0, 0, -g) + gradient x, and the site turns with `spin`, which gives the centre a Coriolis
acceleration (the turning of the axes themselves, milliradians in a run, is left out). p, x: parameters and state of
`sim_nodes.cubli.physical_plant`; normal: the ground's; attitudes called q are body to balance frame, those called turned
body to site frame.
"""

import math

from cubli_ros.jump_condition import centre_acceleration
from flight_math import (
    Vec3,
    cross,
    diagonal,
    inverse,
    kernel,
    maximum,
    normalised,
    quaternion_rates,
    rk4_between,
    rotate,
    rotate_back,
    same,
)
from sim_nodes.cubli import dynamics
from sim_nodes.cubli.dynamics import centre_inertia, pushes
from sim_nodes.cubli.plant import SITE_FROM_BALANCE

SLIDING = 1  # mode, see `sim_nodes.cubli.contact_events`
JAM = 1e-6  # [-] of W_nn: below it friction brakes the corner harder than it can be pressed down (Painleve)


@kernel
def local_gravity(p, position, velocity):
    """Gravity and Coriolis acceleration of the centre [m/s^2], site frame."""
    return p.gravity_gradient @ position - 2.0 * cross(p.spin, velocity) + Vec3(0.0, 0.0, -p.gravity)


@kernel
def turning_inertia(p):
    """j = I - J_w [kg m^2]."""
    return centre_inertia(p) - p.wheel_inertia


@kernel
def turned_by(p, moment):
    """omega' [rad/s^2] of the body by a moment [N m] about its centre, body frame."""
    if dynamics.has_own_inertia(p):
        return inverse(p.body_inertia - diagonal(same(p.wheel_inertia))) @ moment
    return moment / turning_inertia(p)


@kernel
def free_acceleration(p, torque, push, motion):
    """omega' [rad/s^2] and the centre's acceleration [m/s^2] without a ground; torque u and push M_d [N m]."""
    _, omega, wheel_speed, position, velocity = motion
    momentum = p.wheel_inertia * wheel_speed
    if dynamics.has_own_inertia(p):
        momentum += p.body_inertia @ omega
    moment = torque + push - cross(omega, momentum)
    return turned_by(p, moment), local_gravity(p, position, velocity)


@kernel
def corner_acceleration(p, turned, omega, omega_dot, acceleration):
    """Acceleration of the corner [m/s^2], site frame, from the centre's."""
    return acceleration - rotate(turned, centre_acceleration(omega, omega_dot, p.length))


@kernel
def push_corner(p, turned, force):
    """W F [m/s^2]: acceleration of the corner by a force [N] on it, both in the site frame."""
    if dynamics.has_own_inertia(p):
        arm = same(-0.5 * p.length)
        return force / p.mass - rotate(turned, cross(arm, turned_by(p, cross(arm, rotate_back(turned, force)))))
    r = rotate(turned, same(-0.5 * p.length))
    return force / p.mass - cross(r, cross(r, force)) / turning_inertia(p)


@kernel
def sliding_force(p, turned, corner, normal, slide):
    """Normal force N [N] of the sliding corner; negative: it lifts off. NaN where it jams.

    corner: its acceleration a_0 [m/s^2] without a ground; unit vectors normal n and slide s; site frame.
    """
    give = normal @ push_corner(p, turned, normal - p.friction * slide)
    return -(normal @ corner) / give if give >= JAM / p.mass else math.nan


@kernel
def moving_rates(held, push, motion):
    """Derivative of the motion of the flying or sliding rover; held: p, x, the ground's normal; push: M_d [N m]."""
    p, x, normal = held
    q, omega, _, _, velocity = motion
    omega_dot, acceleration = free_acceleration(p, x.torque, push, motion)
    if x.mode == SLIDING:
        turned = SITE_FROM_BALANCE * q
        corner = corner_acceleration(p, turned, omega, omega_dot, acceleration)
        force = maximum(0.0, sliding_force(p, turned, corner, normal, x.slide)) * (normal - p.friction * x.slide)
        omega_dot += turned_by(p, cross(same(-0.5 * p.length), rotate_back(turned, force)))
        acceleration += force / p.mass
    return quaternion_rates(q, omega), omega_dot, -x.torque / p.wheel_inertia - omega_dot, velocity, acceleration


@kernel
def moving_step(held, t, h, motion):
    """The motion one step of h [s] after t [s]; the quaternion is normalised."""
    q, omega, wheel_speed, position, velocity = rk4_between(moving_rates, held, pushes(held[0], t, h), motion, h)
    return normalised(q), omega, wheel_speed, position, velocity


@kernel
def corner_motion(p, number, motion):
    """Position [m] and velocity [m/s] of corner 0-7, site frame; bit i of its number: far side along axis i."""
    q, omega, _, position, velocity = motion
    half = 0.5 * p.length
    arm = Vec3(half if number & 1 else -half, half if number & 2 else -half, half if number & 4 else -half)
    turned = SITE_FROM_BALANCE * q
    return position + rotate(turned, arm), velocity + rotate(turned, cross(omega, arm))


@kernel
def standing_at(p, q, omega, anchor):
    """Position [m] and velocity [m/s] of the centre where the corner stands at anchor [m], at rest; site frame."""
    turned, arm = SITE_FROM_BALANCE * q, same(0.5 * p.length)
    return anchor + rotate(turned, arm), rotate(turned, cross(omega, arm))
