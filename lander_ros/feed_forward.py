"""What the lander's laws know of vehicle and body, and the feed-forward that both laws share.

  f_ff = -m g^B + m zeta x eta,  tau_ff = -tau_gg + zeta x J zeta,  zeta = R^T w_D,  eta = R^T [w_D x (rho_D + r)]

from -F_g + V_DI x M V_DI in the dual form of Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix B; the
numbers are ours. Gravity is a vector of the flight software's model, not the truth. D: landing-site frame; B: body.
"""

import math

import numpy as np

from flight_graph.components.records import Array, Parameters, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.vectors import cross, matrix_vector
from lander_ros.rotation import to_body

REFERENCE = "reference scenario (ours)"


class LanderModel(Parameters):
    """The vehicle and the landing site as the flight software believes them to be."""

    mass: float = field(500.0, unit="kg", gt=0, source=REFERENCE, doc="m")
    inertia: Array(3, 3) = field(
        [[120.0, 2.0, -3.0], [2.0, 100.0, 1.5], [-3.0, 1.5, 140.0]], unit="kg m^2", source=REFERENCE, doc="J, in B"
    )
    site_position: Vec3 = field(
        [-9793.067387644818, -3535.8859359770563, 7907.859038812286],
        unit="m",
        source=REFERENCE,
        doc="rho_D, from the body's centre to the landing site, in D",
    )
    site_spin: Vec3 = field(
        [0.0, 0.0002570616125008937, 0.00020878277451562036],
        unit="rad/s",
        source=REFERENCE,
        doc="w_D, spin of the small body, in D",
    )
    gravity_gradient_mu: float = field(
        0.0, unit="m^3/s^2", ge=0, source=REFERENCE, doc="mu of the gravity-gradient feed-forward; 0: none"
    )
    force_limit: float = field(40.0, unit="N", gt=0, source=REFERENCE, doc="clip of the force per body axis")
    torque_limit: float = field(10.0, unit="N m", gt=0, source=REFERENCE, doc="clip of the torque per body axis")


def site_in_landing_frame(rotation, position, spin) -> tuple[np.ndarray, np.ndarray]:
    """rho_D [m] and w_D [rad/s], both in D, of a goal pose in the body-fixed frame A.

    rotation (3, 3) is R_AD (D -> A, columns x_D, y_D, z_D), position (3,) [m] in A, spin [rad/s] about z_A.
    """
    rotation = np.asarray(rotation, dtype=float)
    position = np.asarray(position, dtype=float)
    return np.array([float(sum(rotation[:, i] * position)) for i in range(3)]), spin * rotation[2, :]


@kernel
def feed_forward(p, r, q, gravity):
    """f_ff [N] and tau_ff [N m], six numbers in B, at the pose r^D, q, for the model's gravity g^D (3,) [m/s^2]."""
    ax, ay, az = p.site_position[0] + r[0], p.site_position[1] + r[1], p.site_position[2] + r[2]
    vx, vy, vz = cross(p.site_spin[0], p.site_spin[1], p.site_spin[2], ax, ay, az)
    cx, cy, cz = cross(p.site_spin[0], p.site_spin[1], p.site_spin[2], vx, vy, vz)
    # m zeta x eta = R^T m w_D x (w_D x (rho_D + r))
    fx, fy, fz = to_body(
        q, p.mass * (cx - gravity[0]), p.mass * (cy - gravity[1]), p.mass * (cz - gravity[2])
    )
    wx, wy, wz = to_body(q, p.site_spin[0], p.site_spin[1], p.site_spin[2])
    hx, hy, hz = matrix_vector(p.inertia, wx, wy, wz)
    tx, ty, tz = cross(wx, wy, wz, hx, hy, hz)
    if p.gravity_gradient_mu > 0.0:
        bx, by, bz = to_body(q, ax, ay, az)
        hx, hy, hz = matrix_vector(p.inertia, bx, by, bz)
        gx, gy, gz = cross(bx, by, bz, hx, hy, hz)
        distance_squared = ax * ax + ay * ay + az * az
        scale = 3.0 * p.gravity_gradient_mu / (distance_squared * distance_squared * math.sqrt(distance_squared))
        tx, ty, tz = tx - scale * gx, ty - scale * gy, tz - scale * gz
    return fx, fy, fz, tx, ty, tz


@kernel
def clip_wrench(force, torque, force_limit, torque_limit):
    """Clip force and torque (3,) per axis, in place; returns how many axes were clipped."""
    clipped = 0
    for i in range(3):
        limited = min(max(force[i], -force_limit), force_limit)
        clipped += limited != force[i]
        force[i] = limited
        limited = min(max(torque[i], -torque_limit), torque_limit)
        clipped += limited != torque[i]
        torque[i] = limited
    return clipped
