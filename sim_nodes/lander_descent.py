"""Reference descents: plant and law in one compiled loop, perfect navigation, in continuous time or at a fixed rate.

``law(law_p, r, q, alpha, w, g_model, work, gradient, force, torque) -> clipped axes`` is any kernel of that form,
e.g. `landing_law` or `pose_pd`; it comes from the caller, so the truth does not import flight software (and numba
cannot cache the loop: some seconds to compile). In continuous time (``hold_steps`` = 0) the law is evaluated in every
Runge-Kutta stage; otherwise every ``hold_steps`` steps, and held.
"""

import math
from typing import NamedTuple

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from sim_nodes.lander_dynamics import (
    STATES,
    advance,
    attitude_matrix,
    body_velocity,
    normalise_attitude,
    site_gravity,
    state_rate,
    touched_down,
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
    """What came of a descent; the state at its end is in the caller's array."""

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


@kernel
def _length(vector):
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@kernel
def watched(watch, state, matrix):
    """Clearance d [m] and view angle [rad] of a state; ``matrix`` (3, 3) receives R_DB."""
    attitude_matrix(state, matrix)
    x, y, z = state[0], state[1], state[2]
    rho_0 = watch.funnel_rho_0
    height = math.pow(
        watch.funnel_alpha * (x * x + watch.funnel_beta * y * y + rho_0 * rho_0), watch.funnel_gamma
    ) - math.pow(watch.funnel_alpha * rho_0 * rho_0, watch.funnel_gamma)
    along = matrix[0, 2] * x + matrix[1, 2] * y + matrix[2, 2] * z
    distance = math.sqrt(x * x + y * y + z * z)
    angle = 0.0
    if distance > 0.0:
        angle = math.acos(min(max(along / distance, -1.0), 1.0))
    return z + watch.funnel_z_0 - height, angle


@kernel
def command(law, law_p, field, p, state, gravity_scale, matrix, vectors, gradient):
    """Evaluate the law at a state, perfect navigation; force is vectors[0], torque vectors[1]; returns clipped axes.

    The model's gravity is the truth's times gravity_scale. ``vectors`` is (7, 3), its rows 4:7 are the law's work.
    """
    site_gravity(field, p, state, vectors[2])
    for i in range(3):
        vectors[2, i] *= gravity_scale
    body_velocity(state, matrix, vectors[3])
    return law(
        law_p,
        state[0:3],
        state[6:10],
        vectors[3],
        state[10:13],
        vectors[2],
        vectors[4:7],
        gradient,
        vectors[0],
        vectors[1],
    )


@kernel
def descend(
    law, law_p, field, p, watch, state, dt, steps, hold_steps, gravity_scale, every, history, work, vectors
):
    """Fly from ``state`` (14,), in place, until contact or for ``steps`` steps of dt [s]; returns a `Descent`.

    Row k of ``history`` (rows, 20) is the state at step k * every, then force and torque there; rows beyond are left.
    ``work`` is (4, 14), ``vectors`` (11, 3).
    """
    matrix, force, torque, gradient = vectors[7:10], vectors[0], vectors[1], work[3, 0:6]
    d_min, d_min_time, d_min_all, view_max = math.inf, 0.0, math.inf, 0.0
    d_bad, view_bad, delta_v, torque_impulse = 0, 0, 0.0, 0.0
    force_peak, torque_peak, speed_max, saturated, clipped = 0.0, 0.0, 0.0, 0, 0
    rows = history.shape[0]
    landed = False
    end = steps
    for step in range(steps + 1):
        d, angle = watched(watch, state, matrix)
        distance = _length(state[0:3])
        if distance > watch.clearance_range and d < d_min:
            d_min, d_min_time = d, step * dt
        d_min_all = min(d_min_all, d)
        if distance > watch.view_range:
            view_max = max(view_max, angle)
        speed_max = max(speed_max, _length(state[3:6]))
        if hold_steps == 0 or step % hold_steps == 0:
            clipped = command(law, law_p, field, p, state, gravity_scale, matrix, vectors, gradient)
        if step % every == 0 and step // every < rows:
            for i in range(STATES):
                history[step // every, i] = state[i]
            for i in range(3):
                history[step // every, 14 + i] = force[i]
                history[step // every, 17 + i] = torque[i]
        if touched_down(state, watch.contact_height, watch.contact_radius):
            landed = True
            end = step
            break
        if step == steps:
            break
        if d < 0.0:
            d_bad += 1
        if angle > watch.view_half_angle and distance > watch.view_range:
            view_bad += 1
        if clipped > 0:
            saturated += 1
        for i in range(3):
            force_peak = max(force_peak, abs(force[i]))
            torque_peak = max(torque_peak, abs(torque[i]))
        for i in range(STATES):
            work[2, i] = state[i]
            work[1, i] = 0.0
        for k in range(4):
            if hold_steps == 0 and k > 0:
                command(law, law_p, field, p, work[2], gravity_scale, matrix, vectors, gradient)
            share = dt / 6.0 if k == 0 or k == 3 else dt / 3.0
            delta_v += share / state[13] * _length(force)
            torque_impulse += share * _length(torque)
            state_rate(field, p, work[2], force, torque, 0.0, matrix, work[0])
            advance(state, work[0], k, dt, work[1], work[2])
        normalise_attitude(state)
    return Descent(
        landed,
        end * dt,
        d_min,
        d_min_time,
        d_min_all,
        view_max,
        d_bad * dt,
        view_bad * dt,
        delta_v,
        torque_impulse,
        force_peak,
        torque_peak,
        speed_max,
        saturated * dt,
    )


def fly(
    law,
    law_parameters,
    field,
    plant,
    state,
    *,
    watch=None,
    dt=0.1,
    duration=5000.0,
    control_period=0.0,
    gravity_scale=1.0,
    record_period=1.0,
) -> tuple[Descent, np.ndarray, np.ndarray]:
    """Fly one descent; returns the `Descent`, the state (14,) at its end and the history (rows, 20).

    dt, duration, control_period (0: continuous), record_period in s. A history row: state, force [N], torque [N m].
    """
    hold_steps = round(control_period / dt)
    every = max(1, round(record_period / dt))
    if not math.isclose(hold_steps * dt, control_period, rel_tol=1e-9, abs_tol=1e-12):
        raise FlightError(f"control_period {control_period} s must be a multiple of the step dt = {dt} s")
    steps = round(duration / dt)
    history = np.full((steps // every + 1, 20), math.nan)
    end = np.array(state, dtype=float)
    outcome = descend(
        law,
        law_parameters,
        field,
        plant,
        watch if watch is not None else Watch(),
        end,
        dt,
        steps,
        hold_steps,
        gravity_scale,
        every,
        history,
        np.zeros((4, STATES)),
        np.zeros((11, 3)),
    )
    return outcome, end, history[: int(round(outcome.time / dt)) // every + 1]
