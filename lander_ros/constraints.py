"""The two path constraints of the landing: clearance over the terrain, and the site in the camera's view.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix A.

Printed: the gradient of f1, eq. (53), and the gradient of f2 with respect to the twistor, Appendix A (2). They fix
f1 = k_f1 { [alpha (x^2 + beta y^2)]^gamma - z } and f2 = r^B_z / |r^B|, each up to a constant.
Ours (not in the public text): the constants, the safe signs, the rounding rho_0 of the funnel's tip, the offset z_0.
  clearance  d = z + z_0 - g(x, y),  g = [alpha (x^2 + beta y^2 + rho_0^2)]^gamma - [alpha rho_0^2]^gamma,  safe: d > 0
             (f1 = -d with k_f1 = 1; rho_0 = z_0 = 0 is the printed form)
  view       c = r^B_z / |r|, the cosine between the boresight -z_B and the line of sight from B to the site,
             safe: c > cos(half angle of the view cone); the sign is the other way round than for f1.
(x, y, z) = r^D, from the landing site D to the spacecraft B, z_D along the outward normal.
"""

import math

from flight_graph.kernel import kernel
from lander_ros.rotation import to_body, to_site


@kernel
def funnel_height(x, y, alpha, beta, gamma, rho_0):
    """g(x, y) [m]: height of the keep-out surface, 0 on the axis. alpha [m^(1/gamma - 2)], rho_0 [m]; others [-]."""
    base = alpha * (x * x + beta * y * y + rho_0 * rho_0)
    tip = alpha * rho_0 * rho_0
    height = math.pow(base, gamma) if base > 0.0 else 0.0
    if tip > 0.0:
        height -= math.pow(tip, gamma)
    return height


@kernel
def clearance(r, alpha, beta, gamma, rho_0, z_0, gradient):
    """d [m] = z + z_0 - g(x, y) at r^D (3,) [m]; ``gradient`` (3,) receives dd/dr^D. Ours; f1 = -d for k_f1 = 1.

    With rho_0 = 0 and gamma < 1/2 the gradient is infinite on the axis: there the x and y components are given as 0.
    """
    x, y, z = r[0], r[1], r[2]
    base = alpha * (x * x + beta * y * y + rho_0 * rho_0)
    slope = 0.0
    if base > 0.0:
        slope = 2.0 * alpha * gamma * math.pow(base, gamma - 1.0)
    gradient[0] = -slope * x
    gradient[1] = -beta * slope * y
    gradient[2] = 1.0
    return z + z_0 - funnel_height(x, y, alpha, beta, gamma, rho_0)


@kernel
def terrain_gradient_printed(r, alpha, beta, gamma, k_f1, out):
    """df1/dr^D, to (3,), eq. (53) as printed (its y_D, x_D read y_BD^D, x_BD^D). Singular on the axis, gamma < 1/2."""
    x, y = r[0], r[1]
    power = math.pow(alpha * (x * x + beta * y * y), gamma - 1.0)
    out[0] = 2.0 * k_f1 * alpha * gamma * x * power
    out[1] = 2.0 * k_f1 * alpha * beta * gamma * y * power
    out[2] = -k_f1


@kernel
def view_cosine(r, q):
    """c [-] = r^B_z / |r| of the position r^D (3,) [m] and attitude q (4,), x, y, z, w: 1 with the site on boresight.

    At r = 0 the direction is undefined and 1 is given.
    """
    distance = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    if distance == 0.0:
        return 1.0
    _, _, along = to_body(q, r[0], r[1], r[2])
    return along / distance


