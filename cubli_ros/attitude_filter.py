"""Attitude estimation of the Cubli rover: a multiplicative extended Kalman filter for gyro and star tracker.

Source: Lefferts, Markley, Shuster, "Kalman filtering for spacecraft attitude estimation", J. Guidance 5(5), 1982;
update in Joseph's form. Reference: quaternion q (x, y, z, w, body to balance frame, see `cubli_ros.attitude`) and gyro
bias b [rad/s]. Error state (6,): body-frame rotation vector dtheta with q_true = q dq(dtheta), and db = b_true - b:

    dtheta' = -omega x dtheta - db - n_gyro,   db' = n_walk,   omega = gyro - b.

Noise levels are per sample: gyro white noise [rad/s], bias random walk [rad/s] added each sample, star tracker [rad]
per axis. covariance is (6, 6), rows and columns (dtheta [rad], db [rad/s]). The injected rotation's effect on the
covariance (second order in dtheta) is neglected.
"""

import math

from cubli_ros.attitude import (
    invert_3x3,
    quaternion_difference,
    quaternion_from_rotation_vector,
    quaternion_multiply,
    quaternion_normalise,
    rotation_vector_from_quaternion,
)
from flight_graph.kernel import kernel


@kernel
def start(attitude, attitude_sigma, bias_sigma, q, bias, covariance):
    """Start the filter at a first attitude (4,) with per-axis standard deviations [rad], [rad/s] and zero bias."""
    for i in range(4):
        q[i] = attitude[i]
    for i in range(6):
        for j in range(6):
            covariance[i, j] = 0.0
    for i in range(3):
        bias[i] = 0.0
        covariance[i, i] = attitude_sigma * attitude_sigma
        covariance[3 + i, 3 + i] = bias_sigma * bias_sigma


@kernel
def transition(x, y, z, period, out):
    """Error-state transition over one period [s] at the constant rate (x, y, z) [rad/s] -> out (6, 6).

    Upper left exp(-[a x]), upper right -h times its mean over the period, a = omega h.
    """
    a_x = x * period
    a_y = y * period
    a_z = z * period
    square = a_x * a_x + a_y * a_y + a_z * a_z
    if square < 1e-3:  # [rad^2] series: the next terms are below 1e-12
        s_1 = 1.0 - square / 6.0 * (1.0 - square / 20.0)
        s_2 = 0.5 - square / 24.0 * (1.0 - square / 30.0)
        s_3 = 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0)
    else:
        angle = math.sqrt(square)
        s_1 = math.sin(angle) / angle
        s_2 = (1.0 - math.cos(angle)) / square
        s_3 = (1.0 - s_1) / square
    for i in range(6):
        for j in range(6):
            out[i, j] = 0.0
        out[i, i] = 1.0
    # [a x]^2 = a a^T - |a|^2 1
    out[0, 0] = 1.0 + s_2 * (a_x * a_x - square)
    out[1, 1] = 1.0 + s_2 * (a_y * a_y - square)
    out[2, 2] = 1.0 + s_2 * (a_z * a_z - square)
    out[0, 1] = s_1 * a_z + s_2 * a_x * a_y
    out[1, 0] = -s_1 * a_z + s_2 * a_x * a_y
    out[0, 2] = -s_1 * a_y + s_2 * a_x * a_z
    out[2, 0] = s_1 * a_y + s_2 * a_x * a_z
    out[1, 2] = s_1 * a_x + s_2 * a_y * a_z
    out[2, 1] = -s_1 * a_x + s_2 * a_y * a_z
    out[0, 3] = -period * (1.0 + s_3 * (a_x * a_x - square))
    out[1, 4] = -period * (1.0 + s_3 * (a_y * a_y - square))
    out[2, 5] = -period * (1.0 + s_3 * (a_z * a_z - square))
    out[0, 4] = -period * (s_2 * a_z + s_3 * a_x * a_y)
    out[1, 3] = -period * (-s_2 * a_z + s_3 * a_x * a_y)
    out[0, 5] = -period * (-s_2 * a_y + s_3 * a_x * a_z)
    out[2, 3] = -period * (s_2 * a_y + s_3 * a_x * a_z)
    out[1, 5] = -period * (s_2 * a_x + s_3 * a_y * a_z)
    out[2, 4] = -period * (-s_2 * a_x + s_3 * a_y * a_z)


