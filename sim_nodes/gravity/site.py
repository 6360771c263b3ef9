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


def site(body, spin_rate: float, latitude: float, longitude: float) -> Site:
    """The site of a body (see bodies.py) at planetocentric latitude and longitude [rad]. Raises FlightError."""
    if not abs(latitude) <= POLE + 1e-4:
        raise FlightError(f"latitude: {latitude:g} rad is off the body; allowed: -pi/2 to pi/2 ({POLE:.6g}) rad")
    if not math.isfinite(longitude):
        raise FlightError(f"longitude: {longitude} rad is no direction; allowed: a finite number")
    latitude = max(-POLE, min(POLE, latitude))
    position, normal = body.surface(latitude, longitude)
    gravity = effective_gravity(body, spin_rate, position)
    size = float(np.linalg.norm(gravity))
    if not -gravity @ normal > 0.0:
        raise FlightError(f"at latitude {latitude:g}, longitude {longitude:g} rad nothing holds a rover down: "
                          f"effective gravity is {size:.3g} m/s^2, {-gravity @ normal:.3g} m/s^2 of it into the ground")
    up = -gravity / size
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])  # stays defined at the poles
    east = east - (east @ up) * up
    east = east / np.linalg.norm(east)
    to_site = np.vstack([east, np.cross(up, east), up])
    lean = to_site @ normal
    gradient = body.field(position + HEIGHT * normal)[1] + spin_rate * spin_rate * np.diag([1.0, 1.0, 0.0])
    return Site(position, normal, gravity, to_site, size, math.atan2(math.hypot(lean[0], lean[1]), lean[2]),
                math.atan2(lean[1], lean[0]), to_site @ gradient @ to_site.T, to_site @ np.array([0.0, 0.0, spin_rate]))
