"""Dynamics of a base with an arm in inertial axes: what the paper's equations are judged by.

Written apart from the code that flies, which works outward and inward in body axes. Here every body's rotation and position
is a Taylor series in time (value, rate, second derivative), multiplied out as such; forces and moments are the rates of
momentum of all that hangs on a joint. Nothing is handed from body to body but rotation and position.

Modified Denavit-Hartenberg parameters (Craig), joint axes z. Ten parameters a body: [Ixx Ixy Ixz Iyy Iyz Izz, m c, m]
about the origin of its frame (A7).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

Z = np.array([0.0, 0.0, 1.0])


def cross_matrix(v) -> np.ndarray:
    """S(v) (3, 3), S(v) u = v x u."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def vector_of(matrix) -> np.ndarray:
    """v (3,) of S(v)."""
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0]])


def turn(axis: int, angle) -> np.ndarray:
    """Rotation (3, 3) about a coordinate axis by ``angle`` [rad], which may be complex."""
    c, s = np.cos(angle), np.sin(angle)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3, dtype=np.result_type(c, float))
    matrix[first, first] = matrix[second, second] = c
    matrix[first, second], matrix[second, first] = -s, s
    return matrix


class Series(NamedTuple):
    """Value, rate and second derivative in time of a matrix or vector."""

    value: np.ndarray
    rate: np.ndarray
    second: np.ndarray

    def times(self, other: "Series") -> "Series":
        """The product, by Leibniz's rule."""
        return Series(self.value @ other.value, self.rate @ other.value + self.value @ other.rate,
                      self.second @ other.value + 2.0 * self.rate @ other.rate + self.value @ other.second)

    def plus(self, other: "Series") -> "Series":
        """The sum."""
        return Series(*(one + two for one, two in zip(self, other)))


def constant(array) -> Series:
    """A series that does not change."""
    return Series(array, np.zeros_like(array), np.zeros_like(array))


def spinning(rotation, rate, second) -> Series:
    """A rotation (3, 3) with angular velocity ``rate`` (3,) in its own axes, whose components change by ``second``."""
    spin = cross_matrix(rate)
    return Series(rotation, rotation @ spin, rotation @ (spin @ spin + cross_matrix(second)))


@dataclass(frozen=True)
class Arm:
    """alpha, a, d (n,): Denavit-Hartenberg parameters [rad, m, m].  mass (n+1,) [kg], center (n+1, 3) [m], inertia
    (n+1, 3, 3) [kg m^2] about the centre of mass, body axes; body 0 is the base."""

    alpha: np.ndarray
    a: np.ndarray
    d: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    inertia: np.ndarray

    @property
    def offset(self) -> np.ndarray:
        """Origin of each body's frame in its parent's axes (n, 3) [m]."""
        return np.stack([self.a, -np.sin(self.alpha) * self.d, np.cos(self.alpha) * self.d], axis=1)

    @property
    def inertia_about_origin(self) -> np.ndarray:
        """(n+1, 3, 3) [kg m^2]."""
        c = self.center
        shift = (c * c).sum(axis=1)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None, :]
        return self.inertia + self.mass[:, None, None] * shift

    @property
    def pi(self) -> np.ndarray:
        """Inertial parameters (n+1, 10)."""
        rows, columns = np.triu_indices(3)
        return np.column_stack([self.inertia_about_origin[:, rows, columns], self.mass[:, None] * self.center, self.mass])

    def centered_base(self) -> "Arm":
        """The same with the base's centre of mass at the origin of its frame."""
        return replace(self, center=np.vstack([np.zeros(3), self.center[1:]]))


class Motion(NamedTuple):
    """Base: rotation to inertial axes, angular velocity w and its rate al in base axes, velocity v and acceleration a of
    the origin in inertial axes. Joints: theta, thd, thdd (n,)."""

    rotation: np.ndarray
    w: np.ndarray
    al: np.ndarray
    v: np.ndarray
    a: np.ndarray
    theta: np.ndarray
    thd: np.ndarray
    thdd: np.ndarray


def random_arm(draw, joints: int = 4) -> Arm:
    """Bodies of random size; every inertia is that of a cloud of masses."""
    spread = 0.2 * draw.standard_normal((joints + 1, 3, 3))
    second = spread @ spread.transpose(0, 2, 1) + 0.01 * np.eye(3)
    mass = draw.uniform(1.0, 10.0, joints + 1)
    inertia = mass[:, None, None] * (np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second)
    return Arm(draw.uniform(-np.pi, np.pi, joints), *draw.uniform(-0.5, 0.5, (2, joints)), mass,
               0.2 * draw.standard_normal((joints + 1, 3)), inertia)


