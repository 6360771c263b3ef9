"""Backstepping attitude control of the Cubli rover: the paper's second baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which names the law but gives neither equation nor gains. With
e' = G omega and V = e.e / 2 + |omega - alpha|^2 / 2 the standard two steps give

    alpha = -G^-1 c1 e,   u = I (-G^T e - c2 (omega - alpha) + alpha') - M_g,   V' = -c1 |e|^2 - c2 |omega - alpha|^2.

c1 = 1 1/s, c2 = 2 1/s make the figures' shape.
"""

from cubli_ros.attitude import body_rates, cardan_rates
from flight_math import Vec3, kernel


@kernel
def changing_body_rates(turn, rates, v):
    """(d/dt G^-1) v at the Cardan angle rates [rad/s]."""
    sine, cosine = turn
    return Vec3(
        (-sine.y * cosine.z * rates.y - cosine.y * sine.z * rates.z) * v.x + cosine.z * rates.z * v.y,
        (sine.y * sine.z * rates.y - cosine.y * cosine.z * rates.z) * v.x - sine.z * rates.z * v.y,
        cosine.y * rates.y * v.x)


@kernel
def transposed_cardan_rates(turn, v):
    """G^T v"""
    sine, cosine = turn
    first = (v.x - sine.y * v.z) / cosine.y
    return Vec3(cosine.z * first + sine.z * v.y, -sine.z * first + cosine.z * v.y, v.z)


@kernel
def backstepping(p, turn, error, omega):
    """Virtual rate alpha [rad/s] and the acceleration (u + M_g) / I [rad/s^2] of the law above.

    turn: sincos of the angles; error e [rad] of the angles; omega [rad/s]; p.c1, p.c2 [1/s].
    """
    alpha = -p.c1 * body_rates(turn, error)
    # G^-1 e' = omega
    alpha_slope = -p.c1 * (changing_body_rates(turn, cardan_rates(turn, omega), error) + omega)
    return alpha, alpha_slope - transposed_cardan_rates(turn, error) - p.c2 * (omega - alpha)
