"""The truth of a landing: a rigid body near a uniformly rotating small body, seen from the landing-site frame.

Frames: A fixed in the body (spin about z_A), D at the landing site, fixed in A, B the spacecraft. State (14,):
  r^D (0:3) [m], v = d(r^D)/dt (3:6) [m/s], q B -> D, x, y, z, w (6:10), w_BD^B (10:13) [rad/s], mass (13) [kg].

  m dv/dt = R f + m g^D - 2 m w_D x v - m w_D x (w_D x (rho_D + r))
  J dw_BI/dt + w_BI x J w_BI = tau + tau_gg,  w_BI = w + R^T w_D
  dw/dt = dw_BI/dt + w x R^T w_D,  dq/dt = (1/2) q (0, w)
  tau_gg = (3 mu/R^5) x^B x J x^B  (where asked for; central field)

The gravity of the body is a kernel ``gravity(field, p, x, y, z)`` -> g^A (3 floats) at (x, y, z) [m] in A: of the
parameters in ``field``, or of tables in the record ``p``. `dynamics` makes the kernels of this module for one: a
compiled function that takes a kernel as argument could not be cached. `site_gravity`, `state_rate` and `hold_step` are
those of the ellipsoid.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.vectors import cross, matrix_vector, transpose_vector
from sim_nodes.ellipsoid_gravity import ellipsoid_gravity

STATES = 14  # length of the state


class LanderPlant(NamedTuple):
    """The true vehicle and site: any record with these fields serves as `p`."""

    inertia: np.ndarray  # J (3, 3) [kg m^2] in B, constant
    site_rotation: np.ndarray  # R_AD (3, 3), D -> A
    site_position: np.ndarray  # rho (3,) [m] in A
    spin: float  # w_A [rad/s] about z_A
    gravity_gradient_mu: float  # [m^3/s^2]; 0: no gravity-gradient torque


@kernel
def attitude_matrix(state, out):
    """R_DB (3, 3), B -> D, of the quaternion in a state (14,), which need not be of norm 1."""
    x, y, z, w = state[6], state[7], state[8], state[9]
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    out[0, 0] = 1.0 - scale * (y * y + z * z)
    out[0, 1] = scale * (x * y - w * z)
    out[0, 2] = scale * (x * z + w * y)
    out[1, 0] = scale * (x * y + w * z)
    out[1, 1] = 1.0 - scale * (x * x + z * z)
    out[1, 2] = scale * (y * z - w * x)
    out[2, 0] = scale * (x * z - w * y)
    out[2, 1] = scale * (y * z + w * x)
    out[2, 2] = 1.0 - scale * (x * x + y * y)


@kernel
def body_velocity(state, matrix, out):
    """alpha = R_DB^T v, to (3,) [m/s]: the velocity relative to the site, in B. ``matrix`` (3, 3) is work."""
    attitude_matrix(state, matrix)
    out[0], out[1], out[2] = transpose_vector(matrix, state[3], state[4], state[5])


@kernel
def _solve(matrix, x, y, z):
    """matrix^-1 (x, y, z) for a symmetric matrix (3, 3), by cofactors."""
    a, b, c = matrix[0, 0], matrix[1, 1], matrix[2, 2]
    d, e, f = matrix[1, 2], matrix[0, 2], matrix[0, 1]
    aa, bb, cc = b * c - d * d, a * c - e * e, a * b - f * f
    dd, ee, ff = e * f - a * d, d * f - b * e, d * e - c * f
    determinant = a * aa + f * ff + e * ee
    return (
        (aa * x + ff * y + ee * z) / determinant,
        (ff * x + bb * y + dd * z) / determinant,
        (ee * x + dd * y + cc * z) / determinant,
    )


@kernel
def place(p, state):
    """Position of a state in A, three floats [m]."""
    ax, ay, az = matrix_vector(p.site_rotation, state[0], state[1], state[2])
    return ax + p.site_position[0], ay + p.site_position[1], az + p.site_position[2]


@kernel
def rate_under(gx, gy, gz, p, state, force, torque, mass_flow, matrix, out):
    """`state_rate` where the gravity g^A is known."""
    spin = p.spin
    attitude_matrix(state, matrix)
    ax, ay, az = place(p, state)
    # in A, w x (w x a) = -spin^2 (x, y, 0)
    gx, gy, gz = transpose_vector(p.site_rotation, gx + spin * spin * ax, gy + spin * spin * ay, gz)
    wx, wy, wz = spin * p.site_rotation[2, 0], spin * p.site_rotation[2, 1], spin * p.site_rotation[2, 2]
    cx, cy, cz = cross(wx, wy, wz, state[3], state[4], state[5])
    fx, fy, fz = matrix_vector(matrix, force[0], force[1], force[2])
    for i in range(3):
        out[i] = state[3 + i]
    out[3] = fx / state[13] + gx - 2.0 * cx
    out[4] = fy / state[13] + gy - 2.0 * cy
    out[5] = fz / state[13] + gz - 2.0 * cz
    rx, ry, rz = state[10], state[11], state[12]
    out[6] = 0.5 * (state[9] * rx + state[7] * rz - state[8] * ry)
    out[7] = 0.5 * (state[9] * ry + state[8] * rx - state[6] * rz)
    out[8] = 0.5 * (state[9] * rz + state[6] * ry - state[7] * rx)
    out[9] = -0.5 * (state[6] * rx + state[7] * ry + state[8] * rz)
    zx, zy, zz = transpose_vector(matrix, wx, wy, wz)
    hx, hy, hz = matrix_vector(p.inertia, rx + zx, ry + zy, rz + zz)
    cx, cy, cz = cross(rx + zx, ry + zy, rz + zz, hx, hy, hz)
    tx, ty, tz = torque[0] - cx, torque[1] - cy, torque[2] - cz
    if p.gravity_gradient_mu > 0.0:
        dx, dy, dz = transpose_vector(p.site_rotation, ax, ay, az)
        dx, dy, dz = transpose_vector(matrix, dx, dy, dz)
        hx, hy, hz = matrix_vector(p.inertia, dx, dy, dz)
        cx, cy, cz = cross(dx, dy, dz, hx, hy, hz)
        squared = dx * dx + dy * dy + dz * dz
        scale = 3.0 * p.gravity_gradient_mu / (squared * squared * math.sqrt(squared))
        tx, ty, tz = tx + scale * cx, ty + scale * cy, tz + scale * cz
    sx, sy, sz = _solve(p.inertia, tx, ty, tz)
    cx, cy, cz = cross(rx, ry, rz, zx, zy, zz)
    out[10], out[11], out[12] = sx + cx, sy + cy, sz + cz
    out[13] = -mass_flow


@kernel
def normalise_attitude(state):
    """Scale the quaternion of a state to norm 1, in place."""
    norm = math.sqrt(state[6] * state[6] + state[7] * state[7] + state[8] * state[8] + state[9] * state[9])
    for i in range(6, 10):
        state[i] /= norm


@kernel
def advance(state, rate, k, dt, total, stage):
    """Stage k = 0 ... 3 of the classical Runge-Kutta scheme: next stage, and after the last one the new state."""
    weight = 1.0 if k == 0 or k == 3 else 2.0
    reach = dt if k == 2 else 0.5 * dt
    for i in range(len(state)):
        total[i] += weight * rate[i]
        if k < 3:
            stage[i] = state[i] + reach * rate[i]
        else:
            state[i] += dt / 6.0 * total[i]


class Dynamics(NamedTuple):
    """The kernels that know the body's gravity."""

    site_gravity: Callable
    state_rate: Callable
    hold_step: Callable


