"""Whether the rover stays on the ground: rate limits and the contact force at the corner it stands on.

Source: Aerospace 2022, 9(11), 728, section 3.2, equations (6)-(9); the three-dimensional case, which the paper gives
only in words, from the momentum balance of the cube about its corner.

Frames as in `cubli_ros.attitude`; the corner is at rest and r = l/2 [1, 1, 1] (body frame) leads from it to the centre
of mass. alpha is the angle between "up" (minus gravity) and the ground's normal, zero on level ground.
"""

import math

from flight_graph.kernel import kernel

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
def rate_norm(omega):
    """|omega| [rad/s]."""
    return math.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])


@kernel
def largest_axis_rate(omega):
    """max_i |omega_i| [rad/s]: what eq. (9) limits when it is read per axis."""
    largest = abs(omega[0])
    for i in range(1, 3):
        if abs(omega[i]) > largest:
            largest = abs(omega[i])
    return largest


@kernel
def rate_across_diagonal(omega):
    """|omega - (omega.d) d|, d = [1, 1, 1] / sqrt(3) [rad/s]: the part that moves the centre of mass."""
    mean = (omega[0] + omega[1] + omega[2]) / 3.0
    x = omega[0] - mean
    y = omega[1] - mean
    z = omega[2] - mean
    return math.sqrt(x * x + y * y + z * z)


@kernel
def cosine_of_tilt(gravity, normal):
    """cos(alpha) of up = -gravity (3,) and the ground's unit normal (3,), in one frame; 0 for no gravity."""
    size = math.sqrt(gravity[0] * gravity[0] + gravity[1] * gravity[1] + gravity[2] * gravity[2])
    if size == 0.0:
        return 0.0
    return -(gravity[0] * normal[0] + gravity[1] * normal[1] + gravity[2] * normal[2]) / size


@kernel
def centre_acceleration(omega, omega_dot, length):
    """Acceleration of the cube's centre, omega' x r + omega x (omega x r), body frame (three floats) [m/s^2]."""
    half = 0.5 * length
    v_x = half * (omega[1] - omega[2])
    v_y = half * (omega[2] - omega[0])
    v_z = half * (omega[0] - omega[1])
    return (
        half * (omega_dot[1] - omega_dot[2]) + omega[1] * v_z - omega[2] * v_y,
        half * (omega_dot[2] - omega_dot[0]) + omega[2] * v_x - omega[0] * v_z,
        half * (omega_dot[0] - omega_dot[1]) + omega[0] * v_y - omega[1] * v_x,
    )


@kernel
def contact(omega, omega_dot, gravity_body, normal_body, length):
    """Force of the ground on the corner: (normal force / (m g), tangential force / (m g), friction ratio).

    omega [rad/s], omega_dot [rad/s^2], gravity_body [m/s^2] and the ground's unit normal, all (3,) in the body frame.
    F / m = a - gravity with a the centre's acceleration. A negative normal force means the corner would have to be
    pulled: the rover leaves the ground. The friction ratio (needed friction coefficient) is LOST_CONTACT_RATIO then.
    """
    x, y, z = centre_acceleration(omega, omega_dot, length)
    x -= gravity_body[0]
    y -= gravity_body[1]
    z -= gravity_body[2]
    normal = x * normal_body[0] + y * normal_body[1] + z * normal_body[2]
    x -= normal * normal_body[0]
    y -= normal * normal_body[1]
    z -= normal * normal_body[2]
    tangential = math.sqrt(x * x + y * y + z * z)
    weight = math.sqrt(
        gravity_body[0] * gravity_body[0] + gravity_body[1] * gravity_body[1] + gravity_body[2] * gravity_body[2]
    )
    friction_ratio = LOST_CONTACT_RATIO
    if tangential < LOST_CONTACT_RATIO * normal:
        friction_ratio = tangential / normal
    return normal / weight, tangential / weight, friction_ratio
