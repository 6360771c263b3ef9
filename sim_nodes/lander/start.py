"""Where a landing starts: pose and velocity relative to the site, from what a person would say, and random draws of it.

The starts of the Monte Carlo are ours; the order of the draws is part of their definition.
"""

import math

import numpy as np

from flight_graph.components.records import Choice, Parameters, field
from flight_graph.errors import FlightError
from flight_math import Quaternion, Vec3, kernel, normalised, quaternion, sincos
from lander_ros.constraints import funnel_height
from sim_nodes.lander.dynamics import Motion

POSITION, RANGE = 0, 1
VIEW, ORIENTATION = 0, 1


class LanderStart(Parameters):
    """Start and keep-out funnel. The defaults are the reference start (ours)."""

    funnel_alpha: float = field(27.0, unit="m^(1/gamma - 2)", gt=0, doc="alpha of the keep-out funnel")
    funnel_beta: float = field(1.2, unit="1", gt=0, doc="beta of the keep-out funnel")
    funnel_gamma: float = field(1.0 / 3.0, unit="1", gt=0, doc="gamma of the keep-out funnel")
    funnel_rho_0: float = field(10.0, unit="m", ge=0, doc="rounding of the funnel's tip")
    funnel_z_0: float = field(1.5, unit="m", ge=0, doc="depth of the funnel's tip below the goal")
    start_at: Choice("position", "range") = field("position", doc="place by start_position, or by range and clearance")
    start_position: Vec3 = field((-900.0, 450.0, 340.0), unit="m", doc="r^D")
    start_range: float = field(1000.0, unit="m", ge=0, doc="horizontal distance from the goal")
    start_azimuth: float = field(0.0, unit="rad", doc="from x_D (east) towards y_D")
    start_clearance: float = field(50.0, unit="m", doc="d over the keep-out funnel")
    start_velocity: Vec3 = field((0.3, -0.2, 0.1), unit="m/s", doc="d(r^D)/dt in D")
    start_facing: Choice("view", "orientation") = field(
        "view", doc="attitude by yaw and view error, or by start_orientation")
    start_yaw: float = field(math.radians(25.0), unit="rad", doc="about z_B, after the least turn of z_D towards r")
    start_view_error: float = field(math.radians(18.0), unit="rad", doc="angle between -z_B and the goal")
    start_view_direction: float = field(math.radians(30.0), unit="rad", doc="direction of the tilt's axis in x_B, y_B")
    start_orientation: Quaternion = field((0.0, 0.0, 0.0, 1.0), unit="1", doc="quaternion x, y, z, w, B to D")
    start_rates: Vec3 = field(tuple(math.radians(rate) for rate in (0.2, -0.1, 0.15)), unit="rad/s", doc="w_BD, in B")
    draw_seed: int = field(-1, ge=-1, doc="seed of a random start that replaces all start_ values; -1: none")


@kernel
def motion_at_start(p):
    """The motion that the parameters of `LanderStart` and the mass say."""
    position = p.start_position
    if p.start_at == RANGE:
        sine, cosine = sincos(p.start_azimuth)
        x, y = p.start_range * cosine, p.start_range * sine
        position = Vec3(x, y, p.start_clearance - p.funnel_z_0 + funnel_height(p, x, y))
    attitude = p.start_orientation
    if p.start_facing == VIEW:
        attitude = approach_attitude(position, p.start_yaw, p.start_view_error, p.start_view_direction)
    return Motion(position, p.start_velocity, attitude, p.start_rates, p.mass)


@kernel
def approach_attitude(position, yaw, view_error, view_direction):
    """Attitude with z_B towards r^D by the least rotation, then yaw about z_B, then a tilt, all [rad].

    The tilt of view_error is about the axis (cos, sin, 0) of view_direction in B: the angle between -z_B and the site.
    """
    up = normalised(position)
    least = normalised(Quaternion(-up.y, up.x, 0.0, 1.0 + up.z))
    sin_yaw, cos_yaw = sincos(0.5 * yaw)
    sin_tilt, cos_tilt = sincos(0.5 * view_error)
    sin_axis, cos_axis = sincos(view_direction)
    turn = Quaternion(0.0, 0.0, sin_yaw, cos_yaw)
    return least * turn * quaternion(sin_tilt * Vec3(cos_axis, sin_axis, 0.0), cos_tilt)


def require_approach(position) -> None:
    """Refuse a position r^D that `approach_attitude` has no least rotation for: the goal, and straight below it."""
    if position[0] == position[1] == 0.0 and position[2] <= 0.0:
        raise FlightError(f"no least rotation takes z_D to the position {tuple(map(float, position))} m; "
                          "allowed is any that is not the goal or straight below it")


def drawn(seed: int) -> dict:
    """The start_ values of the random start number ``seed``, from numpy's default generator.

    In this order: range U(200, 1200) m, azimuth U(0, 360) deg, clearance U(40, 400) m, view error U(0, 25) deg and its
    direction U(0, 360) deg, yaw U(-180, 180) deg, direction and size U(0, 0.5) m/s of the velocity, direction and size
    U(0, 0.3) deg/s of the rates.
    """
    random = np.random.default_rng(seed)
    values = {
        "start_at": "range",
        "start_facing": "view",
        "start_range": random.uniform(200.0, 1200.0),  # [m]
        "start_azimuth": math.radians(random.uniform(0.0, 360.0)),  # [deg]
        "start_clearance": random.uniform(40.0, 400.0),  # [m]
        "start_view_error": math.radians(random.uniform(0.0, 25.0)),  # [deg]
        "start_view_direction": math.radians(random.uniform(0.0, 360.0)),  # [deg]
        "start_yaw": math.radians(random.uniform(-180.0, 180.0)),  # [deg]
    }
    for name, largest in (("start_velocity", 0.5), ("start_rates", math.radians(0.3))):  # [m/s], [rad/s]
        direction = random.normal(size=3)
        size = random.uniform(0.0, largest)
        values[name] = [float(part) for part in direction / math.sqrt(float(sum(direction * direction))) * size]
    return values
