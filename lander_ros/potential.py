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
"""

import math

from flight_graph.kernel import kernel
from lander_ros.constraints import clearance, view_cosine, view_cosine_twistor, view_gradient_printed, view_gradients
from lander_ros.rotation import to_body
from lander_ros.twistor import pose_from_twistor
from lander_ros.twistor_kinematics import position_jacobian


@kernel
def pull(r_squared, k_t, delta):
    """U_t [J] and its slope: grad U_t = slope r^D, slope [N/m], at r^2 [m^2]; k_t [N/m], delta [m]."""
    root = math.sqrt(1.0 + r_squared / (delta * delta))
    return k_t * delta * delta * (root - 1.0), k_t / root


@kernel
def terrain_barrier(r_squared, d, k_1, r_1, d_floor):
    """U_1 [J], its slope along r^D [N/m] and its slope along grad d [N]: grad U_1 = slope_r r^D + slope_d grad d.

    k_1 [J m]; r_1, d, d_floor [m].
    """
    r4 = r_squared * r_squared
    low = r4 + r_1 * r_1 * r_1 * r_1
    if low == 0.0:
        return 0.0, 0.0, 0.0
    w = r4 / low
    gap = max(d, d_floor)
    slope_r = k_1 * 4.0 * r_squared * (r_1 * r_1 * r_1 * r_1) / (low * low) / gap
    return k_1 * w / gap, slope_r, -k_1 * w / (gap * gap)


@kernel
def view_barrier(r_squared, c, k_2, r_2, r_off, c_m, c_floor):
    """U_2 [J], its slope along r^D [N/m] and dU_2/dc [J]: grad U_2 = slope_r r^D + dU_2/dc grad c; 0 inside r_off."""
    if r_squared <= r_off * r_off:
        return 0.0, 0.0, 0.0
    low = r_squared + r_2 * r_2
    s = (r_squared - r_off * r_off) / low
    gap = max(c - c_m, c_floor)
    phi = (1.0 - c) / gap
    slope_r = k_2 * 4.0 * s * (r_2 * r_2 + r_off * r_off) / (low * low) * phi
    return k_2 * s * s * phi, slope_r, -k_2 * s * s * (1.0 - c_m) / (gap * gap)


@kernel
def potential(p, r, q, work, gradient):
    """(U_t, U_r, U_1, U_2) [J], d [m] and c [-] at the pose r^D (3,), q (4,); the law's form of the gradient.

    ``gradient`` (6,) receives (1/4) Gamma dU/dB without the zero slots: torque-conjugate [N m], force-conjugate [N],
    both in B. ``work`` is (3, 3). ``p`` has the fields of `lander_ros.landing_law.LandingLaw`.
    """
    r_squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    c_m = math.cos(p.view_half_angle)
    sign = 1.0
    if q[3] < 0.0:
        sign = -1.0
    scale = sign / (1.0 + sign * q[3])
    b1, b2, b3 = q[0] * scale, q[1] * scale, q[2] * scale
    b_squared = b1 * b1 + b2 * b2 + b3 * b3
    d = clearance(
        r, p.funnel_alpha, p.funnel_beta, p.funnel_gamma, p.funnel_rho_0, p.funnel_z_0, work[0]
    )
    u_t, slope_t = pull(r_squared, p.pull_gain, p.pull_radius)
    u_1, slope_1, by_d = terrain_barrier(r_squared, d, p.terrain_gain, p.terrain_radius, p.clearance_floor)
    if r_squared > 0.0:
        c = view_gradients(r, q, work[1], work[2])
    else:
        c = view_cosine(r, q)
        for i in range(3):
            work[1, i] = 0.0
            work[2, i] = 0.0
    u_2, slope_2, by_c = view_barrier(
        r_squared, c, p.view_gain, p.view_radius, p.view_cutoff_radius, c_m, p.view_floor
    )
    slope = slope_t + slope_1 + slope_2
    gradient[3], gradient[4], gradient[5] = to_body(
        q,
        slope * r[0] + by_d * work[0, 0] + by_c * work[1, 0],
        slope * r[1] + by_d * work[0, 1] + by_c * work[1, 1],
        slope * r[2] + by_d * work[0, 2] + by_c * work[1, 2],
    )
    turn = 0.25 * p.attitude_gain * (1.0 + b_squared)
    gradient[0] = turn * b1 + by_c * work[2, 0]
    gradient[1] = turn * b2 + by_c * work[2, 1]
    gradient[2] = turn * b3 + by_c * work[2, 2]
    return u_t, 0.5 * p.attitude_gain * b_squared, u_1, u_2, d, c


@kernel
def potential_gradient_twistor(p, twistor, jacobian, work, out):
    """dU/dB, to (8,), by the paper's way: the printed Jacobian of r^D, eq. (52), and the printed gradient of f2.

    ``twistor`` (8,) is short-way, b' not 0; ``jacobian`` (8, 3) and ``work`` (2, 8) are work. Returns U [J].
    (1/4) Gamma dU/dB (`twistor_kinematics.conjugate_wrench`) equals the gradient of `potential`.
    """
    r, q = work[0, 0:3], work[0, 4:8]
    by_r = work[1, 0:3]
    pose_from_twistor(twistor, r, q)
    r_squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    d = clearance(
        r, p.funnel_alpha, p.funnel_beta, p.funnel_gamma, p.funnel_rho_0, p.funnel_z_0, by_r
    )
    c = view_cosine_twistor(twistor)
    u_t, slope_t = pull(r_squared, p.pull_gain, p.pull_radius)
    u_1, slope_1, by_d = terrain_barrier(r_squared, d, p.terrain_gain, p.terrain_radius, p.clearance_floor)
    u_2, slope_2, by_c = view_barrier(
        r_squared,
        c,
        p.view_gain,
        p.view_radius,
        p.view_cutoff_radius,
        math.cos(p.view_half_angle),
        p.view_floor,
    )
    slope = slope_t + slope_1 + slope_2
    for j in range(3):
        by_r[j] = slope * r[j] + by_d * by_r[j]
    position_jacobian(twistor, jacobian)
    view_gradient_printed(twistor, out)
    for i in range(8):
        out[i] = by_c * out[i] + jacobian[i, 0] * by_r[0] + jacobian[i, 1] * by_r[1] + jacobian[i, 2] * by_r[2]
    b_squared = 0.0
    for i in range(3):
        out[i] += p.attitude_gain * twistor[i]
        b_squared += twistor[i] * twistor[i]
    return u_t + 0.5 * p.attitude_gain * b_squared + u_1 + u_2
