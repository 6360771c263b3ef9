"""A site on a rotating small body: what somebody who stands there feels.

Site frame: x east, y north, z up (REP 103), up against the effective gravity (attraction and centrifugal), so gravity
is (0, 0, -g). The ground is tilted by the slope: its normal leans by ``tilt`` towards ``azimuth``, counted from east
to north. Around the site gravity is g(dx) = (0, 0, -g) + gradient dx; a moving thing feels the Coriolis acceleration
of ``spin`` besides. The gradient is taken HEIGHT above the ground, because on a mesh's edge it is singular.
"""

import math
from dataclasses import dataclass

import numpy as np

from flight_graph.errors import FlightError
from flight_math import (
    Mat3,
    Vec3,
    atan2,
    cross,
    dot,
    from_rows,
    kernel,
    norm,
    normalised,
    sincos,
    transpose,
    uncompiled,
)

HEIGHT = 0.1  # [m]
POLE = 0.5 * math.pi  # [rad]


@dataclass(frozen=True)
class Site:
    """position, normal, gravity (3,): body axes; to_site (3, 3): body axes -> site frame; the rest: site frame."""

    position: np.ndarray  # [m]
    normal: np.ndarray
    gravity: np.ndarray  # [m/s^2] effective
    to_site: np.ndarray
    size: float  # g [m/s^2]
    tilt: float  # [rad]
    azimuth: float  # [rad]
    gradient: np.ndarray  # (3, 3) [1/s^2] of effective gravity
    spin: np.ndarray  # (3,) [rad/s]


def effective_gravity(body, spin_rate: float, point) -> np.ndarray:
    """Attraction and centrifugal acceleration (3,) [m/s^2] at a point (3,) [m] that turns with the body."""
    x, y, _ = point
    return body.field(np.asarray(point, float))[0] + spin_rate * spin_rate * np.array([x, y, 0.0])


@kernel
def axes_of_site(up, longitude):
    """The rotation from body axes to east, north, up. East stays defined at the poles."""
    sine, cosine = sincos(longitude)
    level = Vec3(-sine, cosine, 0.0)
    east = normalised(level - dot(level, up) * up)
    return from_rows(east, cross(up, east), up)


@kernel
def lean_of(normal):
    """Angle of a normal from z, and where it leans, from x to y [rad]."""
    return atan2(math.sqrt(normal.x * normal.x + normal.y * normal.y), normal.z), atan2(normal.y, normal.x)


def site(body, spin_rate: float, latitude: float, longitude: float) -> Site:
    """The site of a body (see bodies.py) at planetocentric latitude and longitude [rad]. Raises FlightError."""
    if not abs(latitude) <= POLE + 1e-4:
        raise FlightError(f"latitude: {latitude:g} rad is off the body; allowed: -pi/2 to pi/2 ({POLE:.6g}) rad")
    if not math.isfinite(longitude):
        raise FlightError(f"longitude: {longitude} rad is no direction; allowed: a finite number")
    latitude = max(-POLE, min(POLE, latitude))
    position, normal = body.surface(latitude, longitude)
    gravity = Vec3(*effective_gravity(body, spin_rate, position))
    size, into_ground = float(norm(gravity)), -dot(gravity, Vec3(*normal))
    if not into_ground > 0.0:
        raise FlightError(f"at latitude {latitude:g}, longitude {longitude:g} rad nothing holds a rover down: "
                          f"effective gravity is {size:.3g} m/s^2, {into_ground:.3g} m/s^2 of it into the ground")
    to_site = uncompiled(axes_of_site)(-gravity / size, longitude)
    tilt, azimuth = uncompiled(lean_of)(to_site @ Vec3(*normal))
    attraction = Mat3(body.field(position + HEIGHT * normal)[1])
    centrifugal = spin_rate * spin_rate * Mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    gradient = to_site @ (attraction + centrifugal) @ transpose(to_site)
    return Site(position, normal, np.array(gravity), _matrix(to_site), size, float(tilt), float(azimuth),
                _matrix(gradient), np.array(to_site @ Vec3(0.0, 0.0, spin_rate)))


def _matrix(value) -> np.ndarray:
    return np.reshape(value.parts(), (3, 3))
