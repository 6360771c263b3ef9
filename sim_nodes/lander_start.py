"""Where a landing starts: pose and velocity relative to the site, from what a person would say, and random draws of it.

The starts of the Monte Carlo are ours; the order of the draws is part of their definition.
"""

import math

import numpy as np

from flight_graph.components.records import Array, Choice, Parameters, Vec3, field
from flight_graph.kernel import kernel
from lander_ros.constraints import funnel_height
from lander_ros.rotation import multiply

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
    start_orientation: Array(4) = field((0.0, 0.0, 0.0, 1.0), unit="1", doc="quaternion x, y, z, w, B to D")
    start_rates: Vec3 = field(tuple(math.radians(rate) for rate in (0.2, -0.1, 0.15)), unit="rad/s", doc="w_BD, in B")
    draw_seed: int = field(-1, ge=-1, doc="seed of a random start that replaces all start_ values; -1: none")


@kernel
def place(p, motion, work):
    """Position, velocity, attitude, rates of the start, into the state ``motion`` (13 or more); ``work`` is (4, 4)."""
    for i in range(3):
        motion[i] = p.start_position[i]
        motion[3 + i] = p.start_velocity[i]
        motion[10 + i] = p.start_rates[i]
    if p.start_at == RANGE:
        motion[0] = p.start_range * math.cos(p.start_azimuth)
        motion[1] = p.start_range * math.sin(p.start_azimuth)
        motion[2] = p.start_clearance - p.funnel_z_0 + funnel_height(
            motion[0], motion[1], p.funnel_alpha, p.funnel_beta, p.funnel_gamma, p.funnel_rho_0)
    if p.start_facing == ORIENTATION:
        for i in range(4):
            motion[6 + i] = p.start_orientation[i]
        return
    distance = math.sqrt(motion[0] * motion[0] + motion[1] * motion[1] + motion[2] * motion[2])
    work[0, 0] = -motion[1] / distance
    work[0, 1] = motion[0] / distance
    work[0, 2] = 0.0
    work[0, 3] = 1.0 + motion[2] / distance
    norm = math.sqrt(work[0, 0] * work[0, 0] + work[0, 1] * work[0, 1] + work[0, 3] * work[0, 3])
    for i in range(4):
        work[0, i] /= norm
        work[1, i] = 0.0
    work[1, 2] = math.sin(0.5 * p.start_yaw)
    work[1, 3] = math.cos(0.5 * p.start_yaw)
    multiply(work[0], work[1], work[2])
    half = math.sin(0.5 * p.start_view_error)
    work[1, 0] = half * math.cos(p.start_view_direction)
    work[1, 1] = half * math.sin(p.start_view_direction)
    work[1, 2] = 0.0
    work[1, 3] = math.cos(0.5 * p.start_view_error)
    multiply(work[2], work[1], work[3])
    for i in range(4):
        motion[6 + i] = work[3, i]


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
