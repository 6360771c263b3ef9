"""A spinning-top body: a superellipsoid with sharp shoulders at the equator, in closed form.

    r(d) = [((d_x/a)^2 + (d_y/b)^2)^(p/2) + |d_z/c|^p]^(-1/p),     V = (4 pi a b c / p) B(2/p, 1 + 1/p)

d: unit direction, B: Euler's beta function; p = 2 is the ellipsoid, p = 1 a double cone, p >= 1 is convex. With the
semi-axes and the volume of a body published, p follows (`exponent_for_volume`).
"""

import math
from typing import NamedTuple

import numpy as np

from sim_nodes.gravity.mesh import icosphere


class Superellipsoid(NamedTuple):
    """Semi-axes a, b, c [m] along the body's x, y, z and the exponent p."""

    a: float
    b: float
    c: float
    p: float

    def radius(self, direction):
        """Distance from the centre [m] in unit directions (..., 3)."""
        d = np.asarray(direction, float)
        round_part = (d[..., 0] / self.a) ** 2 + (d[..., 1] / self.b) ** 2
        return (round_part ** (0.5 * self.p) + np.abs(d[..., 2] / self.c) ** self.p) ** (-1.0 / self.p)

    def normal(self, point) -> np.ndarray:
        """Outward unit normal (3,) at a surface point (3,) [m]."""
        x, y, z = point
        round_part = (x / self.a) ** 2 + (y / self.b) ** 2
        slope = round_part ** (0.5 * self.p - 1.0) if round_part > 0.0 else 0.0
        raw = np.array([slope * x / self.a**2, slope * y / self.b**2,
                        math.copysign(abs(z / self.c) ** (self.p - 1.0) / self.c, z) if z else 0.0])
        return raw / np.linalg.norm(raw)

    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return volume(self.a, self.b, self.c, self.p)

    def mesh(self, frequency: int) -> tuple[np.ndarray, np.ndarray]:
        """Triangle mesh inscribed in the body: vertices (n, 3) [m] and faces (20 frequency^2, 3)."""
        directions, faces = icosphere(frequency)
        return self.radius(directions)[:, None] * directions, faces


def volume(a: float, b: float, c: float, p: float) -> float:
    """V = (4 pi a b c / p) B(2/p, 1 + 1/p) [m^3]."""
    beta = math.gamma(2.0 / p) * math.gamma(1.0 + 1.0 / p) / math.gamma(1.0 + 3.0 / p)
    return 4.0 * math.pi * a * b * c / p * beta


def exponent_for_volume(a: float, b: float, c: float, wanted: float) -> float:
    """The p in [0.5, 50] for which the volume is as wanted [m^3], by bisection: the volume grows with p."""
    low, high = 0.5, 50.0
    if not volume(a, b, c, low) <= wanted <= volume(a, b, c, high):
        raise ValueError(f"no superellipsoid with semi-axes {a}, {b}, {c} m has a volume of {wanted} m^3")
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if volume(a, b, c, middle) < wanted else (low, middle)
    return 0.5 * (low + high)
