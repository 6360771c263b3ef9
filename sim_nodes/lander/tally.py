"""The tally of a landing: what it has cost so far, and how near it came to its constraints.

``x``: the plant's state, ``p`` its parameters.
"""

import math

from flight_math import atan2, kernel, largest, norm, vector_part
from sim_nodes.lander.descent import watched


@kernel
def tally_step(p, x, dt):
    """What a step of dt [s] from the state costs, under the delivered wrench."""
    if x.clearance < 0.0:
        x.clearance_violation += dt
    if x.view_angle > p.view_half_angle and norm(x.position) > p.view_range:
        x.view_violation += dt
    x.delta_v += dt / x.mass * norm(x.force)
    x.torque_impulse += dt * norm(x.torque)
    force, torque = largest(abs(x.force)), largest(abs(x.torque))
    x.force_peak, x.torque_peak = max(x.force_peak, force), max(x.torque_peak, torque)
    if force >= p.force_limit or torque >= p.torque_limit:
        x.saturated += dt


@kernel
def tally_place(p, x):
    """Clearance and view angle of the state, and their extremes."""
    x.clearance, x.view_angle = watched(p, x.position, x.attitude)
    distance = norm(x.position)
    if distance > p.clearance_range and x.clearance < x.clearance_min:
        x.clearance_min, x.clearance_min_time = x.clearance, x.flown
    x.clearance_min_all = min(x.clearance_min_all, x.clearance)
    if distance > p.view_range:
        x.view_max = max(x.view_max, x.view_angle)
    x.speed_max = max(x.speed_max, norm(x.velocity))


@kernel
def summarise(p, x, summary):
    """The tally so far."""
    summary.landed = 1.0 if x.landed else 0.0
    summary.time = x.flown
    summary.lateral = math.sqrt(x.position.x * x.position.x + x.position.y * x.position.y)
    summary.speed = norm(x.velocity)
    summary.attitude_error = 2.0 * atan2(norm(vector_part(x.attitude)), abs(x.attitude.w))
    summary.rate = norm(x.rates)
    summary.clearance_min = x.clearance_min
    summary.clearance_min_time = x.clearance_min_time
    summary.clearance_min_all = x.clearance_min_all
    summary.view_max = x.view_max
    summary.clearance_violation = x.clearance_violation
    summary.view_violation = x.view_violation
    summary.delta_v = x.delta_v
    summary.torque_impulse = x.torque_impulse
    summary.force_peak = x.force_peak
    summary.torque_peak = x.torque_peak
    summary.speed_max = x.speed_max
    summary.saturated = x.saturated
    summary.propellant = p.mass - x.mass