@kernel
def view_gradients(r, q, by_position, by_rotation):
    """c, with its gradients: ``by_position`` (3,) dc/dr^D [1/m] in D, ``by_rotation`` (3,) torque-conjugate in B [-].

    dc/dt = by_position . d(r^D)/dt + by_rotation . w,  by_position = (z_B^D - c rhat)/|r|,  by_rotation = e_3 x rhat^B.
    The caller keeps r away from 0.
    """
    distance = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    x, y, z = to_body(q, r[0], r[1], r[2])
    c = z / distance
    up_x, up_y, up_z = to_site(q, 0.0, 0.0, 1.0)
    by_position[0] = (up_x - c * r[0] / distance) / distance
    by_position[1] = (up_y - c * r[1] / distance) / distance
    by_position[2] = (up_z - c * r[2] / distance) / distance
    by_rotation[0] = -y / distance
    by_rotation[1] = x / distance
    by_rotation[2] = 0.0
    return c


@kernel
def view_cosine_twistor(twistor):
    """c [-] of a twistor (8,): [2(b1 b3 + b2) b5 + 2(b2 b3 - b1) b6 + (1 - b1^2 - b2^2 + b3^2) b7] / (S |b'|)."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    b5, b6, b7 = twistor[4], twistor[5], twistor[6]
    s = 1.0 + b1 * b1 + b2 * b2 + b3 * b3
    top = (
        2.0 * (b1 * b3 + b2) * b5 + 2.0 * (b2 * b3 - b1) * b6 + (1.0 - b1 * b1 - b2 * b2 + b3 * b3) * b7
    )
    return top / (s * math.sqrt(b5 * b5 + b6 * b6 + b7 * b7))


@kernel
def view_gradient_printed(twistor, out):
    """df2/dB, to (8,), Appendix A (2) as printed: the gradient of `view_cosine_twistor`. Singular at b' = 0."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    b5, b6, b7 = twistor[4], twistor[5], twistor[6]
    q1, q2, q3 = b1 * b1, b2 * b2, b3 * b3
    s = q1 + q2 + q3 + 1.0
    squares = b5 * b5 + b6 * b6 + b7 * b7
    root = math.sqrt(squares / (s * s))
    low = s * s * s * root
    high = root / (squares * squares)
    out[0] = -2.0 * (
        (b3 * b5 - b6) * q1
        + 2.0 * (b7 * q3 + b2 * b6 * b3 + b2 * b5 + b7) * b1
        - (q2 + q3 + 1.0) * (b3 * b5 - b6)
    ) / low
    out[1] = -2.0 * (
        (b5 + b3 * b6) * q2
        + 2.0 * (b7 * q3 + b1 * b5 * b3 - b1 * b6 + b7) * b2
        - (q1 + q3 + 1.0) * (b5 + b3 * b6)
    ) / low
    out[2] = -2.0 * (
        (b1 * b5 + b2 * b6) * q3
        - 2.0 * (b7 * q2 - b2 * b5 + b1 * (b6 + b1 * b7)) * b3
        - (q1 + q2 + 1.0) * (b1 * b5 + b2 * b6)
    ) / low
    out[3] = 0.0
    out[4] = high * (
        b5 * b7 * q1
        + 2.0 * (b5 * b6 + b3 * (b6 * b6 + b7 * b7)) * b1
        + q2 * b5 * b7
        - (q3 + 1.0) * b5 * b7
        + 2.0 * b2 * (b6 * b6 - b3 * b5 * b6 + b7 * b7)
    )
    out[5] = high * (
        b6 * b7 * q1
        - 2.0 * (b5 * b5 + b3 * b6 * b5 + b7 * b7) * b1
        + q2 * b6 * b7
        - (q3 + 1.0) * b6 * b7
        + 2.0 * b2 * (b3 * (b5 * b5 + b7 * b7) - b5 * b6)
    )
    out[6] = -high * (
        (q1 + q2 - q3 - 1.0) * b5 * b5
        + 2.0 * (b2 + b1 * b3) * b7 * b5
        + b6 * ((q1 + q2 - q3 - 1.0) * b6 - 2.0 * (b1 - b2 * b3) * b7)
    )
    out[7] = 0.0
