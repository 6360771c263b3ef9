"""Shapes worked out from numbers: the box of an inertia, ground around a site, thin meshes, turned poses.

The same bits on every machine: what comes out is recorded (no BLAS, elementary functions of `flight_math`).
"""

import math
from collections.abc import Callable

import numpy as np

from flight_graph.scenes.scene import Box, Mesh, Pose
from flight_math import Quaternion, Vec3, mat3, quaternion_from_matrix, rotate, rotate_back, sincos, uncompiled

SMALLEST = 1e-3  # [m] of an edge of a box
MILLIMETRES = 3  # decimals of coordinates of ground: nobody sees less, and bags stay small


def turned(axis: int, angle: float) -> tuple[float, float, float, float]:
    """Quaternion of a turn about x, y or z (0, 1, 2) by an angle [rad]."""
    sine, cosine = uncompiled(sincos)(0.5 * angle)
    return (*(float(sine) if i == axis else 0.0 for i in range(3)), float(cosine))


def pose_of(position, rotation) -> Pose:
    """A pose of an origin (3,) [m] and a rotation matrix (3, 3), axes of the frame to those of its parent."""
    turn = uncompiled(quaternion_from_matrix)(mat3(np.asarray(rotation, float)))
    return Pose(tuple(float(part) for part in position), tuple(float(part) for part in turn.parts()))


def opposite(pose: Pose) -> Pose:
    """The parent's pose in the frame."""
    turn = Quaternion(*pose.orientation)
    origin = rotate_back(turn, Vec3(*pose.position))
    x, y, z, w = pose.orientation
    return Pose(tuple(0.0 - float(part) for part in origin.parts()), (0.0 - x, 0.0 - y, 0.0 - z, w))


def within(outer: Pose, inner: Pose) -> Pose:
    """The pose in the outer pose's parent of what stands at ``inner`` in its axes."""
    turn = Quaternion(*outer.orientation)
    origin = Vec3(*outer.position) + rotate(turn, Vec3(*inner.position))
    return Pose(tuple(float(part) for part in origin.parts()),
                tuple(float(part) for part in (turn * Quaternion(*inner.orientation)).parts()))


def equivalent_box(mass: float, center_of_mass, inertia) -> tuple[Box, Pose]:
    """The homogeneous box along the frame's axes with this mass [kg] and the diagonal of the inertia (3, 3) about its
    centre [kg m^2], and where it stands."""
    moments = [float(inertia[i][i]) for i in range(3)]
    squares = [6.0 * (sum(moments) - 2.0 * moment) / mass for moment in moments]
    size = tuple(max(SMALLEST, math.sqrt(max(0.0, square))) for square in squares)
    return Box(size), Pose(tuple(map(float, center_of_mass)))


def disc(height: Callable, radius: float, rings: int = 8, sectors: int = 20, least: float = 0.0) -> Mesh:
    """A round patch of the surface z = height(x, y) [m] about the origin, with ever wider rings; seen from above.

    least: radius [m] of the innermost ring; 0: as the others lie.
    """
    vertices, faces = [(0.0, 0.0, height(0.0, 0.0))], []
    for ring in range(1, rings + 1):
        r = least + (radius - least) * (ring / rings) * (ring / rings)
        for sector in range(sectors):
            sine, cosine = uncompiled(sincos)(2.0 * math.pi * sector / sectors)
            vertices.append((r * cosine, r * sine, height(r * cosine, r * sine)))
    for sector in range(sectors):
        following = (sector + 1) % sectors
        faces.append((0, 1 + sector, 1 + following))
        for ring in range(rings - 1):
            inner, outer = 1 + ring * sectors, 1 + (ring + 1) * sectors
            faces += [(inner + sector, outer + sector, outer + following),
                      (inner + sector, outer + following, inner + following)]
    return rounded(Mesh(np.array(vertices, float), np.array(faces, np.int64)))


def rounded(mesh: Mesh) -> Mesh:
    """The mesh with its coordinates at whole millimetres."""
    return Mesh(np.round(mesh.vertices, MILLIMETRES) + 0.0, mesh.faces)


def thinned(vertices, faces, most: int) -> Mesh:
    """A mesh of at most so many faces: vertices that share a cell of a grid become the first of them."""
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    low, cells = vertices.min(axis=0), int(math.sqrt(most)) + 2
    size = float((vertices.max(axis=0) - low).max())
    while len(faces) > most and cells > 2:
        place = np.floor((vertices - low) / size * cells).astype(np.int64)
        _, first, owner = np.unique(place, axis=0, return_index=True, return_inverse=True)
        joined = first[owner.reshape(-1)][faces]
        kept = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
        joined = joined[kept]
        _, once = np.unique(np.sort(joined, axis=1), axis=0, return_index=True)
        if len(once) <= most:
            faces = joined[np.sort(once)]
            break
        cells = cells * 3 // 4
    used, faces = np.unique(faces, return_inverse=True)
    return rounded(Mesh(vertices[used], faces.reshape(-1, 3)))
