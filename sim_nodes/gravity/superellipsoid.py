"""A spinning-top body: a superellipsoid with sharp shoulders at the equator, in closed form.

    r(d) = [((d_x/a)^2 + (d_y/b)^2)^(p/2) + |d_z/c|^p]^(-1/p),     V = (4 pi a b c / p) B(2/p, 1 + 1/p)

d: unit direction, B: Euler's beta function; p = 2 is the ellipsoid, p = 1 a double cone, p >= 1 is convex. With the
semi-axes and the volume of a body published, p follows (`exponent_for_volume`).
"""

import math
from typing import NamedTuple

import numpy as np

from flight_graph.engines.kept import Kept
from flight_math import Vec3, exp, kernel, normalised, power, uncompiled, vec3
from sim_nodes.gravity.mesh import icosphere

# Lanczos' approximation of the gamma function: Gamma(x) = (x + G - 1/2)^(x - 1/2) exp(1/2 - x - G) N(x)/D(x), with
# D(x) = x (x + 1) ... (x + 11). G and the coefficients of N, from the highest power on, are those of Boost and CPython.
LANCZOS_G = 6.024680040776729583740234375
LANCZOS_N = (
    2.506628274631000270164908177133837338626431079340, 210.8242777515793458725097339207133627116,
    8071.672002365816210638002902272250613822, 186056.2653952234950402949897160456992822,
    2876370.628935372441225409051620849613599, 31426415.58540019438061423162830820536287,
    248874557.8620541565114603864132294232163, 1439720407.311721673663223072794912393972,
    6039542586.352028005064291644307297921070, 17921034426.03720969991975575445893111267,
    35711959237.35566804944018545154716670596, 42919803642.64909876895789904700198885093,
    23531376880.41075968857200767445163675473)


class Superellipsoid(NamedTuple):
    """Semi-axes a, b, c [m] along the body's x, y, z and the exponent p."""

    a: float
    b: float
    c: float
    p: float

    def radius(self, directions):
        """Distance from the centre [m] in unit directions (..., 3)."""
        directions = np.asarray(directions, float)
        rows = np.ascontiguousarray(directions.reshape(-1, 3))
        found = np.zeros((len(rows), 1))
        RADII(np.array([self], float), rows, found)
        return found.reshape(directions.shape[:-1])

    def normal(self, point) -> np.ndarray:
        """Outward unit normal (3,) at a surface point (3,) [m]."""
        return np.array(uncompiled(outward)(self, Vec3(*point)))

    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return volume(self.a, self.b, self.c, self.p)

    def mesh(self, frequency: int) -> tuple[np.ndarray, np.ndarray]:
        """Triangle mesh inscribed in the body: vertices (n, 3) [m] and faces (20 frequency^2, 3)."""
        directions, faces = icosphere(frequency)
        return self.radius(directions)[:, None] * directions, faces


@kernel
def distance(shape, d):
    """r(d) [m]"""
    across = d.x / shape.a * (d.x / shape.a) + d.y / shape.b * (d.y / shape.b)
    return power(power(across, 0.5 * shape.p) + power(abs(d.z / shape.c), shape.p), -1.0 / shape.p)


@kernel
def outward(shape, point):
    """Outward unit normal at a surface point [m]."""
    across = point.x / shape.a * (point.x / shape.a) + point.y / shape.b * (point.y / shape.b)
    slope = power(across, 0.5 * shape.p - 1.0) if across > 0.0 else 0.0
    steep = power(abs(point.z / shape.c), shape.p - 1.0) / shape.c if point.z != 0.0 else 0.0
    return normalised(Vec3(slope * point.x / (shape.a * shape.a), slope * point.y / (shape.b * shape.b),
                           math.copysign(steep, point.z)))


@kernel
def _radii(shape, directions, out):
    """r(d) of rows d (n, 3), into out (n, 1); shape (1, 4): a, b, c, p."""
    body = Superellipsoid(shape[0, 0], shape[0, 1], shape[0, 2], shape[0, 3])
    for i in range(directions.shape[0]):
        out[i, 0] = distance(body, vec3(directions[i]))


RADII = Kept(f"{__name__}:RADII", _radii, 3)


@kernel
def lanczos_ratio(x):
    """N(x)/D(x), x > 0."""
    over, under = 0.0, 1.0
    for coefficient in LANCZOS_N:
        over = over * x + coefficient
    for k in range(12):
        under = under * (x + k)
    return over / under


@kernel
def beta(x, y):
    """B(x, y) = Gamma(x) Gamma(y) / Gamma(x + y), x, y > 0."""
    shift = LANCZOS_G - 0.5
    ratio = lanczos_ratio(x) * lanczos_ratio(y) / lanczos_ratio(x + y)
    return ratio * exp(-shift) * (power(x + shift, x - 0.5) * power(y + shift, y - 0.5) / power(x + y + shift, x + y - 0.5))


def volume(a: float, b: float, c: float, p: float) -> float:
    """V = (4 pi a b c / p) B(2/p, 1 + 1/p) [m^3]."""
    return float(4.0 * math.pi * a * b * c / p * uncompiled(beta)(2.0 / p, 1.0 + 1.0 / p))


def exponent_for_volume(a: float, b: float, c: float, wanted: float) -> float:
    """The p in [0.5, 50] for which the volume is as wanted [m^3], by bisection: the volume grows with p."""
    low, high = 0.5, 50.0
    if not volume(a, b, c, low) <= wanted <= volume(a, b, c, high):
        raise ValueError(f"no superellipsoid with semi-axes {a}, {b}, {c} m has a volume of {wanted} m^3")
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if volume(a, b, c, middle) < wanted else (low, middle)
    return 0.5 * (low + high)
