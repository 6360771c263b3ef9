"""Whether the rover stays on the ground: rate limits and the contact force at the corner it stands on.

Source: Aerospace 2022, 9(11), 728, section 3.2, equations (6)-(9); the three-dimensional case, which the paper gives
only in words, from the momentum balance of the cube about its corner.

Frames as in `cubli_ros.attitude`; the corner is at rest and r = l/2 [1, 1, 1] (body frame) leads from it to the centre
of mass. alpha is the angle between "up" (minus gravity) and the ground's normal, zero on level ground.
"""

import math

from flight_math import cross, kernel, norm, same, total

LOST_CONTACT_RATIO = 1e6  # [-] friction ratio reported when nothing presses the corner down (kept finite for messages)


@kernel
def planar_rate_limit(gravity, length, cos_alpha):
    """Eq. (9), omega_9 = sqrt(sqrt(2) g cos(alpha) / l) [rad/s]: fastest planar rotation about an edge that stays down.

    gravity g [m/s^2], length l [m]; 0 where the ground is too steep to stand on.
    """
    if cos_alpha <= 0.0:
        return 0.0
    return math.sqrt(math.sqrt(2.0) * gravity * cos_alpha / length)


@kernel
def corner_rate_limit(gravity, length, cos_alpha):
    """omega_3D = sqrt(2 g cos(alpha) / (sqrt(3) l)) [rad/s]: the same about the corner, arm sqrt(3) l / 2.

    It limits the part of omega that is perpendicular to the body diagonal (`rate_across_diagonal`).
    """
    if cos_alpha <= 0.0:
        return 0.0
    return math.sqrt(2.0 * gravity * cos_alpha / (math.sqrt(3.0) * length))


@kernel
def rate_across_diagonal(omega):
    """|omega - (omega.d) d|, d = [1, 1, 1] / sqrt(3) [rad/s]: the part that moves the centre of mass."""
    return norm(omega - total(omega) / 3.0)


@kernel
def cosine_of_tilt(gravity, normal):
    """cos(alpha) of up = -gravity and the ground's unit normal, in one frame; 0 for no gravity."""
    size = norm(gravity)
    return -(gravity @ normal) / size if size > 0.0 else 0.0


@kernel
def centre_acceleration(omega, omega_dot, length):
    """Acceleration of the cube's centre, omega' x r + omega x (omega x r) [m/s^2]; r = l/2 [1, 1, 1]; body frame."""
    r = same(0.5 * length)
    return cross(omega_dot, r) + cross(omega, cross(omega, r))


@kernel
def contact(omega, omega_dot, gravity, normal, length):
    """Force of the ground on the corner: (normal force / (m g), tangential force / (m g), friction ratio).

    omega [rad/s], omega_dot [rad/s^2], gravity [m/s^2] and the ground's unit normal, all in the body frame. F / m = a -
    gravity with a the centre's acceleration. A negative normal force means the corner would have to be pulled: the rover
    leaves the ground. The friction ratio (needed friction coefficient) is LOST_CONTACT_RATIO then.
    """
    force = centre_acceleration(omega, omega_dot, length) - gravity
    along, across = split(force, normal)
    weight = norm(gravity)
    return along / weight, across / weight, friction_ratio(along, across)


@kernel
def split(vector, normal):
    """Sizes of a vector's part along a unit vector and across it."""
    along = vector @ normal
    return along, norm(vector - along * normal)


@kernel
def friction_ratio(along, across):
    """Tangential over normal force; LOST_CONTACT_RATIO where nothing presses the corner down."""
    return across / along if across < LOST_CONTACT_RATIO * along else LOST_CONTACT_RATIO


def largest_ratio(ratios) -> float | None:
    """The largest of friction ratios (n,); None where contact is lost at some time."""
    largest = float(ratios.max())
    return largest if largest < LOST_CONTACT_RATIO else None
