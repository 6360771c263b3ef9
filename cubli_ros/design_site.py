"""Where the Cubli rover is to balance, and what the ground force allows: the facts behind `cubli_ros.design`.

Eq. (9) of Aerospace 2022, 9(11), 728, made exact: the force at the corner along a reference, on the worst side of a
slope; the disturbance's share of it; the norms of eq. (2) that bound the rate inside of the funnels.
"""

import math
from dataclasses import dataclass

import numpy as np

from cubli_ros.attitude import body_rates, cardan_rates, to_body
from cubli_ros.reference import MINIMUM_JERK, shape
from flight_graph.errors import FlightError
from flight_math import Vec3, plain, sincos

PHASINGS = {"equal": (0.0, 0.0, 0.0), "120": (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)}  # [rad]
POINTS = 241  # along a reference
SIDES = 24  # azimuths of a slope
AXES = (Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Site:
    """Where the rover balances: gravity [m/s^2], tilt of the ground [rad], friction coefficient, disturbance.

    disturbance: d of eq. (42) per axis [rad/s^2]; phasing of the axes, ``equal`` or ``120`` degrees; frequency [rad/s].
    """

    gravity: float
    tilt: float = 0.0
    friction: float = 0.5
    disturbance: float = 0.0
    phasing: str = "equal"
    frequency: float = 1.0


@dataclass(frozen=True)
class Rover:
    """The rover: mass [kg], edge [m], wheel inertia [kg m^2], Cardan angles at the start [rad], gyro noise [rad/s].

    model: ``physical`` (inertia about the corner, less the wheels) or ``paper`` (the scalar m l^2 / 6).
    """

    mass: float = 2.0
    length: float = 0.2
    wheel_inertia: float = 1.0e-3
    start: tuple = (-0.3, 0.3, 0.3)
    gyro_sigma: float = 1.0e-4
    model: str = "physical"

    @property
    def inertia(self) -> np.ndarray:
        """(3, 3) [kg m^2]: what turns an acceleration demand into torque."""
        scale = self.mass * self.length**2
        if self.model == "paper":
            return scale / 6.0 * np.eye(3)
        return scale * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3))) - self.wheel_inertia * np.eye(3)

    @property
    def arm(self) -> float:
        """From the corner to the centre of mass [m]."""
        return 0.5 * math.sqrt(3.0) * self.length

    @property
    def start_tilt(self) -> float:
        """Angle between the body diagonal and up at the start [rad]."""
        up = plain(to_body)(sincos(Vec3(*self.start)), Vec3(1.0, 1.0, 1.0))
        return math.acos(min(1.0, sum(up) / 3.0))


@dataclass(frozen=True)
class Path:
    """A reference of unit time scale from the start to zero: contact and rates follow by scaling.

    s1, s2: derivatives of the shape (n,); turn, bend: body rate and its derivative per s', s'^2 (3, n); up: (3, n).
    """

    s1: np.ndarray
    s2: np.ndarray
    turn: np.ndarray
    bend: np.ndarray
    up: np.ndarray
    settled: float


def path(rover: Rover, form: int, settled_at: float = 0.008) -> Path:
    """The reference of `cubli_ros.reference` with q = 1 1/s or T = 1 s; settled_at [rad] ends it."""
    times = np.linspace(0.0, 1.0 if form == MINIMUM_JERK else 12.0, POINTS)
    s, s1, s2 = np.array([plain(shape)(form, t, 1.0, 1.0) for t in times]).T
    first = np.array(rover.start)

    def turn_at(at):
        return sincos(Vec3(*first * at))

    def rate(at):
        return np.array(plain(body_rates)(turn_at(at), Vec3(*first)))

    step = 1.0e-5  # [-] of s, for the derivative
    turn = np.array([rate(at) for at in s]).T
    bend = np.array([(rate(at + step) - rate(at - step)) / (2.0 * step) for at in s]).T
    upright = Vec3(*[1.0 / math.sqrt(3.0)] * 3)
    up = np.array([plain(to_body)(turn_at(at), upright) for at in s]).T
    outside = np.flatnonzero(s * np.abs(first).max() > settled_at)
    return Path(s1, s2, turn, bend, up, float(times[outside[-1]]) if len(outside) else 0.0)


def contact(rover: Rover, site: Site, along: Path, scale: float) -> dict:
    """Friction ratio, normal force [m g], rates [rad/s] along a reference of time scale `scale` [s], worst side up."""
    omega = along.turn * along.s1 / scale
    omega_dot = (along.turn * along.s2 + along.bend * along.s1**2) / scale**2
    force = centre_acceleration(rover, omega, omega_dot) / site.gravity + along.up
    east = np.cross(along.up.T, [1.0, -1.0, 0.0]).T
    east /= np.linalg.norm(east, axis=0)
    north = np.cross(along.up.T, east.T).T
    friction, normal_least = 0.0, math.inf
    for side in np.linspace(0.0, 2.0 * math.pi, SIDES if site.tilt else 1, endpoint=False):
        normal = math.cos(site.tilt) * along.up + math.sin(site.tilt) * (math.cos(side) * east + math.sin(side) * north)
        pressing = (force * normal).sum(axis=0)
        sliding = np.linalg.norm(force - pressing * normal, axis=0)
        ratio = np.where(pressing > 0.0, sliding / np.where(pressing > 0.0, pressing, 1.0), np.inf)
        friction, normal_least = max(friction, float(ratio.max())), min(normal_least, float(pressing.min()))
    across = omega - omega.mean(axis=0)
    return {"friction": friction, "normal": normal_least, "rate": float(np.linalg.norm(omega, axis=0).max()),
            "across": float(np.linalg.norm(across, axis=0).max())}