def random_motion(draw, joints: int = 4) -> Motion:
    """Any attitude, velocities and accelerations of order one."""
    rotation, triangle = np.linalg.qr(draw.standard_normal((3, 3)))
    rotation = rotation * np.linalg.det(rotation)
    return Motion(rotation, *draw.standard_normal((4, 3)), *draw.standard_normal((3, joints)))


def bodies(arm: Arm, motion: Motion) -> list[tuple[Series, Series]]:
    """Rotation to inertial axes and origin in inertial axes of every body."""
    found = [(spinning(motion.rotation, motion.w, motion.al), Series(np.zeros(3), motion.v, motion.a))]
    for i, offset in enumerate(arm.offset):
        rotation, origin = found[-1]
        joint = spinning(turn(0, arm.alpha[i]) @ turn(2, motion.theta[i]), motion.thd[i] * Z, motion.thdd[i] * Z)
        found.append((rotation.times(joint), origin.plus(rotation.times(constant(offset)))))
    return found


def angular_velocity(rotation: Series) -> tuple:
    """Angular velocity and acceleration (3,) in inertial axes of a turning body."""
    return (vector_of(rotation.rate @ rotation.value.T),
            vector_of(rotation.second @ rotation.value.T + rotation.rate @ rotation.rate.T))


def tensor(six) -> np.ndarray:
    """Symmetric (3, 3) of [xx, xy, xz, yy, yz, zz]."""
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class Momenta(NamedTuple):
    """Linear momentum, angular momentum about the inertial origin, and their rates; inertial axes, (3,) each."""

    linear: np.ndarray
    angular: np.ndarray
    force: np.ndarray
    moment: np.ndarray


def momenta(pi, rotation: Series, origin: Series) -> Momenta:
    """Of one body with the ten parameters ``pi``: integrals of velocity over its mass, r = O + R rho."""
    mass, first = pi[9], rotation.times(constant(pi[6:9]))
    body_rate = vector_of(rotation.value.T @ rotation.rate)
    body_second = vector_of(rotation.value.T @ rotation.second + rotation.rate.T @ rotation.rate)
    inertia = tensor(pi[:6])
    about_origin = rotation.value @ inertia @ body_rate
    change = rotation.rate @ inertia @ body_rate + rotation.value @ inertia @ body_second
    o = origin
    return Momenta(
        mass * o.rate + first.rate,
        mass * np.cross(o.value, o.rate) + np.cross(o.value, first.rate) + np.cross(first.value, o.rate) + about_origin,
        mass * o.second + first.second,
        mass * np.cross(o.value, o.second) + np.cross(o.value, first.second) + np.cross(first.value, o.second) + change)


def total(arm: Arm, motion: Motion) -> Momenta:
    """Momenta of the whole robot."""
    parts = [momenta(pi, *body) for pi, body in zip(arm.pi, bodies(arm, motion))]
    return Momenta(*(np.sum(column, axis=0) for column in zip(*parts)))


def joint_wrenches(pi, arm: Arm, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment (n+1, 3) on each body at its origin, in its axes, that move it and all bodies further out.

    ``pi`` (n+1, 10): linear in it.
    """
    placed = bodies(arm, motion)
    parts = [momenta(ten, *body) for ten, body in zip(pi, placed)]
    forces, moments = [], []
    for k, (rotation, origin) in enumerate(placed):
        force = np.sum([part.force for part in parts[k:]], axis=0)
        about = np.sum([part.moment for part in parts[k:]], axis=0) - np.cross(origin.value, force)
        forces.append(rotation.value.T @ force)
        moments.append(rotation.value.T @ about)
    return np.array(forces), np.array(moments)


def floating(arm: Arm, motion: Motion) -> Motion:
    """The motion with the base's velocity and acceleration that leave the centre of mass at rest."""
    still = motion._replace(v=np.zeros(3), a=np.zeros(3))
    found = total(arm, still)
    return motion._replace(v=-found.linear / arm.mass.sum(), a=-found.force / arm.mass.sum())


def torques(pi, arm: Arm, motion: Motion) -> np.ndarray:
    """Force and moment on the base and joint torques (6+n,), base and joint axes."""
    force, moment = joint_wrenches(pi, arm, motion)
    return np.concatenate([force[0], moment[0], moment[1:, 2]])