def dynamics(gravity) -> Dynamics:
    """The kernels for a body whose gravity is the kernel ``gravity(field, p, x, y, z)``."""

    @kernel
    def site_gravity(field, p, state, out):
        """The true g^D, to (3,) [m/s^2], at the position of a state."""
        ax, ay, az = place(p, state)
        gx, gy, gz = gravity(field, p, ax, ay, az)
        out[0], out[1], out[2] = transpose_vector(p.site_rotation, gx, gy, gz)

    @kernel
    def state_rate(field, p, state, force, torque, mass_flow, matrix, out):
        """d(state)/dt, to (14,), under force (3,) [N] and torque (3,) [N m] in B and a propellant flow >= 0 [kg/s].

        ``matrix`` (3, 3) is work.
        """
        ax, ay, az = place(p, state)
        gx, gy, gz = gravity(field, p, ax, ay, az)
        rate_under(gx, gy, gz, p, state, force, torque, mass_flow, matrix, out)

    @kernel
    def hold_step(field, p, state, force, torque, mass_flow, dt, matrix, work):
        """One classical Runge-Kutta step of dt [s], in place, the wrench held. ``matrix`` (3, 3), ``work`` (3, 14)."""
        rate, total, stage = work[0], work[1], work[2]
        for i in range(STATES):
            stage[i] = state[i]
            total[i] = 0.0
        for k in range(4):
            state_rate(field, p, stage, force, torque, mass_flow, matrix, rate)
            advance(state, rate, k, dt, total, stage)
        normalise_attitude(state)

    return Dynamics(site_gravity, state_rate, hold_step)


