"""Gravity of a homogeneous triaxial ellipsoid in closed form, and landing sites on its surface.

  g_i = -mu x_i R_D(others^2 + lambda; a_i^2 + lambda)
  lambda = the largest root of sum x_i^2/(a_i^2 + lambda) = 1; 0 inside

with Carlson's R_D (B. C. Carlson, "Numerical computation of real or complex elliptic integrals", Numerical Algorithms
10, 13-26 (1995)): exact down to the surface, where spherical harmonics diverge.
Axes of A: the body's principal axes, fixed in it, origin at its centre. Units SI.
"""

import math
from typing import NamedTuple

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.kernel import kernel

SERIES_TOLERANCE = 1.5e-3  # [-] the error of Carlson's truncated series is of the order of its sixth power


class Ellipsoid(NamedTuple):
    """A homogeneous triaxial ellipsoid: any record with these fields serves as `field` of `ellipsoid_gravity`."""

    mu: float  # gravitational parameter [m^3/s^2]
    semi_axes: np.ndarray  # (3,) [m] along x, y, z of A


def eros_like() -> Ellipsoid:
    """The reference body (ours): an ellipsoid with the elongation of Eros."""
    return Ellipsoid(mu=446300.0, semi_axes=np.array([17740.0, 6470.0, 5300.0]))  # [m^3/s^2], [m]


EROS_LIKE_SPIN = 3.31166e-4  # [rad/s] about z_A


@kernel
def carlson_rd(x, y, z):
    """Carlson's R_D(x, y; z) = (3/2) int_0^inf dt / [(t + z) sqrt((t + x)(t + y)(t + z))], x, y >= 0, z > 0."""
    total = 0.0
    power = 1.0
    mean = (x + y + 3.0 * z) / 5.0
    while max(abs(mean - x), abs(mean - y), abs(mean - z)) > SERIES_TOLERANCE * mean:
        root_x, root_y, root_z = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        step = root_x * (root_y + root_z) + root_y * root_z
        total += power / (root_z * (z + step))
        power *= 0.25
        x, y, z = 0.25 * (x + step), 0.25 * (y + step), 0.25 * (z + step)
        mean = (x + y + 3.0 * z) / 5.0
    dx, dy = (mean - x) / mean, (mean - y) / mean
    dz = -(dx + dy) / 3.0
    xy, z2 = dx * dy, dz * dz
    e2 = xy - 6.0 * z2
    e3 = (3.0 * xy - 8.0 * z2) * dz
    e4 = 3.0 * (xy - z2) * z2
    e5 = xy * z2 * dz
    series = (
        1.0
        - 3.0 * e2 / 14.0
        + e3 / 6.0
        + 9.0 * e2 * e2 / 88.0
        - 3.0 * e4 / 22.0
        - 9.0 * e2 * e3 / 52.0
        + 3.0 * e5 / 26.0
    )
    return 3.0 * total + power * series / (mean * math.sqrt(mean))


@kernel
def ellipsoid_lambda(semi_axes, x, y, z):
    """lambda [m^2], the confocal coordinate of the point (x, y, z) [m]: 0 on the surface and inside.

    Newton from below on a convex, falling function: it climbs to the root and stops where it no longer rises.
    """
    a2, b2, c2 = semi_axes[0] * semi_axes[0], semi_axes[1] * semi_axes[1], semi_axes[2] * semi_axes[2]
    x2, y2, z2 = x * x, y * y, z * z
    value = max(0.0, x2 + y2 + z2 - max(a2, b2, c2))
    for _ in range(60):
        ta, tb, tc = x2 / (a2 + value), y2 / (b2 + value), z2 / (c2 + value)
        excess = ta + tb + tc - 1.0
        if excess <= 0.0:
            break
        better = value + excess / (ta / (a2 + value) + tb / (b2 + value) + tc / (c2 + value))
        if better <= value:
            break
        value = better
    return value


@kernel
def ellipsoid_gravity(field, x, y, z):
    """g^A [m/s^2], a tuple of three, at (x, y, z) [m] in A; inside the body too. ``field``: `Ellipsoid` or its like."""
    axes = field.semi_axes
    value = ellipsoid_lambda(axes, x, y, z)
    a2, b2, c2 = axes[0] * axes[0] + value, axes[1] * axes[1] + value, axes[2] * axes[2] + value
    return (
        -field.mu * x * carlson_rd(b2, c2, a2),
        -field.mu * y * carlson_rd(c2, a2, b2),
        -field.mu * z * carlson_rd(a2, b2, c2),
    )


def ellipsoid_site(semi_axes, latitude, longitude, height) -> tuple[np.ndarray, np.ndarray]:
    """A landing-site frame D over an ellipsoid: origin rho (3,) [m] in A, and R_AD (3, 3) (D -> A, columns x, y, z).

    latitude, longitude [rad] are the parametric angles of the surface point (a cos cos, b cos sin, c sin); D stands
    ``height`` [m] above it on the outward normal z_D, with x_D = k x z_D / |.| (east) and y_D = z_D x x_D.
    """
    axes = np.array(semi_axes, dtype=float)
    if axes.shape != (3,) or not np.all(np.isfinite(axes)) or not np.all(axes > 0.0):
        raise FlightError(f"semi_axes must be three positive lengths [m], got {semi_axes!r}")
    if not math.isfinite(height) or height < 0.0:
        raise FlightError(f"the landing site lies inside the body: height is {height} m; it must be >= 0 m")
    if not math.isfinite(longitude) or not abs(latitude) < 0.5 * math.pi:
        raise FlightError(
            f"latitude must lie between -pi/2 and pi/2 rad (no east at a pole) and longitude be finite, "
            f"got {latitude} and {longitude} rad"
        )
    unit = np.array(
        [
            math.cos(latitude) * math.cos(longitude),
            math.cos(latitude) * math.sin(longitude),
            math.sin(latitude),
        ]
    )
    return site_frame(axes * unit + height * _unit(unit / axes), unit / axes)


def site_frame(position, normal) -> tuple[np.ndarray, np.ndarray]:
    """rho (3,) [m] and R_AD (3, 3) of a site at ``position`` [m] in A with the outward ``normal`` (any length)."""
    up = _unit(np.asarray(normal, dtype=float))
    east = np.array([-up[1], up[0], 0.0])
    if not np.any(east):
        raise FlightError("the landing site's normal is along the spin axis: east is not defined there")
    east = _unit(east)
    return np.array(position, dtype=float), np.column_stack([east, np.cross(up, east), up])


def require_outside(semi_axes, position) -> None:
    """Refuse a point (3,) [m] in A that lies inside the ellipsoid."""
    scaled = float(sum((np.asarray(position, dtype=float) / np.asarray(semi_axes, dtype=float)) ** 2))
    if not scaled >= 1.0:
        raise FlightError(
            f"the landing site {tuple(float(x) for x in position)} m lies inside the body: "
            f"sum (x_i/a_i)^2 is {scaled:.6f}, it must be >= 1"
        )


def _unit(vector):
    return vector / math.sqrt(sum(float(x) * float(x) for x in vector))
