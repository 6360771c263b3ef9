"""A rigid body near a rotating asteroid by Newton and Euler in an inertial frame, and its pose relative to the site.

Independent of `sim_nodes.lander`: nothing rotates here but what is told to. The inertial frame I has its origin at the
asteroid's centre and the axes that D has at t = 0; the site's axes and origin are turned from there about the spin. Any
gravity will do for an identity: that of a point mass.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation


class Body(NamedTuple):
    """Vehicle and asteroid."""

    mass: float  # [kg]
    inertia: np.ndarray  # J (3, 3) in B [kg m^2]
    mu: float  # [m^3/s^2]
    place: np.ndarray  # rho_D (3,) [m], from the asteroid's centre to the site, in D
    spin: np.ndarray  # w_D (3,) [rad/s], in D


class Relative(NamedTuple):
    """Motion relative to the site."""

    r: np.ndarray  # r^D [m]
    q: np.ndarray  # B -> D, x, y, z, w
    w: np.ndarray  # w_BD in B [rad/s]
    alpha: np.ndarray  # R^T d(r^D)/dt [m/s]


def gravity(body, r):
    """g^D [m/s^2] at r^D."""
    place = body.place + r
    return -body.mu * place / np.linalg.norm(place) ** 3


def inertial(body, relative) -> np.ndarray:
    """The state (13,) at t = 0, in I: position, velocity, quaternion B -> I, w_BI in B."""
    turn = Rotation.from_quat(relative.q)
    place = body.place + relative.r
    velocity = turn.apply(relative.alpha) + np.cross(body.spin, place)
    return np.array([*place, *velocity, *relative.q, *(relative.w + turn.inv().apply(body.spin))])


def relative(body, t, state) -> Relative:
    """The motion relative to the site at t of an inertial state."""
    site, turn = Rotation.from_rotvec(body.spin * t), Rotation.from_quat(state[6:10])
    to_site = site.inv() * turn
    drift = state[3:6] - np.cross(body.spin, state[0:3])  # the spin's axis is the same in I and in D
    w = state[10:13] - turn.inv().apply(body.spin)
    return Relative(site.inv().apply(state[0:3]) - body.place, to_site.as_quat(), w, turn.inv().apply(drift))


def rate(body, t, state, wrench):
    """Rate of an inertial state; wrench(r, q, w, alpha) -> force [N], torque [N m] in B."""
    force, torque = wrench(relative(body, t, state))
    place, w = state[0:3], state[10:13]
    pull = -body.mu * place / np.linalg.norm(place) ** 3
    x, y, z, s = state[6:10]
    turning = 0.5 * np.array([[s, -z, y], [z, s, -x], [-y, x, s], [-x, -y, -z]]) @ w
    spinning = np.linalg.solve(body.inertia, torque - np.cross(w, body.inertia @ w))
    acceleration = pull + Rotation.from_quat(state[6:10]).apply(force) / body.mass
    return np.array([*state[3:6], *acceleration, *turning, *spinning])


def step(derivative, t, state, dt):
    """One Runge-Kutta step of dt [s]."""
    k_1 = derivative(t, state)
    k_2 = derivative(t + 0.5 * dt, state + 0.5 * dt * k_1)
    k_3 = derivative(t + 0.5 * dt, state + 0.5 * dt * k_2)
    k_4 = derivative(t + dt, state + dt * k_3)
    return state + dt / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)
