"""The two path constraints of the landing: clearance over the terrain, and the site in the camera's view.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix A.

Printed: the gradient of f1, eq. (53), and the gradient of f2 with respect to the twistor, Appendix A (2). They fix
f1 = k_f1 { [alpha (x^2 + beta y^2)]^gamma - z } and f2 = r^B_z / |r^B|, each up to a constant.
Ours (not in the public text): the constants, the safe signs, the rounding rho_0 of the funnel's tip, the offset z_0.
  clearance  d = z + z_0 - g(x, y),  g = [alpha (x^2 + beta y^2 + rho_0^2)]^gamma - [alpha rho_0^2]^gamma,  safe: d > 0
             (f1 = -d with k_f1 = 1; rho_0 = z_0 = 0 is the printed form)
  view       c = r^B_z / |r|, the cosine between the boresight -z_B and the line of sight from B to the site,
             safe: c > cos(half angle of the view cone); the sign is the other way round than for f1.
(x, y, z) = r^D, from the landing site D to the spacecraft B, z_D along the outward normal. q: attitude, B to D.
p: any record with the fields funnel_alpha [m^(1/gamma - 2)], funnel_beta, funnel_gamma [-], funnel_rho_0, funnel_z_0 [m].
"""

import math

from flight_math import DualVector, Vec3, acos, clip, dot, kernel, norm, power, rotate, rotate_back


@kernel
def funnel_height(p, x, y):
    """g(x, y) [m]: height of the keep-out surface, 0 on the axis."""
    rounding = p.funnel_rho_0 * p.funnel_rho_0
    base = p.funnel_alpha * (x * x + p.funnel_beta * y * y + rounding)
    return power(base, p.funnel_gamma) - power(p.funnel_alpha * rounding, p.funnel_gamma)


@kernel
def clearance(p, r):
    """d [m] = z + z_0 - g(x, y) at r^D [m]. Ours; f1 = -d for k_f1 = 1."""
    return r.z + p.funnel_z_0 - funnel_height(p, r.x, r.y)


@kernel
def clearance_gradient(p, r):
    """dd/dr^D. With rho_0 = 0 and gamma < 1/2 it is infinite on the axis: there x and y components are given as 0."""
    base = p.funnel_alpha * (r.x * r.x + p.funnel_beta * r.y * r.y + p.funnel_rho_0 * p.funnel_rho_0)
    slope = 2.0 * p.funnel_alpha * p.funnel_gamma * power(base, p.funnel_gamma - 1.0) if base > 0.0 else 0.0
    return Vec3(-slope * r.x, -p.funnel_beta * slope * r.y, 1.0)


@kernel
def terrain_gradient_printed(p, k_f1, r):
    """df1/dr^D, eq. (53) as printed (its y_D, x_D read y_BD^D, x_BD^D). Singular on the axis, gamma < 1/2."""
    slope = power(p.funnel_alpha * (r.x * r.x + p.funnel_beta * r.y * r.y), p.funnel_gamma - 1.0)
    return Vec3(2.0 * k_f1 * p.funnel_alpha * p.funnel_gamma * r.x * slope,
                2.0 * k_f1 * p.funnel_alpha * p.funnel_beta * p.funnel_gamma * r.y * slope,
                -k_f1)


@kernel
def view_cosine(r, q):
    """c [-] = r^B_z / |r| of r^D [m]: 1 with the site on boresight. At r = 0 there is no direction, and 1 is given."""
    distance = norm(r)
    return rotate_back(q, r).z / distance if distance > 0.0 else 1.0


@kernel
def view_angle(c):
    """Angle [rad] between the boresight -z_B and the line of sight, of its cosine c."""
    return acos(clip(c, -1.0, 1.0))


@kernel
def view_gradients(r, q):
    """c [-], its gradient dc/dr^D [1/m] in D, and its torque-conjugate gradient in B [-]; r is not 0.

    dc/dt = (z_B^D - c rhat)/|r| . d(r^D)/dt + (e_3 x rhat^B) . w.
    """
    distance = norm(r)
    direction = rotate_back(q, r) / distance
    c = direction.z
    by_position = (rotate(q, Vec3(0.0, 0.0, 1.0)) - c * r / distance) / distance
    return c, by_position, Vec3(-direction.y, direction.x, 0.0)


@kernel
def view_cosine_twistor(twistor):
    """c [-] of a twistor: [2(b1 b3 + b2) b5 + 2(b2 b3 - b1) b6 + (1 - b1^2 - b2^2 + b3^2) b7] / (S |b'|)."""
    b, d = twistor.real, twistor.dual
    lowered = Vec3(2.0 * (b.x * b.z + b.y), 2.0 * (b.y * b.z - b.x), 1.0 - b.x * b.x - b.y * b.y + b.z * b.z)
    return dot(lowered, d) / ((1.0 + dot(b, b)) * norm(d))


@kernel
def view_gradient_printed(twistor):
    """df2/dB, Appendix A (2) as printed: the gradient of `view_cosine_twistor`; rows 4 and 8 are 0. Singular at b' = 0."""
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    b5, b6, b7 = twistor.dual.x, twistor.dual.y, twistor.dual.z
    q1, q2, q3 = b1 * b1, b2 * b2, b3 * b3
    s = q1 + q2 + q3 + 1.0
    squares = b5 * b5 + b6 * b6 + b7 * b7
    root = math.sqrt(squares / (s * s))
    by_b = -2.0 / (s * s * s * root) * Vec3(
        (b3 * b5 - b6) * q1
        + 2.0 * (b7 * q3 + b2 * b6 * b3 + b2 * b5 + b7) * b1
        - (q2 + q3 + 1.0) * (b3 * b5 - b6),
        (b5 + b3 * b6) * q2
        + 2.0 * (b7 * q3 + b1 * b5 * b3 - b1 * b6 + b7) * b2
        - (q1 + q3 + 1.0) * (b5 + b3 * b6),
        (b1 * b5 + b2 * b6) * q3
        - 2.0 * (b7 * q2 - b2 * b5 + b1 * (b6 + b1 * b7)) * b3
        - (q1 + q2 + 1.0) * (b1 * b5 + b2 * b6))
    by_d = root / (squares * squares) * Vec3(
        b5 * b7 * q1
        + 2.0 * (b5 * b6 + b3 * (b6 * b6 + b7 * b7)) * b1
        + q2 * b5 * b7
        - (q3 + 1.0) * b5 * b7
        + 2.0 * b2 * (b6 * b6 - b3 * b5 * b6 + b7 * b7),
        b6 * b7 * q1
        - 2.0 * (b5 * b5 + b3 * b6 * b5 + b7 * b7) * b1
        + q2 * b6 * b7
        - (q3 + 1.0) * b6 * b7
        + 2.0 * b2 * (b3 * (b5 * b5 + b7 * b7) - b5 * b6),
        -(q1 + q2 - q3 - 1.0) * b5 * b5
        - 2.0 * (b2 + b1 * b3) * b7 * b5
        - b6 * ((q1 + q2 - q3 - 1.0) * b6 - 2.0 * (b1 - b2 * b3) * b7))
    return DualVector(by_b, by_d)
