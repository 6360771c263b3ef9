"""Triangles of the simple bodies of scenes: vertices (n, 3) [m] and faces (m, 3), counter-clockwise seen from outside."""

import numpy as np

from flight_graph.scenes.scene import Box, Cone, Cylinder, Geometry, Mesh, Sphere

AROUND, ALONG = 28, 14  # edges around an axis, and rings of a sphere
MOST_FACES = 6000  # of a mesh on a page


def triangles(geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a geometry about its own origin."""
    if isinstance(geometry, Mesh):
        return np.asarray(geometry.vertices, float), np.asarray(geometry.faces, int)
    if isinstance(geometry, Box):
        return _box(np.array(geometry.size))
    if isinstance(geometry, Cylinder):
        half = 0.5 * geometry.length
        return _turned([(0.0, -half), (geometry.radius, -half), (geometry.radius, half), (0.0, half)])
    if isinstance(geometry, Cone):
        return _turned([(0.0, 0.0), (geometry.radius, geometry.length)])
    if isinstance(geometry, Sphere):
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, ALONG + 1)
        vertices, faces = _turned(list(zip(np.cos(angle), np.sin(angle))))
        return vertices * np.array(geometry.semi_axes), faces
    raise TypeError(f"no triangles of {type(geometry).__name__}")


def _box(size):
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])


def _turned(outline):
    """A body about z by its outline (radius, height) from below to above."""
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    vertices = np.array([[radius * np.cos(a), radius * np.sin(a), height] for radius, height in outline for a in angle])
    faces = []
    for ring in range(len(outline) - 1):
        for k in range(AROUND):
            low, next_low = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
            faces += [(low, next_low, next_low + AROUND), (low, next_low + AROUND, low + AROUND)]
    return vertices, np.array(faces)


def fewer(vertices: np.ndarray, faces: np.ndarray, most: int = MOST_FACES) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of at most about ``most`` faces: vertices of one cell of a grid become one, as large as that needs."""
    cells, span = 96, np.ptp(vertices, axis=0).max() or 1.0
    while len(faces) > most and cells > 2:
        place = np.floor((vertices - vertices.min(axis=0)) / (span / cells)).astype(int)
        _, first, owner = np.unique(place, axis=0, return_index=True, return_inverse=True)
        merged = owner.reshape(-1)[faces]
        kept = (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 0] != merged[:, 2])
        thin = merged[kept]
        if len(thin) <= most:
            middle = np.stack([np.bincount(owner.reshape(-1), vertices[:, k]) for k in range(3)], axis=1)
            return middle / np.bincount(owner.reshape(-1))[:, None], thin
        cells = int(0.8 * cells)
    return vertices, faces
