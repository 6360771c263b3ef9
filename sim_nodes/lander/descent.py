"""Reference descents: plant and law in one compiled loop, perfect navigation, in continuous time or at a fixed rate.

``law(law_p, r, q, motor, gravity) -> (wrench, clipped axes)`` is any kernel of that form, e.g. `landing_law` or
`pose_pd`; it comes from the caller, so the truth does not import a law (and numba cannot cache the loop: some seconds to
compile). In continuous time (``hold_steps`` = 0) the law is evaluated in every Runge-Kutta stage; otherwise every
``hold_steps`` steps, and held.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from flight_graph.errors import FlightError
from flight_math import DualVector, Vec3, kernel, largest, maximum, norm, rk4
from lander_ros.constraints import clearance, view_angle, view_cosine
from sim_nodes.lander.dynamics import (
    Motion,
    Truth,
    hold_step,
    motor,
    rate_under,
    site_gravity,
    touched_down,
    unit_attitude,
)


class Watch(NamedTuple):
    """What a descent is watched for: the keep-out funnel, the view cone's range, the contact trigger."""

    funnel_alpha: float = 27.0  # [m^(1/gamma - 2)]
    funnel_beta: float = 1.2  # [-]
    funnel_gamma: float = 1.0 / 3.0  # [-]
    funnel_rho_0: float = 10.0  # [m]
    funnel_z_0: float = 1.5  # [m]
    view_half_angle: float = math.radians(30.0)  # [rad]
    clearance_range: float = 20.0  # [m], the smallest clearance is taken beyond
    view_range: float = 5.0  # [m], the largest view angle is taken beyond
    contact_height: float = 0.1  # z_td [m]
    contact_radius: float = 20.0  # [m]


class Descent(NamedTuple):
    """What came of a descent."""

    landed: bool
    time: float  # [s]
    clearance_min: float  # [m], beyond Watch.clearance_range
    clearance_min_time: float  # [s]
    clearance_min_all: float  # [m], everywhere
    view_max: float  # [rad], beyond Watch.view_range
    clearance_violation: float  # [s] with d < 0
    view_violation: float  # [s] beyond the view cone, beyond Watch.view_range
    delta_v: float  # [m/s], integral of |f|/m
    torque_impulse: float  # [N m s], integral of |tau|
    force_peak: float  # [N], largest component
    torque_peak: float  # [N m], largest component
    speed_max: float  # [m/s]
    saturated: float  # [s] with at least one axis clipped


class Plan(NamedTuple):
    """How a descent is flown: steps of dt [s], the law's hold, the model's gravity over the true one, rows to record."""

    dt: float
    steps: int
    hold_steps: int
    gravity_scale: float
    every: int


@kernel
def watched(p, position, attitude):
    """Clearance d [m] and view angle [rad] of a pose. p: the funnel's parameters."""
    return clearance(p, position), view_angle(view_cosine(position, attitude))


@kernel
def command(law, law_p, truth, motion, gravity_scale):
    """Wrench and clipped axes of the law at a motion, perfect navigation, and the true gravity g^D [m/s^2] there."""
    gravity = site_gravity(truth, truth, motion.position)
    wrench, clipped = law(law_p, motion.position, motion.attitude, motor(motion), gravity_scale * gravity)
    return wrench, clipped, gravity


@kernel
def write_row(row, motion, wrench):
    """A row of the history."""
    row[0:3], row[3:6], row[6:10] = motion.position, motion.velocity, motion.attitude
    row[10:13], row[13] = motion.rates, motion.mass
    row[14:17], row[17:20] = wrench.real, wrench.dual


