"""What a person is told before a landing starts: vehicle, gains and start, each with the numbers that decide.

Ours: the rules behind the invariance of the constraints, which is proved for an unsaturated law only.
"""

import math

import numpy as np

from flight_graph.errors import FlightError
from flight_math import Quaternion, Vec3
from lander_ros.constraints import clearance, view_angle, view_cosine


def require_vehicle(p, where: str = "lander") -> None:
    """Refuse a mass that is not positive, or an inertia that is not that of a rigid body."""
    if not p.mass > 0.0:
        raise FlightError(f"{where}.mass: {p.mass} kg is not allowed; it must be > 0 kg")
    inertia = np.reshape(np.asarray(p.inertia, dtype=float), (3, 3))
    if not np.allclose(inertia, inertia.T, rtol=1e-9, atol=0.0):
        raise FlightError(f"{where}.inertia: {inertia.tolist()} kg m^2 is not symmetric")
    moments = np.linalg.eigvalsh(inertia)
    if not moments[0] > 0.0:
        raise FlightError(
            f"{where}.inertia: the principal moments {np.round(moments, 6).tolist()} kg m^2 must all be > 0"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        raise FlightError(
            f"{where}.inertia: the largest principal moment {moments[2]:.6g} kg m^2 exceeds the sum of the others, "
            f"{moments[0] + moments[1]:.6g}: no rigid body has that"
        )


def start_margins(p, r, q) -> tuple[float, float]:
    """Clearance d [m] and view margin [rad] (half angle less the angle between -z_B and the site) at a pose r^D, q."""
    r, q = Vec3(*r), Quaternion(*q)
    return float(clearance(p, r)), float(p.view_half_angle - view_angle(view_cosine(r, q)))


def require_start(p, r, q, where: str = "lander.start") -> None:
    """Refuse a start inside the keep-out funnel or, beyond r_off, without the site in view; says the margins."""
    d, margin = start_margins(p, r, q)
    distance = math.hypot(*r)
    faults = []
    if not d > 0.0:
        faults.append("is inside the keep-out funnel")
    if distance > p.view_cutoff_radius and not margin > 0.0:
        faults.append("does not have the site in view")
    if faults:
        raise FlightError(
            f"{where}: the start {' and '.join(faults)}: clearance {d:.3f} m (must be > 0), view angle "
            f"{math.degrees(p.view_half_angle - margin):.2f} deg of at most {math.degrees(p.view_half_angle):.2f} deg"
        )


def gain_warnings(p, gravity_norm: float, control_period: float = 0.0, speed: float = 0.0) -> list[str]:
    """Sentences about gains for which saturation, and with it a broken constraint, must be expected; empty if none.

    gravity_norm [m/s^2] at the site, control_period [s] (0: continuous), speed [m/s] of the start.
    """
    warnings = []
    pull = p.pull_gain * p.pull_radius
    needed = pull + p.mass * gravity_norm
    if needed >= p.force_limit:
        warnings.append(
            f"pull_gain * pull_radius + weight = {pull:.2f} + {p.mass * gravity_norm:.2f} N is not below "
            f"force_limit = {p.force_limit:.2f} N: the pull alone saturates the thrusters"
        )
    cruise = pull / p.linear_damping
    energy = 0.5 * p.mass * max(cruise, speed) * max(cruise, speed)
    absorbed = math.sqrt(p.terrain_gain * p.force_limit)
    if 0.0 < p.terrain_gain and absorbed <= energy:
        warnings.append(
            f"the terrain barrier absorbs {absorbed:.1f} J before it saturates (at d = "
            f"{math.sqrt(p.terrain_gain / p.force_limit):.2f} m), less than the {energy:.1f} J at "
            f"{max(cruise, speed):.2f} m/s: raise terrain_gain or lower the speed"
        )
    for axis, moment in zip("xyz", np.diag(np.reshape(np.asarray(p.inertia), (3, 3))), strict=True):
        limit = 2.0 * moment / p.angular_damping
        if control_period >= limit:
            warnings.append(
                f"control_period {control_period:.3f} s is not below 2 J/D_w = {limit:.3f} s of axis {axis}: "
                f"the sampled rotation is unstable"
            )
    if control_period >= 2.0 * p.mass / p.linear_damping:
        warnings.append(
            f"control_period {control_period:.3f} s is not below 2 m/D_v = {2.0 * p.mass / p.linear_damping:.3f} s: "
            f"the sampled translation is unstable"
        )
    return warnings
