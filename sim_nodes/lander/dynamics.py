"""The truth of a landing: a rigid body near a uniformly rotating small body, seen from the landing-site frame.

Frames: A fixed in the body (spin about z_A), D at the landing site, fixed in A, B the spacecraft. The motion (`Motion`):
r^D [m], v = d(r^D)/dt [m/s], q (B -> D), w = w_BD^B [rad/s], mass m [kg]. A wrench is force [N] + eps torque [N m] in B.

  m dv/dt = R f + m g^D - 2 m w_D x v - m w_D x (w_D x (rho_D + r))
  J dw_BI/dt + w_BI x J w_BI = tau + tau_gg,  w_BI = w + R^T w_D
  dw/dt = dw_BI/dt + w x R^T w_D,  dq/dt = (1/2) q (0, w)
  tau_gg = (3 mu/R^5) x^B x J x^B  (where asked for; central field)

p, x: records with the fields of `Truth`: p has inertia, body_spin, gravity_gradient, mu, x has site_rotation and
site_position, and both have what the body's gravity needs, a kernel ``gravity(p, x, place)`` -> g^A at a place [m] in A.
`dynamics` makes the kernels of this module for one: a compiled function that takes a kernel as argument could not be
cached. `site_gravity` and `hold_step` are those of the ellipsoid.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flight_graph.errors import FlightError
from flight_math import (
    DualVector,
    Mat3,
    Quaternion,
    Vec3,
    cross,
    dot,
    inverse,
    kernel,
    normalised,
    quaternion_rates,
    row,
    transpose,
)
from flight_math.integrators import reached, summed
from lander_ros.feed_forward import gravity_gradient_torque
from sim_nodes.gravity.ellipsoid import ellipsoid_gravity


class Truth(NamedTuple):
    """Small body, site and vehicle; serves as p and as x of this module for the ellipsoid."""

    mu: float  # [m^3/s^2]
    semi_axes: Vec3  # [m]
    body_spin: float  # w_A [rad/s] about z_A
    inertia: Mat3  # J [kg m^2] in B, constant
    site_rotation: Mat3  # R_AD, D -> A
    site_position: Vec3  # rho [m] in A
    gravity_gradient: bool = False  # torque of the central field's gradient


class Motion(NamedTuple):
    """State of the vehicle, or the rate of it."""

    position: Vec3  # r^D [m]
    velocity: Vec3  # v [m/s] in D
    attitude: Quaternion  # q, B -> D
    rates: Vec3  # w_BD [rad/s] in B
    mass: float  # [kg]


@kernel
def attitude_matrix(q):
    """R_DB, B -> D, of a quaternion of any norm."""
    x, y, z, w = q.x, q.y, q.z, q.w
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    return Mat3(1.0 - scale * (y * y + z * z), scale * (x * y - w * z), scale * (x * z + w * y),
                scale * (x * y + w * z), 1.0 - scale * (x * x + z * z), scale * (y * z - w * x),
                scale * (x * z - w * y), scale * (y * z + w * x), 1.0 - scale * (x * x + y * y))


@kernel
def motor(motion):
    """V = w + eps alpha, alpha = R_DB^T v: rates [rad/s] and velocity [m/s] relative to the site, in B."""
    return DualVector(motion.rates, transpose(attitude_matrix(motion.attitude)) @ motion.velocity)


@kernel
def site_spin(p, x):
    """w_D [rad/s]: the body's spin in D."""
    return p.body_spin * row(x.site_rotation, 2)


@kernel
def place_of(x, position):
    """A position r^D [m] in A."""
    return x.site_rotation @ position + x.site_position


@kernel
def rate_under(p, x, motion, gravity, wrench, flow):
    """Rate of the motion under a wrench, the true gravity g^D [m/s^2] and a propellant flow >= 0 [kg/s]."""
    to_site = attitude_matrix(motion.attitude)
    to_body, w_d, w = transpose(to_site), site_spin(p, x), motion.rates
    place = place_of(x, motion.position)
    # in A, w_A x (w_A x place) = -spin^2 (place_x, place_y, 0)
    centrifugal = transpose(x.site_rotation) @ (p.body_spin * p.body_spin * Vec3(place.x, place.y, 0.0))
    acceleration = to_site @ wrench.real / motion.mass + gravity + centrifugal - 2.0 * cross(w_d, motion.velocity)
    zeta = to_body @ w_d
    w_bi = w + zeta
    torque = wrench.dual - cross(w_bi, p.inertia @ w_bi)
    if p.gravity_gradient:
        torque = torque + gravity_gradient_torque(p.mu, p.inertia, to_body @ (transpose(x.site_rotation) @ place))
    return Motion(motion.velocity, acceleration, quaternion_rates(motion.attitude, w),
                  inverse(p.inertia) @ torque + cross(w, zeta), -flow)


@kernel
def unit_attitude(motion):
    """The motion with its quaternion scaled to norm 1."""
    return Motion(motion.position, motion.velocity, normalised(motion.attitude), motion.rates, motion.mass)


class Dynamics(NamedTuple):
    """The kernels that know the body's gravity."""

    site_gravity: Callable
    hold_step: Callable


def dynamics(gravity) -> Dynamics:
    """The kernels for a body whose gravity is the kernel ``gravity(p, x, place)``."""

    @kernel
    def site_gravity(p, x, position):
        """The true g^D [m/s^2] at r^D [m]."""
        return transpose(x.site_rotation) @ gravity(p, x, place_of(x, position))

    @kernel
    def rate(p, x, motion, wrench, flow):
        """`rate_under` the true gravity."""
        return rate_under(p, x, motion, site_gravity(p, x, motion.position), wrench, flow)

    @kernel
    def hold_step(p, x, motion, gravity_here, wrench, flow, dt):
        """The motion after one Runge-Kutta step of dt [s], the wrench held; gravity_here: `site_gravity` at its begin."""
        k_1 = rate_under(p, x, motion, gravity_here, wrench, flow)
        k_2 = rate(p, x, reached(motion, 0.5 * dt, k_1), wrench, flow)
        k_3 = rate(p, x, reached(motion, 0.5 * dt, k_2), wrench, flow)
        k_4 = rate(p, x, reached(motion, dt, k_3), wrench, flow)
        return unit_attitude(summed(motion, dt / 6.0, k_1, k_2, k_3, k_4))

    return Dynamics(site_gravity, hold_step)


@kernel
def gravity_of_ellipsoid(p, x, place):
    """`ellipsoid_gravity` of the parameters."""
    return ellipsoid_gravity(p, place)


ELLIPSOID = dynamics(gravity_of_ellipsoid)
site_gravity, hold_step = ELLIPSOID


@kernel
def touched_down(p, position):
    """Whether the contact trigger fires: z_D <= contact_height [m] within contact_radius [m] of the site."""
    return position.z <= p.contact_height and dot(position, position) < p.contact_radius * p.contact_radius


def require_truth(truth: Truth) -> None:
    """Refuse an inertia that is not symmetric and positive definite, and a rotation that is not proper."""
    inertia, rotation = (np.reshape(m, (3, 3)) for m in (truth.inertia.parts(), truth.site_rotation.parts()))
    if not np.allclose(inertia, inertia.T) or not np.linalg.eigvalsh(inertia)[0] > 0.0:
        raise FlightError(f"inertia must be a symmetric, positive definite 3x3 matrix [kg m^2], got {inertia.tolist()}")
    if not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-9):
        raise FlightError(f"site_rotation must be a rotation matrix (D -> A), got {rotation.tolist()}")