@kernel
def congruence(matrix, covariance, work):
    """covariance <- matrix covariance matrix^T in place, made exactly symmetric; all (6, 6)."""
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += matrix[i, k] * covariance[k, j]
            work[i, j] = total
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            mirrored = 0.0
            for k in range(6):
                total += work[i, k] * matrix[j, k]
                mirrored += work[j, k] * matrix[i, k]
            covariance[i, j] = 0.5 * (total + mirrored)
    for i in range(6):
        for j in range(i):
            covariance[j, i] = covariance[i, j]


@kernel
def predict(q, bias, covariance, gyro_previous, gyro, period, gyro_sigma, walk_sigma, work):
    """Carry q (4,), covariance (6, 6) from the previous gyro sample to this one, in place; work (2, 6, 6).

    The rate of the interval is the mean of its two end samples (3,) [rad/s] minus the bias: exact to second order in
    the period where a sample held over the period would lag by half of it.
    """
    x = 0.5 * (gyro_previous[0] + gyro[0]) - bias[0]
    y = 0.5 * (gyro_previous[1] + gyro[1]) - bias[1]
    z = 0.5 * (gyro_previous[2] + gyro[2]) - bias[2]
    turn = work[0, 0]
    turned = work[0, 1]
    quaternion_from_rotation_vector(x * period, y * period, z * period, turn)
    quaternion_multiply(q, turn, turned)
    for i in range(4):
        q[i] = turned[i]
    quaternion_normalise(q)
    transition(x, y, z, period, work[0])
    congruence(work[0], covariance, work[1])
    angle_variance = gyro_sigma * period * gyro_sigma * period
    for i in range(3):
        covariance[i, i] += angle_variance
        covariance[3 + i, 3 + i] += walk_sigma * walk_sigma


@kernel
def update(q, bias, covariance, measured, sigma, gate, innovation, work):
    """Correct q (4,), bias (3,), covariance (6, 6) in place with a measured attitude (4,); work (3, 6, 6).

    sigma [rad]: measurement noise per axis; gate: largest accepted squared innovation (a chi-square quantile of 3
    degrees of freedom; 16.27 passes 99.9 %). Out: innovation (3,) [rad], measured minus predicted attitude, body frame.
    Returns (normalised innovation squared, accepted); a measurement beyond the gate changes nothing.
    """
    difference = work[0, 0]
    quaternion_difference(q, measured, difference)
    rotation_vector_from_quaternion(difference, innovation)
    variance = sigma * sigma
    spread = work[1]
    inverse = work[2]
    for i in range(3):
        for j in range(3):
            spread[i, j] = covariance[i, j]
        spread[i, i] += variance
    invert_3x3(spread, inverse)
    squared = 0.0
    for i in range(3):
        for j in range(3):
            squared += innovation[i] * inverse[i, j] * innovation[j]
    if not squared <= gate:
        return squared, False

    # Gain K (6, 3) = covariance H^T S^-1, kept in columns 3 to 5 of `inverse`
    gain = inverse[:, 3:]
    for i in range(6):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += covariance[i, k] * inverse[k, j]
            gain[i, j] = total

    remainder = work[0]
    for i in range(6):
        for j in range(6):
            remainder[i, j] = 0.0
        remainder[i, i] = 1.0
        for j in range(3):
            remainder[i, j] -= gain[i, j]
    congruence(remainder, covariance, spread)
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(3):
                total += gain[i, k] * gain[j, k]
            covariance[i, j] += variance * total

    correction = work[1, 0]
    turn = work[1, 1]
    for i in range(6):
        total = 0.0
        for k in range(3):
            total += gain[i, k] * innovation[k]
        correction[i] = total
    quaternion_from_rotation_vector(correction[0], correction[1], correction[2], turn)
    turned = work[1, 2]
    quaternion_multiply(q, turn, turned)
    for i in range(4):
        q[i] = turned[i]
    quaternion_normalise(q)
    for i in range(3):
        bias[i] += correction[3 + i]
    return squared, True
