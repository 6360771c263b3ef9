"""Regressor without accelerations: the equation of motion through a first-order low-pass filter.

tau = d/dt(Y_p pi) + Y_g pi + Y_a pi: Y_p pi are the momenta conjugate to base rotation and joints with the base's
velocity left out, Y_g pi their gyroscopic rate, Y_a pi the share of the base's acceleration a. Filtered by f/(s + f) on
both sides, tau_f = W pi needs angles, rates, torques and the base accelerometer, but no joint or angular acceleration.
The pair (W, tau_f) goes into `spacerobot_ros.recursive_least_squares.update` with first_row 0.

For body rates w, velocities v (base's v left out), momenta p and L of what a joint carries, about the joint's origin:
Y_p row = z . L, Y_g row = z . (w x L + v x p), Y_a row = z . (moment of a); for the base all three components.
The samples enter as means over the control period, during which the torque is held: momenta by their difference
(exact), gyroscopic rates by the trapezoid rule, acceleration by its value at the end, under the same torque.
"""

import math

from flight_graph.kernel import kernel
from spacerobot_ros.kinematics import body_motion
from spacerobot_ros.regressor import body_block, carry_to_parent

NOT_FINITE, STARTED, READY = range(3)  # what `filter_step` returns


@kernel
def momentum_regressor(
    parent, rotation, offset, axis, w, thd, a, y_momentum, y_rate, y_push, motion, still, block, zero
):  # fmt: skip
    """Y_p, Y_g and Y_a, each (3+n, 10(n+1)), at the actual motion. ``a`` (3,): base acceleration, base axes [m/s^2].

    Work: ``motion`` and ``still`` (n+1, 12), ``block`` (2, 6, 10), ``zero`` (3+n,) that holds zeros.
    With velocities in place of accelerations at zero velocity, the regressor's blocks are those of momentum.
    """
    n = parent.shape[0]
    body_motion(parent, rotation, offset, axis, zero, zero, w, zero, zero, zero, thd, motion)
    body_motion(parent, rotation, offset, axis, zero, zero, zero, a, zero, zero, zero, still)
    momentum = block[0]
    push = block[1]
    for b in range(n + 1):
        first = 10 * b
        for row in range(n):
            for c in range(10):
                y_momentum[3 + row, first + c] = 0.0
                y_rate[3 + row, first + c] = 0.0
                y_push[3 + row, first + c] = 0.0
        body_block(motion, b, momentum)
        body_block(still, b, push)
        body = b
        while body > 0:
            i = body - 1
            for c in range(10):
                value, rate, moment = 0.0, 0.0, 0.0
                for k in range(3):
                    value += axis[i, k] * momentum[3 + k, c]
                    rate += axis[i, k] * _gyroscopic(motion, body, momentum, k, c)
                    moment += axis[i, k] * push[3 + k, c]
                y_momentum[3 + i, first + c] = value
                y_rate[3 + i, first + c] = rate
                y_push[3 + i, first + c] = moment
            carry_to_parent(rotation, offset, i, momentum)
            carry_to_parent(rotation, offset, i, push)
            body = parent[i]
        for k in range(3):
            for c in range(10):
                y_momentum[k, first + c] = momentum[3 + k, c]
                y_rate[k, first + c] = _gyroscopic(motion, 0, momentum, k, c)
                y_push[k, first + c] = push[3 + k, c]


@kernel
def _gyroscopic(motion, body, momentum, k, c):
    """Component k of w x L + v x p, column c; motion rows hold w and v in the places of accelerations."""
    i, j = (k + 1) % 3, (k + 2) % 3
    spin = motion[body, 6 + i] * momentum[3 + j, c] - motion[body, 6 + j] * momentum[3 + i, c]
    return spin + motion[body, 9 + i] * momentum[j, c] - motion[body, 9 + j] * momentum[i, c]


@kernel
def filter_step(y_momentum, y_rate, y_push, torque, bandwidth, period, state, memory, torque_filtered, w):
    """Pass one sample through the filter; ``w`` (3+n, p) and ``torque_filtered`` (3+n,) are the least-squares pair.

    ``torque`` (3+n,) [N m] was held during the period that ends here; ``bandwidth`` f [rad/s]; ``period`` [s];
    ``memory`` (2, 3+n, p) previous sample; ``state``: what the previous call returned, 0 at first. Returns READY when
    the pair may be used, STARTED at the first sample, NOT_FINITE when the sample was refused (starts afresh after it).
    """
    rows, p = y_momentum.shape
    total = 0.0
    for r in range(rows):
        total += abs(torque[r])
        for j in range(p):
            total += abs(y_momentum[r, j]) + abs(y_rate[r, j]) + abs(y_push[r, j])
    if not math.isfinite(total):
        return NOT_FINITE
    decay = math.exp(-bandwidth * period)
    share = 1.0 - decay
    for r in range(rows):
        torque_filtered[r] = 0.0 if state == NOT_FINITE else decay * torque_filtered[r] + share * torque[r]
        for j in range(p):
            if state == NOT_FINITE:
                w[r, j] = 0.0
            else:
                slope = (y_momentum[r, j] - memory[0, r, j]) / period
                rate = 0.5 * (y_rate[r, j] + memory[1, r, j])
                w[r, j] = decay * w[r, j] + share * (slope + rate + y_push[r, j])
            memory[0, r, j] = y_momentum[r, j]
            memory[1, r, j] = y_rate[r, j]
    return STARTED if state == NOT_FINITE else READY
