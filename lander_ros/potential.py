"""The artificial potential of the landing: a bounded pull, an attitude term, and two goal-weighted barriers.

The paper (Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020)) encodes its constraints into a potential U(B) whose
form is not in the public text: the terms below are ours. With r = |r^D|, b the short-way twistor, d and c of
`lander_ros.constraints`, c_m = cos(view_half_angle):

  U_t = k_t delta^2 (sqrt(1 + r^2/delta^2) - 1)                     pull, never above k_t delta
  U_r = (1/2) k_b |b|^2                                             attitude
  U_1 = K_1 w_1 / d,                w_1 = r^4/(r^4 + r_1^4)         terrain barrier
  U_2 = k_2 w_2 (1 - c)/(c - c_m),  w_2 = s^2,  s = max(r^2 - r_off^2, 0)/(r^2 + r_2^2)   view barrier

U >= 0, U = 0 only at the goal, and grad U = 0 there, because w_1 and w_2 vanish at the goal. terrain_radius r_1 = 0
gives the naive barrier w_1 = 1, which hovers above the site for ever. Where d or c - c_m is below its floor the barrier
is evaluated at the floor: finite, and still pushing inward.
p: the fields of `lander_ros.landing_law.LandingLaw`.
"""

import math

from flight_math import DualVector, Vec3, cos, dot, kernel, rotate_back, short_way, vector_part
from lander_ros.constraints import (
    clearance,
    clearance_gradient,
    view_cosine_twistor,
    view_gradient_printed,
    view_gradients,
)
from lander_ros.twistor import pose_from_twistor
from lander_ros.twistor_kinematics import position_jacobian


@kernel
def pull(p, r_squared):
    """U_t [J] and its slope [N/m] at r^2 [m^2]: grad U_t = slope r^D."""
    delta = p.pull_radius
    root = math.sqrt(1.0 + r_squared / (delta * delta))
    return p.pull_gain * delta * delta * (root - 1.0), p.pull_gain / root


@kernel
def terrain_barrier(p, r_squared, d):
    """U_1 [J], its slope along r^D [N/m] and along grad d [N]: grad U_1 = slope_r r^D + slope_d grad d."""
    r4 = r_squared * r_squared
    r14 = p.terrain_radius * p.terrain_radius * p.terrain_radius * p.terrain_radius
    low = r4 + r14
    if low == 0.0:
        return 0.0, 0.0, 0.0
    w = r4 / low
    gap = max(d, p.clearance_floor)
    slope_r = p.terrain_gain * 4.0 * r_squared * r14 / (low * low) / gap
    return p.terrain_gain * w / gap, slope_r, -p.terrain_gain * w / (gap * gap)


@kernel
def view_barrier(p, r_squared, c):
    """U_2 [J], its slope along r^D [N/m] and dU_2/dc [J]: grad U_2 = slope_r r^D + dU_2/dc grad c; 0 inside r_off."""
    off_squared = p.view_cutoff_radius * p.view_cutoff_radius
    if r_squared <= off_squared:
        return 0.0, 0.0, 0.0
    c_m = cos(p.view_half_angle)
    r2_squared = p.view_radius * p.view_radius
    low = r_squared + r2_squared
    s = (r_squared - off_squared) / low
    gap = max(c - c_m, p.view_floor)
    phi = (1.0 - c) / gap
    slope_r = p.view_gain * 4.0 * s * (r2_squared + off_squared) / (low * low) * phi
    return p.view_gain * s * s * phi, slope_r, -p.view_gain * s * s * (1.0 - c_m) / (gap * gap)


@kernel
def potential(p, r, q):
    """(U_t, U_r, U_1, U_2) [J], d [m] and c [-] at the pose r^D, q, and the law's form of the gradient.

    The gradient is G = G_w + eps G_a = (1/4) Gamma dU/dB, in B: torque-conjugate [N m], force-conjugate [N].
    """
    r_squared = dot(r, r)
    short = short_way(q)
    b = vector_part(short) / (1.0 + short.w)
    b_squared = dot(b, b)
    d, by_place = clearance(p, r), clearance_gradient(p, r)
    c, by_position, by_rotation = 1.0, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    if r_squared > 0.0:
        c, by_position, by_rotation = view_gradients(r, q)
    u_t, slope_t = pull(p, r_squared)
    u_1, slope_1, by_d = terrain_barrier(p, r_squared, d)
    u_2, slope_2, by_c = view_barrier(p, r_squared, c)
    force = rotate_back(q, (slope_t + slope_1 + slope_2) * r + by_d * by_place + by_c * by_position)
    torque = 0.25 * p.attitude_gain * (1.0 + b_squared) * b + by_c * by_rotation
    return (u_t, 0.5 * p.attitude_gain * b_squared, u_1, u_2), d, c, DualVector(torque, force)


@kernel
def potential_gradient_twistor(p, twistor):
    """U [J] and dU/dB by the paper's way: the printed Jacobian of r^D, eq. (52), and the printed gradient of f2.

    The twistor is short-way, its b' not 0. (1/4) Gamma dU/dB (`twistor_kinematics.conjugate_wrench`) equals the
    gradient of `potential`.
    """
    r, _ = pose_from_twistor(twistor)
    r_squared = dot(r, r)
    d, c = clearance(p, r), view_cosine_twistor(twistor)
    u_t, slope_t = pull(p, r_squared)
    u_1, slope_1, by_d = terrain_barrier(p, r_squared, d)
    u_2, slope_2, by_c = view_barrier(p, r_squared, c)
    by_r = (slope_t + slope_1 + slope_2) * r + by_d * clearance_gradient(p, r)
    by_b, by_dual = position_jacobian(twistor)
    gradient = by_c * view_gradient_printed(twistor)
    b = twistor.real
    energy = u_t + 0.5 * p.attitude_gain * dot(b, b) + u_1 + u_2
    return energy, gradient + DualVector(by_b @ by_r + p.attitude_gain * b, by_dual @ by_r)
