"""Closed triangle meshes: reading Wavefront .obj files, the checks before gravity may trust them, and spheres.

A mesh is (vertices (n, 3) [m], faces (m, 3) of indices, counter-clockwise seen from outside). `require_closed` refuses
holes, edges with more than two faces, faces wound against their neighbours, an inside-out mesh and degenerate faces.
It does not look for faces that cut through each other.
"""

import math
import os
from array import array
from io import BytesIO
from pathlib import Path

import numpy as np

from flight_graph.engines import memory
from flight_graph.errors import FlightError
from flight_graph.text_files import read_bytes, short, size_text

MOST_CORNERS = 1000  # of a polygon
SHARE = 4  # reading a mesh takes at most this part of the free memory
BYTES_A_TRIANGLE = 1000  # that reading and checking take at their height; 0.6 kB were measured, on half as many vertices
LINES_A_TRIANGLE = 5  # vertices, texture, normals and comments among them
LONGEST_LINE = 1 << 16  # [bytes]
FARTHEST = 1e9  # [m] of a vertex from the origin: products of three stay far from the largest number
SMALLEST_AREA = 1e-12  # [-] of the mesh's largest extent squared


def load_obj(path: Path, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and faces (m, 3) of a Wavefront .obj file; polygons become fans. Raises FlightError.

    scale: metres a unit of the file (1000 for kilometres). Only ``v`` and ``f`` lines are read. There is no limit but
    memory: a part of what is free (`SHARE`) has to hold the mesh.
    """
    if not os.path.exists(path):
        raise FlightError(f"there is no mesh file '{short(str(path))}'")
    free = memory.free_bytes()
    most = free // SHARE // BYTES_A_TRIANGLE
    content = read_bytes(Path(path), f"mesh {path}", free // SHARE // SHARE)
    coordinates, indices = array("d"), array("q")
    content = content if b"\n" in content else content.replace(b"\r", b"\n")
    lines, too_many = BytesIO(content), content.count(b"\n") > LINES_A_TRIANGLE * most
    for number, line in enumerate(iter(lambda: lines.readline(LONGEST_LINE), b""), 1):
        if too_many or max(len(coordinates), len(indices)) > 3 * most:
            raise FlightError(f"{path}: {size_text(free)} of memory are free, a quarter of which holds a mesh of {most} "
                              f"triangles on as many vertices in {LINES_A_TRIANGLE * most} lines; decimate the mesh")
        try:
            if len(line) == LONGEST_LINE:
                raise ValueError
            _take(line.partition(b"#")[0].split(), coordinates, indices)
        except (ValueError, OverflowError):
            text = short(line.decode(errors="replace").strip(), 80)
            raise FlightError(f"{path}, line {number}: '{text}' is no vertex (v x y z) or face (f i j k)") from None
    if not indices:
        raise FlightError(f"{path}: the mesh has no faces (lines 'f i j k')")
    vertices, faces = scale * np.array(coordinates).reshape(-1, 3), np.array(indices).reshape(-1, 3)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise FlightError(f"{path}: a face names a vertex that is not there; the file has {len(vertices)} vertices")
    require_closed(vertices, faces, str(path))
    return vertices, faces


def _take(words, coordinates, indices):
    """Append what one line says. Raises ValueError where it says a vertex or face wrongly."""
    if words[:1] == [b"v"]:
        x, y, z = words[1:4]
        coordinates.extend((float(x), float(y), float(z)))
    elif words[:1] == [b"f"]:
        if not 4 <= len(words) <= MOST_CORNERS + 1:
            raise ValueError
        corners = [_index(word, len(coordinates) // 3) for word in words[1:]]
        for i in range(1, len(corners) - 1):
            indices.extend((corners[0], corners[i], corners[i + 1]))


def _index(word, count):
    """A corner ``i``, ``i/t`` or ``i/t/n``: from 1, or negative from the end."""
    index = int(word.split(b"/")[0])
    if index == 0:
        raise ValueError
    return index - 1 if index > 0 else count + index


def require_closed(vertices, faces, name: str) -> None:
    """Refuse a mesh that does not bound a volume with its faces' normals outward. Raises FlightError."""
    if not np.isfinite(vertices).all():
        raise FlightError(f"{name}: vertex {int(np.argmin(np.isfinite(vertices).all(axis=1))) + 1} is not finite")
    if len(vertices) and np.abs(vertices).max() > FARTHEST:
        raise FlightError(f"{name}: vertex {int(np.abs(vertices).max(axis=1).argmax()) + 1} is more than {FARTHEST:g} m "
                          "from the origin; is the scale right?")
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    used = corners.reshape(-1, 3)
    thin = np.flatnonzero(area <= SMALLEST_AREA * np.ptp(used, axis=0).max() ** 2)
    if len(thin):
        raise FlightError(f"{name}: {len(thin)} degenerate faces without an area, the first one is face {thin[0] + 1} "
                          f"(vertices {_list(faces[thin[0]])}); remove them")
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges, inverse, count = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    if (count == 1).any():
        hint = "; some vertices coincide, weld them" if len(np.unique(used, axis=0)) < len(np.unique(faces)) else ""
        raise FlightError(f"{name}: the mesh has a hole: {int((count == 1).sum())} edges belong to one face only, the "
                          f"first one joins vertices {_list(edges[np.argmax(count == 1)])}{hint}")
    if (count > 2).any():
        raise FlightError(f"{name}: {int((count > 2).sum())} edges belong to more than two faces, the first one joins "
                          f"vertices {_list(edges[np.argmax(count > 2)])}; the surface must be a closed 2-manifold")
    turns = np.bincount(inverse.reshape(-1), weights=np.where(directed[:, 0] < directed[:, 1], 1.0, -1.0))
    if turns.any():
        raise FlightError(f"{name}: neighbouring faces are wound against each other at {int((turns != 0).sum())} edges"
                          f", the first one joins vertices {_list(edges[np.argmax(turns != 0)])}; orient all faces "
                          "counter-clockwise seen from outside")
    if volume(vertices, faces) <= 0.0:
        raise FlightError(f"{name}: the mesh is inside out (its volume is {volume(vertices, faces):.4g} m^3); reverse "
                          "the order of each face's vertices")


def _list(indices):
    return ", ".join(str(int(index) + 1) for index in indices)


def volume(vertices, faces) -> float:
    """Enclosed volume [m^3], negative for a mesh that is inside out."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return math.fsum((a * np.cross(b, c)).ravel().tolist()) / 6.0


def centroid(vertices, faces) -> np.ndarray:
    """Centre of the enclosed volume (3,) [m]."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    sixfold = (a * np.cross(b, c)).sum(axis=1)
    return (sixfold[:, None] * (a + b + c)).sum(axis=0) / (4.0 * sixfold.sum())


def icosphere(frequency: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit sphere: an icosahedron whose edges are cut into ``frequency`` parts, 20 frequency^2 faces, outward."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corners = np.array([(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0), (0, -1, golden),
                        (0, 1, golden), (0, -1, -golden), (0, 1, -golden), (golden, 0, -1), (golden, 0, 1),
                        (-golden, 0, -1), (-golden, 0, 1)])
    triangles = np.array([(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
                          (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5),
                          (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)])
    n = frequency
    rows = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    number = {ij: k for k, ij in enumerate(rows)}
    weights = np.array([(n - i - j, i, j) for i, j in rows], float) / n
    local = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in rows if i + j < n]
    local += [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in rows if i + j < n - 1]
    a, b, c = (corners[triangles[:, k], None] for k in range(3))  # (20, 1, 3), for each weight
    points = (weights[:, :1] * a + weights[:, 1:2] * b + weights[:, 2:] * c).reshape(-1, 3)
    faces = (np.array(local)[None] + len(rows) * np.arange(20)[:, None, None]).reshape(-1, 3)
    _, first, inverse = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    points = points[first]
    x, y, z = points.T
    return points / np.sqrt(x * x + y * y + z * z)[:, None], inverse.reshape(-1)[faces].astype(np.int64)
