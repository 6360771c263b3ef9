"""Small bodies: a surface by latitude and longitude, and gravity outside it, behind one interface.

Every body has ``surface(latitude, longitude)`` -> (point (3,) [m], outward unit normal (3,)) and ``field(point)`` ->
(gravity (3,) [m/s^2], gravity gradient (3, 3) [1/s^2]), both in body axes: z along the spin, x at longitude zero.
Latitude and longitude [rad] are the direction from the centre (planetocentric). Gravity is attraction alone, without
the spin.

Bennu: semi-axes 282.5, 267.5, 254 m, mean radius 244.6 m, GM 4.8904 m^3/s^2, rotation period 4.296 h (radar shape of
Nolan et al., Icarus 226, 2013, and OSIRIS-REx results); the body between is a superellipsoid of the same volume.
"""

import math
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from flight_graph.errors import FlightError
from flight_math import Vec3, norm, normalised, uncompiled
from sim_nodes.gravity import mesh
from sim_nodes.gravity.ellipsoid import unit_direction
from sim_nodes.gravity.polyhedron import Polyhedron, evaluate
from sim_nodes.gravity.superellipsoid import Superellipsoid, exponent_for_volume

BENNU_GM = 4.8904  # [m^3/s^2]
BENNU_SEMI_AXES = (282.5, 267.5, 254.0)  # [m]
BENNU_MEAN_RADIUS = 244.6  # [m] of the sphere with Bennu's volume
BENNU_SPIN = 2.0 * math.pi / (4.296 * 3600.0)  # [rad/s]
FREQUENCY = 32  # 20480 faces, edges of some 7 m
MANY, NEAR = 5000, 0.77  # faces, of which only those are looked at whose direction has this cosine (40 degrees)


@dataclass(frozen=True)
class PointMass:
    """A sphere whose mass sits at its centre. gm [m^3/s^2], mean_radius [m]."""

    gm: float
    mean_radius: float

    def surface(self, latitude, longitude):
        up = direction(latitude, longitude)
        return self.mean_radius * up, up

    def field(self, point):
        r = float(norm(Vec3(*point)))
        cube = r * r * r
        return -self.gm / cube * point, self.gm / cube * (3.0 * np.outer(point, point) / (r * r) - np.eye(3))


class SuperellipsoidBody:
    """A homogeneous superellipsoid: surface in closed form, gravity of its inscribed mesh with the same mass."""

    def __init__(self, gm: float, shape: Superellipsoid, frequency: int = FREQUENCY):
        self.shape = shape
        vertices, faces = shape.mesh(frequency)
        self.polyhedron = Polyhedron(vertices, faces, gm / mesh.volume(vertices, faces))

    def surface(self, latitude, longitude):
        d = direction(latitude, longitude)
        point = float(self.shape.radius(d)) * d
        return point, self.shape.normal(point)

    def field(self, point):
        gravity, gradient = evaluate(self.polyhedron, point)
        return gravity[0], gradient[0]


class MeshBody:
    """A homogeneous body bounded by a user's mesh, already checked. name: for error texts."""

    def __init__(self, gm: float, vertices, faces, name: str = "mesh"):
        self.polyhedron, self.name = Polyhedron(vertices, faces, gm / mesh.volume(vertices, faces)), name

    def surface(self, latitude, longitude):
        """The outermost point that the ray from the origin meets, and its face's normal."""
        d = direction(latitude, longitude)
        distance, normal = self._met(d, f"at latitude {latitude:g}, longitude {longitude:g} rad")
        return distance * d, np.array(normalised(Vec3(*normal)))

    def radius_near(self, d):
        """The function that gives the distance [m] of the outermost point that the ray from the origin along a unit vector
        (3,) meets; of a large mesh it knows the faces around the direction d (3,) alone."""
        faces = self.polyhedron.faces
        if len(faces) > MANY:
            corners = self.polyhedron.vertices[faces]
            sizes = np.sqrt(_squares(corners))
            near = ((corners[..., 0] * d[0] + corners[..., 1] * d[1] + corners[..., 2] * d[2]) > NEAR * sizes).any(axis=1)
            faces = faces[near]
        return lambda e: float(self._met(e, f"along {tuple(round(float(part), 6) for part in e)}", faces)[0])

    def _met(self, d, where, faces=None):
        """Distance [m] and normal (3,), of any length, of the outermost face on a ray. Raises FlightError."""
        a, b, c = (self.polyhedron.vertices[(self.polyhedron.faces if faces is None else faces)[:, i]] for i in range(3))
        with np.errstate(all="ignore"):
            normal = np.cross(b - a, c - a)
            distance = _dots(normal, a) / _dots(normal, d)
            weights = np.stack([_dots(np.cross(p, q), d) for p, q in ((a, b), (b, c), (c, a))])
            size = np.abs(weights).sum(axis=0)
            hit = (((weights >= -1e-9 * size).all(axis=0) | (weights <= 1e-9 * size).all(axis=0))
                   & (distance > 0.0) & np.isfinite(distance))
        if not hit.any():
            raise FlightError(f"{self.name}: there is no surface {where}: the ray from the origin meets no face; "
                              "the origin must lie inside the body")
        face = np.flatnonzero(hit)[np.argmax(distance[hit])]
        return distance[face], normal[face]

    field = SuperellipsoidBody.field


def direction(latitude: float, longitude: float) -> np.ndarray:
    """Unit vector (3,) in body axes of a planetocentric latitude and longitude [rad]."""
    return np.array(uncompiled(unit_direction)(latitude, longitude))


def _squares(points) -> np.ndarray:
    """Square of the length of each point (..., 3)."""
    return points[..., 0] * points[..., 0] + points[..., 1] * points[..., 1] + points[..., 2] * points[..., 2]


def _dots(rows, others) -> np.ndarray:
    """Dot product (m,) of each row (m, 3) with another row, or with one vector (3,)."""
    return rows[:, 0] * others[..., 0] + rows[:, 1] * others[..., 1] + rows[:, 2] * others[..., 2]


def sphere_volume(mean_radius: float) -> float:
    """Volume [m^3] of the sphere."""
    return 4.0 / 3.0 * math.pi * (mean_radius * mean_radius * mean_radius)


@lru_cache(maxsize=8)
def top(gm: float, semi_axes: tuple, mean_radius: float, frequency: int = FREQUENCY) -> SuperellipsoidBody:
    """The superellipsoid with these semi-axes [m] and the volume of the sphere with ``mean_radius`` [m]."""
    p = exponent_for_volume(*semi_axes, sphere_volume(mean_radius))
    return SuperellipsoidBody(gm, Superellipsoid(*semi_axes, p), frequency)


def bennu(frequency: int = FREQUENCY) -> SuperellipsoidBody:
    """Bennu as a superellipsoid."""
    return top(BENNU_GM, BENNU_SEMI_AXES, BENNU_MEAN_RADIUS, frequency)


def from_obj(path: Path, gm: float, scale: float = 1.0) -> MeshBody:
    """A body with the surface of a Wavefront .obj file (scale: metres a unit) and gravitational parameter gm."""
    return _from_obj(Path(path), Path(path).stat().st_mtime_ns if os.path.exists(path) else 0, gm, scale)


@lru_cache(maxsize=8)
def _from_obj(path, changed, gm, scale):
    return MeshBody(gm, *mesh.load_obj(path, scale), name=str(path))
