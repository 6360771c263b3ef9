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
from flight_graph.kernel import kernel


class Polyhedron(NamedTuple):
    """A closed triangle mesh of constant density. Any record with these fields serves as `body` below."""

    vertices: np.ndarray  # (n, 3) [m]
    faces: np.ndarray  # (m, 3) int64, counter-clockwise seen from outside
    strength: float  # G sigma [1/s^2]: gravitational parameter over volume


@kernel
def line_term(r_1, r_2, length):
    """L_e; 0 on the edge itself, where it is only used with a factor that vanishes."""
    rest = r_1 + r_2 - length
    if rest <= 1e-14 * length:  # [-] rounding of the two distances
        return 0.0
    return math.log((r_1 + r_2 + length) / rest)


@kernel
def solid_angle(a_x, a_y, a_z, b_x, b_y, b_z, c_x, c_y, c_z, a, b, c):
    """Solid angle [sr] of the triangle with corners a, b, c (lengths a, b, c) seen from the origin, signed."""
    numerator = (a_x * (b_y * c_z - b_z * c_y) + a_y * (b_z * c_x - b_x * c_z) + a_z * (b_x * c_y - b_y * c_x))
    denominator = (a * b * c + a * (b_x * c_x + b_y * c_y + b_z * c_z) + b * (c_x * a_x + c_y * a_y + c_z * a_z)
                   + c * (a_x * b_x + a_y * b_y + a_z * b_z))
    return 2.0 * math.atan2(numerator, denominator)


@kernel
def edge_terms(a_x, a_y, a_z, b_x, b_y, b_z, a, b, n_x, n_y, n_z):
    """(nu . r) L and nu L (three floats) of the edge from a to b in the plane with normal n."""
    x, y, z = b_x - a_x, b_y - a_y, b_z - a_z
    length = math.sqrt(x * x + y * y + z * z)
    line = line_term(a, b, length) / length
    nu_x, nu_y, nu_z = (y * n_z - z * n_y) * line, (z * n_x - x * n_z) * line, (x * n_y - y * n_x) * line
    return nu_x * a_x + nu_y * a_y + nu_z * a_z, nu_x, nu_y, nu_z


@kernel
def faces_field(vertices, faces, count, strength, x, y, z):
    """Gravity g (3 floats) [m/s^2] and its gradient (xx, xy, xz, yy, yz, zz) [1/s^2] at (x, y, z) [m], body axes.

    Of the first ``count`` faces; the arrays may be longer, and hold whole numbers as floats.
    """
    g_x, g_y, g_z = 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for f in range(count):
        i, j, k = int(faces[f, 0]), int(faces[f, 1]), int(faces[f, 2])
        a_x, a_y, a_z = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
        b_x, b_y, b_z = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
        c_x, c_y, c_z = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
        a = math.sqrt(a_x * a_x + a_y * a_y + a_z * a_z)
        b = math.sqrt(b_x * b_x + b_y * b_y + b_z * b_z)
        c = math.sqrt(c_x * c_x + c_y * c_y + c_z * c_z)
        p_x, p_y, p_z = b_x - a_x, b_y - a_y, b_z - a_z
        q_x, q_y, q_z = c_x - a_x, c_y - a_y, c_z - a_z
        n_x, n_y, n_z = p_y * q_z - p_z * q_y, p_z * q_x - p_x * q_z, p_x * q_y - p_y * q_x
        size = math.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
        n_x, n_y, n_z = n_x / size, n_y / size, n_z / size
        omega = solid_angle(a_x, a_y, a_z, b_x, b_y, b_z, c_x, c_y, c_z, a, b, c)
        s_1, x_1, y_1, z_1 = edge_terms(a_x, a_y, a_z, b_x, b_y, b_z, a, b, n_x, n_y, n_z)
        s_2, x_2, y_2, z_2 = edge_terms(b_x, b_y, b_z, c_x, c_y, c_z, b, c, n_x, n_y, n_z)
        s_3, x_3, y_3, z_3 = edge_terms(c_x, c_y, c_z, a_x, a_y, a_z, c, a, n_x, n_y, n_z)
        surface = s_1 + s_2 + s_3 - (n_x * a_x + n_y * a_y + n_z * a_z) * omega
        t_x, t_y, t_z = x_1 + x_2 + x_3 - n_x * omega, y_1 + y_2 + y_3 - n_y * omega, z_1 + z_2 + z_3 - n_z * omega
        g_x -= n_x * surface
        g_y -= n_y * surface
        g_z -= n_z * surface
        xx += n_x * t_x
        xy += 0.5 * (n_x * t_y + n_y * t_x)
        xz += 0.5 * (n_x * t_z + n_z * t_x)
        yy += n_y * t_y
        yz += 0.5 * (n_y * t_z + n_z * t_y)
        zz += n_z * t_z
    s = strength
    return s * g_x, s * g_y, s * g_z, s * xx, s * xy, s * xz, s * yy, s * yz, s * zz


@kernel
def polyhedron_field(body, x, y, z):
    """`faces_field` of a ``body``: `Polyhedron` or its like."""
    return faces_field(body.vertices, body.faces, body.faces.shape[0], body.strength, x, y, z)


@kernel
def polyhedron_gravity(body, x, y, z):
    """Gravity (three floats) [m/s^2] at (x, y, z) [m] in body axes; ``body``: `Polyhedron` or its like."""
    terms = polyhedron_field(body, x, y, z)
    return terms[0], terms[1], terms[2]


@kernel
def _fields(vertices, faces, strength, points, out):
    for i in range(points.shape[0]):
        terms = faces_field(vertices, faces, faces.shape[0], strength[0, 0], points[i, 0], points[i, 1], points[i, 2])
        for j in range(9):
            out[i, j] = terms[j]


FIELDS = Kept(f"{__name__}:FIELDS", _fields, 5)


def evaluate(body: Polyhedron, points) -> tuple[np.ndarray, np.ndarray]:
    """Gravity (k, 3) [m/s^2] and gravity gradient (k, 3, 3) [1/s^2] at points (k, 3) [m]."""
    points = np.ascontiguousarray(np.atleast_2d(np.asarray(points, float)))
    out = np.zeros((len(points), 9))
    FIELDS(np.ascontiguousarray(body.vertices, float), np.ascontiguousarray(body.faces, float),
           np.array([[body.strength]], float), points, out)
    return out[:, :3], out[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