def centre_acceleration(rover: Rover, omega: np.ndarray, omega_dot: np.ndarray) -> np.ndarray:
    """`jump_condition.centre_acceleration` (3, n) [m/s^2] of whole arrays of rates and their derivatives (3, n)."""
    arm = np.full((3, 1), 0.5 * rover.length)
    return np.cross(omega_dot, arm, axis=0) + np.cross(omega, np.cross(omega, arm, axis=0), axis=0)


def disturbance_friction(rover: Rover, site: Site) -> float:
    """Friction ratio that the disturbance needs at its largest, before anything compensates it; upright rover."""
    phases = np.array(PHASINGS[site.phasing])
    scale = rover.mass * rover.length**2 / 6.0
    gain = scale * np.linalg.inv(rover.inertia)
    turning = gain @ (site.disturbance * np.sin(np.linspace(0.0, math.pi, 60) + phases[:, None]))
    largest = float(np.linalg.norm(centre_acceleration(rover, np.zeros_like(turning), turning), axis=0).max())
    return largest / (site.gravity * math.cos(site.tilt)) if largest > 1e-12 else 0.0  # [m/s^2] rounding


def norms(rover: Rover, reach: float) -> tuple:
    """Largest (|G|_inf, |G^-1|_inf, |G^-1|_2) for |theta|, |psi| up to `reach` [rad], eq. (2)."""
    largest = [0.0, 0.0, 0.0]
    for theta in np.linspace(-reach, reach, 21):
        for psi in np.linspace(-reach, reach, 21):
            turn = sincos(Vec3(0.0, theta, psi))
            forward, inverse = (np.array([plain(law)(turn, axis) for axis in AXES]).T for law in (cardan_rates, body_rates))
            found = (np.abs(forward).sum(axis=1).max(), np.abs(inverse).sum(axis=1).max(), np.linalg.norm(inverse, 2))
            largest = [max(pair) for pair in zip(largest, found)]
    return tuple(map(float, largest))


def check(site: Site, rover: Rover) -> None:
    """Refuse what no design can meet. Raises FlightError."""
    numbers = {"gravity": site.gravity, "tilt": site.tilt, "friction": site.friction, "disturbance": site.disturbance,
               "frequency": site.frequency, "gyro noise": rover.gyro_sigma}
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise FlightError(f"{name}: {value} is not allowed; allowed: a finite number")
    if site.gravity <= 0.0:
        raise FlightError(f"gravity: {site.gravity:g} m/s^2 is not allowed; allowed: greater than 0 (without gravity "
                          "nothing holds the rover on the ground)")
    if site.friction <= 0.0:
        raise FlightError(f"friction: {site.friction:g} is not allowed; allowed: greater than 0 (on frictionless "
                          "ground the corner slides whatever the law does)")
    for name in ("disturbance", "frequency", "tilt", "gyro noise"):
        if numbers[name] < 0.0:
            raise FlightError(f"{name}: {numbers[name]:g} is not allowed; allowed: 0 or more")
    if site.tilt >= 0.5 * math.pi or math.tan(site.tilt) >= site.friction:
        raise FlightError(
            f"tilt: on ground tilted by {site.tilt:g} rad a rover at rest needs a friction coefficient of "
            f"{math.tan(min(site.tilt, 1.5)):.3g}, there is {site.friction:g}; allowed: less than "
            f"{math.atan(site.friction):.3g} rad")
    if site.phasing not in PHASINGS:
        raise FlightError(f"phasing: '{site.phasing}' is not allowed; allowed: {', '.join(PHASINGS)}")
    if rover.model not in ("physical", "paper"):
        raise FlightError(f"model: '{rover.model}' is not allowed; allowed: physical, paper")
    if len(rover.start) != 3 or not all(math.isfinite(angle) for angle in rover.start) or not (
            1e-3 <= max(map(abs, rover.start)) and max(abs(rover.start[1]), abs(rover.start[2])) <= 1.2):
        raise FlightError(f"start: {rover.start} rad is not allowed; allowed: three angles, the largest at least 0.001 "
                          "rad, the second and third at most 1.2 rad")
    if not rover.start_tilt < 0.5 * math.pi:
        raise FlightError(f"start: the rover lies {rover.start_tilt:.3g} rad from upright; allowed: less than 1.57 rad")
