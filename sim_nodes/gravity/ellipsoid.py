"""Gravity of a homogeneous triaxial ellipsoid in closed form, and landing sites on its surface.

  g_i = -mu x_i R_D(others^2 + lambda; a_i^2 + lambda)
  lambda = the largest root of sum x_i^2/(a_i^2 + lambda) = 1; 0 inside

with Carlson's R_D (B. C. Carlson, "Numerical computation of real or complex elliptic integrals", Numerical Algorithms
10, 13-26 (1995)): exact down to the surface, where spherical harmonics diverge.
Axes of A: the body's principal axes, fixed in it, origin at its centre. Units SI.
"""

import math
from typing import NamedTuple

from flight_graph.errors import FlightError
from flight_math import Mat3, Vec3, cross, dot, from_columns, kernel, largest, normalised, sincos, total, uncompiled

SERIES_TOLERANCE = 1.5e-3  # [-] the error of Carlson's truncated series is of the order of its sixth power


class Ellipsoid(NamedTuple):
    """A homogeneous triaxial ellipsoid: any record with these fields serves as `p` of `ellipsoid_gravity`."""

    mu: float  # gravitational parameter [m^3/s^2]
    semi_axes: Vec3  # [m] along x, y, z of A


def eros_like() -> Ellipsoid:
    """The reference body (ours): an ellipsoid with the elongation of Eros."""
    return Ellipsoid(mu=446300.0, semi_axes=Vec3(17740.0, 6470.0, 5300.0))  # [m^3/s^2], [m]


EROS_LIKE_SPIN = 3.31166e-4  # [rad/s] about z_A


@kernel
def carlson_rd(x, y, z):
    """Carlson's R_D(x, y; z) = (3/2) int_0^inf dt / [(t + z) sqrt((t + x)(t + y)(t + z))], x, y >= 0, z > 0."""
    gathered = 0.0
    power = 1.0
    mean = (x + y + 3.0 * z) / 5.0
    while max(abs(mean - x), abs(mean - y), abs(mean - z)) > SERIES_TOLERANCE * mean:
        root_x, root_y, root_z = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        step = root_x * (root_y + root_z) + root_y * root_z
        gathered += power / (root_z * (z + step))
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
    return 3.0 * gathered + power * series / (mean * math.sqrt(mean))


@kernel
def ellipsoid_lambda(semi_axes, place):
    """lambda [m^2], the confocal coordinate of a place [m]: 0 on the surface and inside.

    Newton from below on a convex, falling function: it climbs to the root and stops where it no longer rises.
    """
    axes, squares = semi_axes * semi_axes, place * place
    value = max(0.0, total(squares) - largest(axes))
    for _ in range(60):
        terms = squares / (axes + value)
        excess = total(terms) - 1.0
        if excess <= 0.0:
            break
        better = value + excess / total(terms / (axes + value))
        if better <= value:
            break
        value = better
    return value


@kernel
def ellipsoid_gravity(p, place):
    """g^A [m/s^2] at a place [m] in A, inside the body too. p: `Ellipsoid` or its like."""
    a = p.semi_axes * p.semi_axes + ellipsoid_lambda(p.semi_axes, place)
    return -p.mu * place * Vec3(carlson_rd(a.y, a.z, a.x), carlson_rd(a.z, a.x, a.y), carlson_rd(a.x, a.y, a.z))


@kernel
def unit_direction(latitude, longitude):
    """(cos cos, cos sin, sin) of two angles [rad]."""
    sin_latitude, cos_latitude = sincos(latitude)
    sin_longitude, cos_longitude = sincos(longitude)
    return Vec3(cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude)


@kernel
def ellipsoid_site(p):
    """Place rho [m] in A and R_AD (D -> A, columns x, y, z) of a landing-site frame D over an ellipsoid.

    p: semi_axes [m]; site_latitude, site_longitude [rad], the parametric angles of the surface point (a cos cos,
    b cos sin, c sin); D stands site_height [m] above it on the outward normal z_D.
    """
    unit = unit_direction(p.site_latitude, p.site_longitude)
    up = normalised(unit / p.semi_axes)
    return p.semi_axes * unit + p.site_height * up, frame_on(up)


@kernel
def frame_on(up):
    """R_AD of a unit normal z_D = up: x_D = k x z_D / |.| (east), y_D = z_D x x_D."""
    east = normalised(Vec3(-up.y, up.x, 0.0))
    return from_columns(east, cross(up, east), up)


def checked_ellipsoid_site(p) -> tuple[Vec3, Mat3]:
    """`ellipsoid_site` of a ``p`` that may be wrong. Raises FlightError."""
    if not all(math.isfinite(axis) and axis > 0.0 for axis in p.semi_axes):
        raise FlightError(f"semi_axes must be three positive lengths [m], got {tuple(map(float, p.semi_axes))}")
    if not math.isfinite(p.site_height) or p.site_height < 0.0:
        raise FlightError(f"the landing site lies inside the body: height is {p.site_height} m; it must be >= 0 m")
    if not math.isfinite(p.site_longitude) or not abs(p.site_latitude) < 0.5 * math.pi:
        raise FlightError(
            f"latitude must lie between -pi/2 and pi/2 rad (no east at a pole) and longitude be finite, "
            f"got {p.site_latitude} and {p.site_longitude} rad"
        )
    return uncompiled(ellipsoid_site)(p)


def site_frame(normal) -> Mat3:
    """R_AD of a site with the outward ``normal`` (any length). Raises FlightError along the spin axis."""
    if normal.x == 0.0 and normal.y == 0.0:
        raise FlightError("the landing site's normal is along the spin axis: east is not defined there")
    return uncompiled(frame_on)(normalised(normal))


def require_outside(semi_axes, place) -> None:
    """Refuse a place [m] in A that lies inside the ellipsoid."""
    scaled = dot(place / semi_axes, place / semi_axes)
    if not scaled >= 1.0:
        raise FlightError(
            f"the landing site {tuple(float(x) for x in place)} m lies inside the body: "
            f"sum (x_i/a_i)^2 is {scaled:.6f}, it must be >= 1"
        )