@kernel
def gravity_of_ellipsoid(field, p, x, y, z):
    """`ellipsoid_gravity` of the parameters."""
    return ellipsoid_gravity(field, x, y, z)


ELLIPSOID = dynamics(gravity_of_ellipsoid)
site_gravity, state_rate, hold_step = ELLIPSOID


@kernel
def touched_down(state, height, radius):
    """Whether the contact trigger fires: z_D <= height [m] within radius [m] of the site."""
    r_squared = state[0] * state[0] + state[1] * state[1] + state[2] * state[2]
    return state[2] <= height and r_squared < radius * radius


def lander_plant(inertia, site_rotation, site_position, spin, gravity_gradient_mu=0.0) -> LanderPlant:
    """A checked `LanderPlant`: the inertia symmetric and positive definite, the site's rotation proper."""
    inertia = np.array(inertia, dtype=float)
    rotation = np.array(site_rotation, dtype=float)
    if inertia.shape != (3, 3) or not np.allclose(inertia, inertia.T) or not np.linalg.eigvalsh(inertia)[0] > 0.0:
        raise FlightError(f"inertia must be a symmetric, positive definite 3x3 matrix [kg m^2], got {inertia.tolist()}")
    if rotation.shape != (3, 3) or not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-9):
        raise FlightError(f"site_rotation must be a rotation matrix (D -> A), got {rotation.tolist()}")
    return LanderPlant(
        inertia=inertia,
        site_rotation=rotation,
        site_position=np.array(site_position, dtype=float),
        spin=float(spin),
        gravity_gradient_mu=float(gravity_gradient_mu),
    )


def approach_attitude(position, yaw, view_error, view_direction) -> np.ndarray:
    """Attitude (4,), x, y, z, w: z_B towards r^D by the least rotation, then yaw about z_B, then a tilt, all [rad].

    The tilt of view_error is about the axis (cos, sin, 0) of view_direction in B: the angle between -z_B and the site.
    """
    r = np.asarray(position, dtype=float)
    distance = math.sqrt(float(sum(r * r)))
    if not distance > 0.0 or r[2] <= -distance:
        raise FlightError(f"no least rotation takes z_D to the position {r.tolist()} m")
    up = r / distance
    first = np.array([-up[1], up[0], 0.0, 1.0 + up[2]])
    first /= math.sqrt(float(sum(first * first)))
    second = np.array([0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)])
    half = math.sin(0.5 * view_error)
    axis = math.cos(view_direction), math.sin(view_direction)
    third = np.array([half * axis[0], half * axis[1], 0.0, math.cos(0.5 * view_error)])
    return _product(_product(first, second), third)


def _product(a, b):
    """Hamilton product of quaternions x, y, z, w."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*vector, a[3] * b[3] - float(sum(a[:3] * b[:3]))])
