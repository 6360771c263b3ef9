"""Every geometry of a scene as triangles, for viewers that know nothing else."""

import math

import numpy as np

from flight_graph.scenes.scene import Box, Cone, Cylinder, Geometry, Mesh, Sphere
from flight_math import sincos, uncompiled

SECTORS = 20  # of what is round
_CUBE = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
                   (0, 6, 4), (1, 5, 7), (1, 7, 3)])


def triangles(geometry: Geometry) -> Mesh:
    """The geometry as a mesh, counter-clockwise seen from outside; of a cone the mantle alone."""
    if isinstance(geometry, Mesh):
        return geometry
    if isinstance(geometry, Box):
        return Mesh(_CUBE * np.array(geometry.size, float), _SIDES)
    if isinstance(geometry, Cylinder):
        return _turned([(0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)], geometry.radius, geometry.length)
    if isinstance(geometry, Cone):
        return _turned([(0.0, 0.0), (1.0, 1.0)], geometry.radius, geometry.length)
    assert isinstance(geometry, Sphere)
    rings = SECTORS // 2
    profile = [(0.0, -1.0), *((_sine(math.pi * k / rings), 0.0 - _sine(0.5 * math.pi - math.pi * k / rings))
                              for k in range(1, rings)), (0.0, 1.0)]
    ball = _turned(profile, 1.0, 1.0)
    return Mesh(ball.vertices * np.array(geometry.semi_axes, float), ball.faces)


def _sine(angle) -> float:
    return float(uncompiled(sincos)(angle)[0])


def _turned(profile, radius, length) -> Mesh:
    """The surface that (distance from z, height) points make when they turn about z, from below to above."""
    vertices, rows, faces = [], [], []
    for distance, height in profile:
        row = [len(vertices)] * SECTORS if distance == 0.0 else [len(vertices) + k for k in range(SECTORS)]
        rows.append(row)
        for k in range(1 if distance == 0.0 else SECTORS):
            sine, cosine = uncompiled(sincos)(2.0 * math.pi * k / SECTORS)
            vertices.append((radius * distance * float(cosine), radius * distance * float(sine), length * height))
    for below, above in zip(rows, rows[1:]):
        for k in range(SECTORS):
            n = (k + 1) % SECTORS
            faces += [face for face in ((below[k], below[n], above[n]), (below[k], above[n], above[k]))
                      if len(set(face)) == 3]
    return Mesh(np.array(vertices), np.array(faces, np.int64))
