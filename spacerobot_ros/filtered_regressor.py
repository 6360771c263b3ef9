"""Regressor without accelerations: the equation of motion through a first-order low-pass filter.

tau = d/dt(Y_p pi) + Y_g pi + Y_a pi: Y_p pi are the momenta conjugate to base rotation and joints with the base's
velocity left out, Y_g pi their gyroscopic rate, Y_a pi the share of the base's acceleration a. Filtered by f/(s + f) on
both sides, tau_f = W pi needs angles, rates, torques and the base accelerometer, but no joint or angular acceleration.
The pair (W, tau_f) goes into `spacerobot_ros.recursive_least_squares.update`.

For body rates w, velocities v (base's v left out), momenta p and L of what a joint carries, about the joint's origin:
Y_p row = z . L, Y_g row = z . (w x L + v x p), Y_a row = z . (moment of a); for the base all three components.
The samples enter as means over the control period, during which the torque is held: momenta by their difference
(exact), gyroscopic rates by the trapezoid rule, acceleration by its value at the end, under the same torque.
"""

import math
from typing import NamedTuple

import numpy as np

from flight_math import cross, exp, kernel, mat3, skew, stack_array, transpose, vec3
from spacerobot_ros.regressor import (
    ZERO,
    Columns,
    acceleration_columns,
    clear,
    columns_to_parent,
    moment_along,
    put,
    put_moments,
)

NOT_FINITE, STARTED, READY = range(3)  # what `filter_step` returns


class Rows(NamedTuple):
    """Y_p, Y_g and Y_a, (3+n, 10(n+1)) each."""

    momentum: np.ndarray
    rate: np.ndarray
    push: np.ndarray


class Filter(NamedTuple):
    """What `filter_step` keeps, entries of an estimator's state too: Y_p and Y_g of the sample before, (2, 3+n, 10(n+1));
    the pair of least squares: torque (3+n,) [N m] and regressor W (3+n, 10(n+1))."""

    memory: np.ndarray
    filtered_torque: np.ndarray
    filtered: np.ndarray


@kernel
def body_velocities(tree, w, thd, velocities, turning):
    """Outward: w+ = R^T w + z thd, v+ = R^T (v + w x P); the base's own velocity is left out. Fills (n+1, 3) each."""
    turning[0], velocities[0] = w, ZERO
    for i in range(len(tree.parent)):
        b = tree.parent[i]
        w, v, inward = vec3(turning[b]), vec3(velocities[b]), transpose(mat3(tree.rotation[i]))
        turning[i + 1] = inward @ w + thd[i] * vec3(tree.axis[i])
        velocities[i + 1] = inward @ (v + cross(w, vec3(tree.offset[i])))


@kernel
def gyroscopic(w, v, momenta):
    """w x L + v x p, columns; the momenta of a body are the wrench with velocities in place of accelerations."""
    w_cross, v_cross = skew(w), skew(v)
    return Columns(w_cross @ momenta.diagonal, w_cross @ momenta.products,
                   w_cross @ momenta.first + v_cross @ momenta.first_force,
                   cross(w, momenta.mass) + cross(v, momenta.mass_force), momenta.first_force, momenta.mass_force)


@kernel
def momentum_regressor(tree, w, thd, a, rows):
    """Fill ``rows`` at the actual motion. ``a``: base acceleration, base axes [m/s^2]."""
    n = len(tree.parent)
    turning, velocities, pushes = stack_array(n + 1, 3), stack_array(n + 1, 3), stack_array(n + 1, 3)
    body_velocities(tree, w, thd, velocities, turning)
    pushes[0] = a
    for i in range(n):
        pushes[i + 1] = transpose(mat3(tree.rotation[i])) @ vec3(pushes[tree.parent[i]])
    clear(rows.momentum)
    clear(rows.rate)
    clear(rows.push)
    for b in range(n + 1):
        momenta = acceleration_columns(vec3(turning[b]), vec3(velocities[b]))
        push = acceleration_columns(ZERO, vec3(pushes[b]))
        body = b
        while body > 0:
            i, axis = body - 1, vec3(tree.axis[body - 1])
            put(moment_along(momenta, axis), rows.momentum, 3 + i, b)
            put(moment_along(gyroscopic(vec3(turning[body]), vec3(velocities[body]), momenta), axis), rows.rate, 3 + i, b)
            put(moment_along(push, axis), rows.push, 3 + i, b)
            momenta, push = columns_to_parent(tree, i, momenta), columns_to_parent(tree, i, push)
            body = tree.parent[i]
        rate = gyroscopic(w, ZERO, momenta)
        put_moments(momenta, rows.momentum, 0, b)
        put_moments(rate, rows.rate, 0, b)
        put_moments(push, rows.push, 0, b)


@kernel
def all_finite(rows, torque):
    """Whether a sample may be used."""
    total = 0.0
    for r in range(len(torque)):
        total += abs(torque[r])
        for j in range(rows.momentum.shape[1]):
            total += abs(rows.momentum[r, j]) + abs(rows.rate[r, j]) + abs(rows.push[r, j])
    return math.isfinite(total)


@kernel
def filter_step(p, x, phase, rows, torque):
    """Pass one sample through the filter of ``x``, whose pair then goes to least squares.

    p.bandwidth f [rad/s], p.period [s]; ``torque`` (3+n,) [N m] was held during the period that ends here; ``phase``:
    what the previous call returned, 0 at first. Returns READY when the pair may be used, STARTED at the first sample,
    NOT_FINITE when the sample was refused (starts afresh after it).
    """
    if not all_finite(rows, torque):
        return NOT_FINITE
    decay = exp(-p.bandwidth * p.period)
    share = 1.0 - decay
    for r in range(len(torque)):
        x.filtered_torque[r] = 0.0 if phase == NOT_FINITE else decay * x.filtered_torque[r] + share * torque[r]
        for j in range(rows.momentum.shape[1]):
            slope = (rows.momentum[r, j] - x.memory[0, r, j]) / p.period
            rate = 0.5 * (rows.rate[r, j] + x.memory[1, r, j])
            mean = slope + rate + rows.push[r, j]
            x.filtered[r, j] = 0.0 if phase == NOT_FINITE else decay * x.filtered[r, j] + share * mean
            x.memory[0, r, j] = rows.momentum[r, j]
            x.memory[1, r, j] = rows.rate[r, j]
    return STARTED if phase == NOT_FINITE else READY
