"""What the lander's laws know of vehicle and body, and the feed-forward that both laws share.

  f_ff = -m g^B + m zeta x eta,  tau_ff = -tau_gg + zeta x J zeta,  zeta = R^T w_D,  eta = R^T [w_D x (rho_D + r)]

that is F_ff = f_ff + eps tau_ff = -F_g + V_DI x M V_DI in the dual form of Zhang and Cai, Nonlinear Dynamics 100,
2427-2448 (2020), Appendix B; the numbers are ours. Gravity is a vector of the flight software's model, not the truth.
D: landing-site frame; B: body.
"""

import math

from flight_graph.components.records import Parameters, field
from flight_math import DualVector, Mat3, Vec3, clip, count, cross, dot, kernel, rotate_back, row, transpose

REFERENCE = "reference scenario (ours)"


class LanderModel(Parameters):
    """The vehicle and the landing site as the flight software believes them to be."""

    mass: float = field(500.0, unit="kg", gt=0, source=REFERENCE, doc="m")
    inertia: Mat3 = field(
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


def site_in_landing_frame(rotation, position, spin) -> tuple[Vec3, Vec3]:
    """rho_D [m] and w_D [rad/s], both in D, of a goal pose in the body-fixed frame A.

    rotation: Mat3, R_AD (D -> A, columns x_D, y_D, z_D); position: Vec3 [m] in A; spin [rad/s] about z_A.
    """
    return transpose(rotation) @ position, spin * row(rotation, 2)


@kernel
def feed_forward(p, r, q, gravity):
    """F_ff = f_ff [N] + eps tau_ff [N m] in B, at the pose r^D, q, for the model's gravity g^D [m/s^2]."""
    place = p.site_position + r
    zeta = rotate_back(q, p.site_spin)
    # m zeta x eta = R^T m w_D x (w_D x (rho_D + r))
    force = rotate_back(q, p.mass * (cross(p.site_spin, cross(p.site_spin, place)) - gravity))
    torque = cross(zeta, p.inertia @ zeta)
    if p.gravity_gradient_mu > 0.0:
        torque = torque - gravity_gradient_torque(p.gravity_gradient_mu, p.inertia, rotate_back(q, place))
    return DualVector(force, torque)


@kernel
def gravity_gradient_torque(mu, inertia, place):
    """tau_gg = (3 mu/R^5) x^B x J x^B [N m] of a central field, x^B [m] from the body's centre, in B."""
    squared = dot(place, place)
    return 3.0 * mu / (squared * squared * math.sqrt(squared)) * cross(place, inertia @ place)


@kernel
def clip_wrench(p, wrench):
    """A wrench F = f + eps tau clipped per axis to force_limit and torque_limit, and how many axes were clipped."""
    force = clip(wrench.real, -p.force_limit, p.force_limit)
    torque = clip(wrench.dual, -p.torque_limit, p.torque_limit)
    return DualVector(force, torque), count(force != wrench.real) + count(torque != wrench.dual)
