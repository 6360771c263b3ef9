"""Gravity of a homogeneous polyhedron in closed form, everywhere outside it and on it.

Gauss's theorem turns the volume integral of the attraction into one over the surface, and each plane triangle has a
closed integral (r: from the field point to the face; n: outward unit normal; nu_e: in the face's plane, outward of
edge e):

    g = G sigma grad(int dV / r) = -G sigma sum_f n_f I_f,
    I_f = int_f dS / r = sum_e (nu_e . r_e) L_e - h_f omega_f,
    dg_i/dx_j = G sigma sum_f n_i (sum_e nu_e,j L_e - n_j omega_f),
    L_e = int_e dl / r = ln((r_1 + r_2 + l) / (r_1 + r_2 - l)),   h_f = n_f . r,   omega_f: solid angle of the face.

The sums are those of Werner and Scheeres (Celestial Mechanics 65, 313-344, 1997), face by face instead of edge by edge.
The trace of the gradient is -G sigma sum_f omega_f: 0 outside, -4 pi G sigma inside.
"""

import math
from typing import NamedTuple

import numpy as np

from flight_graph.engines.kept import Kept
from flight_math import Mat3, Vec, Vec3, atan2, cross, dot, inlined, kernel, log, norm, outer, vec3

Vec9 = Vec(9)


class Polyhedron(NamedTuple):
    """A closed triangle mesh of constant density."""

    vertices: np.ndarray  # (n, 3) [m]
    faces: np.ndarray  # (m, 3) int64, counter-clockwise seen from outside
    strength: float  # G sigma [1/s^2]: gravitational parameter over volume


@inlined
def edge_term(a, b, distances, n):
    """nu_e L_e of the edge from a to b in the plane with normal n; ``distances`` is r_1 + r_2.

    L_e = 2 artanh(t), t = l / (r_1 + r_2): a series in t^2 for a far edge. 0 on the edge itself, where it is only used
    with a factor that vanishes.
    """
    edge = b - a
    squared, near = dot(edge, edge), 1.0 / distances
    z = squared * near * near
    if z <= 1.0 / 64.0:  # [-] the term that follows is 3e-18 of the sum
        z2 = z * z
        low = (1.0 / 3.0 + z * (1.0 / 5.0)) + z2 * (1.0 / 7.0 + z * (1.0 / 9.0))
        high = (1.0 / 11.0 + z * (1.0 / 13.0)) + z2 * (1.0 / 15.0 + z * (1.0 / 17.0))
        return 2.0 * near * (1.0 + z * (low + z2 * z2 * high)) * cross(edge, n)
    length = math.sqrt(squared)
    rest = distances - length
    if rest <= 1e-14 * length:  # [-] rounding of the two distances
        return Vec3(0.0, 0.0, 0.0)
    return log((distances + length) / rest) / length * cross(edge, n)


@inlined
def face_terms(a, b, c):
    """n, I_f and sum_e nu_e L_e - n omega_f of the face with corners a, b, c [m], seen from the field point."""
    r_a, r_b, r_c = norm(a), norm(b), norm(c)
    normal = cross(b - a, c - a)
    n = 1.0 / norm(normal) * normal
    omega = 2.0 * atan2(dot(a, cross(b, c)), r_a * r_b * r_c + r_a * dot(b, c) + r_b * dot(c, a) + r_c * dot(a, b))
    ab, bc, ca = edge_term(a, b, r_a + r_b, n), edge_term(b, c, r_b + r_c, n), edge_term(c, a, r_c + r_a, n)
    surface = dot(ab, a) + dot(bc, b) + dot(ca, c) - dot(n, a) * omega
    return n, surface, ab + bc + ca - omega * n


@inlined
def corner(vertices, faces, f, k):
    """Corner k of face f [m]. The faces hold whole numbers as floats."""
    return vec3(vertices[int(faces[f, k])])


@kernel
def faces_gravity(vertices, faces, count, strength, place):
    """Gravity g [m/s^2] at a place [m] in body axes, of the first ``count`` faces: the arrays may be longer."""
    g = Vec3(0.0, 0.0, 0.0)
    for f in range(count):
        a, b, c = corner(vertices, faces, f, 0), corner(vertices, faces, f, 1), corner(vertices, faces, f, 2)
        n, surface, _ = face_terms(a - place, b - place, c - place)
        g = g - surface * n
    return strength * g


@kernel
def faces_field(vertices, faces, strength, place):
    """Gravity g [m/s^2] and its symmetric gradient [1/s^2] at a place [m] in body axes."""
    g, gradient = Vec3(0.0, 0.0, 0.0), Mat3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for f in range(faces.shape[0]):
        a, b, c = corner(vertices, faces, f, 0), corner(vertices, faces, f, 1), corner(vertices, faces, f, 2)
        n, surface, across = face_terms(a - place, b - place, c - place)
        g = g - surface * n
        gradient = gradient + 0.5 * (outer(n, across) + outer(across, n))
    return strength * g, strength * gradient


@kernel
def _fields(vertices, faces, strength, points, out):
    """`faces_field` at points (k, 3), into the rows of out (k, 12): g, then the gradient row by row."""
    for i in range(points.shape[0]):
        g, gradient = faces_field(vertices, faces, strength[0, 0], vec3(points[i]))
        out[i, 0:3], out[i, 3:12] = g, Vec9(gradient)


FIELDS = Kept(f"{__name__}:FIELDS", _fields, 5)


def evaluate(body: Polyhedron, points) -> tuple[np.ndarray, np.ndarray]:
    """Gravity (k, 3) [m/s^2] and gravity gradient (k, 3, 3) [1/s^2] at points (k, 3) [m]."""
    points = np.ascontiguousarray(np.atleast_2d(np.asarray(points, float)))
    out = np.zeros((len(points), 12))
    FIELDS(np.ascontiguousarray(body.vertices, float), np.ascontiguousarray(body.faces, float),
           np.array([[body.strength]], float), points, out)
    return out[:, :3], out[:, 3:].reshape(-1, 3, 3)