@cache
def descent(law):
    """The kernel that flies a law."""

    @kernel
    def flight_rate(given, t, state):
        """Rates of the motion, of the velocity increment and of the torque impulse, with the law in the loop."""
        law_p, truth, gravity_scale = given
        motion, _, _ = state
        wrench, _, gravity = command(law, law_p, truth, motion, gravity_scale)
        rate = rate_under(truth, truth, motion, gravity, wrench, 0.0)
        return rate, norm(wrench.real) / motion.mass, norm(wrench.dual)

    @kernel
    def descend(law_p, truth, watch, plan, motion, history):
        """Fly from a motion until contact or for plan.steps; returns a `Descent` and the motion at its end.

        Row k of ``history`` (rows, 20) is the motion at step k * every (r, v, q, w, mass), then force and torque there;
        rows beyond are left.
        """
        d_min, d_min_time, d_min_all, view_max = math.inf, 0.0, math.inf, 0.0
        d_bad, view_bad, delta_v, torque_impulse = 0, 0, 0.0, 0.0
        peak_force, peak_torque, speed_max, saturated, clipped = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 0.0, 0, 0
        wrench = DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
        landed, end = False, plan.steps
        for step in range(plan.steps + 1):
            d, angle = watched(watch, motion.position, motion.attitude)
            distance = norm(motion.position)
            if distance > watch.clearance_range and d < d_min:
                d_min, d_min_time = d, step * plan.dt
            d_min_all = min(d_min_all, d)
            if distance > watch.view_range:
                view_max = max(view_max, angle)
            speed_max = max(speed_max, norm(motion.velocity))
            if plan.hold_steps == 0 or step % plan.hold_steps == 0:
                wrench, clipped, _ = command(law, law_p, truth, motion, plan.gravity_scale)
            if step % plan.every == 0 and step // plan.every < history.shape[0]:
                write_row(history[step // plan.every], motion, wrench)
            if touched_down(watch, motion.position):
                landed, end = True, step
                break
            if step == plan.steps:
                break
            d_bad += d < 0.0
            view_bad += angle > watch.view_half_angle and distance > watch.view_range
            saturated += clipped > 0
            peak_force, peak_torque = maximum(peak_force, abs(wrench.real)), maximum(peak_torque, abs(wrench.dual))
            if plan.hold_steps == 0:
                given, flight = (law_p, truth, plan.gravity_scale), (motion, delta_v, torque_impulse)
                motion, delta_v, torque_impulse = rk4(flight_rate, given, 0.0, flight, plan.dt)
                motion = unit_attitude(motion)
            else:
                delta_v += plan.dt / motion.mass * norm(wrench.real)
                torque_impulse += plan.dt * norm(wrench.dual)
                gravity = site_gravity(truth, truth, motion.position)
                motion = hold_step(truth, truth, motion, gravity, wrench, 0.0, plan.dt)
        return Descent(landed, end * plan.dt, d_min, d_min_time, d_min_all, view_max, d_bad * plan.dt, view_bad * plan.dt,
                       delta_v, torque_impulse, largest(peak_force), largest(peak_torque), speed_max,
                       saturated * plan.dt), motion

    return descend


def planned(dt=0.1, duration=5000.0, control_period=0.0, gravity_scale=1.0, record_period=1.0) -> Plan:
    """The plan of a descent; dt, duration, control_period (0: continuous), record_period in s. Raises FlightError."""
    hold_steps = round(control_period / dt)
    if not math.isclose(hold_steps * dt, control_period, rel_tol=1e-9, abs_tol=1e-12):
        raise FlightError(f"control_period {control_period} s must be a multiple of the step dt = {dt} s")
    return Plan(dt, round(duration / dt), hold_steps, float(gravity_scale), max(1, round(record_period / dt)))


def fly(law, law_parameters, truth: Truth, motion: Motion, plan: Plan, watch: Watch) -> tuple:
    """Fly one descent; returns the `Descent`, the `Motion` at its end and the history, an array (rows, 20).

    A history row: r, v, q, w, mass, force, torque.
    """
    history = np.full((plan.steps // plan.every + 1, 20), math.nan)
    outcome, end = descent(law)(law_parameters, truth, watch, plan, motion, history)
    return outcome, end, history[: int(round(outcome.time / plan.dt)) // plan.every + 1]
