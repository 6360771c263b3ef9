"""Attitude estimation of the Cubli rover: a multiplicative extended Kalman filter for gyro and star tracker.

Source: Lefferts, Markley, Shuster, "Kalman filtering for spacecraft attitude estimation", J. Guidance 5(5), 1982;
update in Joseph's form. Reference: quaternion q (x, y, z, w, body to balance frame, see `cubli_ros.attitude`) and gyro
bias b [rad/s]. Error state: body-frame rotation vector dtheta with q_true = q dq(dtheta), and db = b_true - b:

    dtheta' = -omega x dtheta - db - n_gyro,   db' = n_walk,   omega = gyro - b.

Its covariance (6, 6) stands in three blocks: [[P_a, P_c], [P_c^T, P_b]], attitude [rad^2], cross [rad^2/s], bias
[rad^2/s^2]. Noise levels are per sample: gyro white noise [rad/s], bias random walk [rad/s] added each sample, star
tracker [rad] per axis. The injected rotation's effect on the covariance (second order in dtheta) is neglected.
p, x: parameters and state of `cubli_ros.attitude_estimator`.
"""

import math

from flight_math import (
    conjugate,
    diagonal,
    identity3,
    inverse,
    kernel,
    normalised,
    outer,
    quaternion_from_rotation_vector,
    rotation_vector,
    same,
    sincos,
    skew,
    transpose,
)

SMALL_SQUARE = 1e-3  # [rad^2] below, the series of `transition` are exact to 1e-12


@kernel
def start(p, x, measured):
    """Start at a first attitude, with zero bias."""
    x.quaternion = measured
    x.bias = same(0.0)
    x.attitude_covariance = diagonal(same(p.star_tracker_sigma * p.star_tracker_sigma))
    x.cross_covariance = diagonal(same(0.0))
    x.bias_covariance = diagonal(same(p.initial_bias_sigma * p.initial_bias_sigma))


@kernel
def transition(omega, h):
    """Upper blocks of the error state's transition over h [s] at a constant rate omega [rad/s]; the lower are 0 and 1.

    exp(-[a x]) and -h times its mean over the period, a = omega h.
    """
    a = omega * h
    square = a @ a
    if square < SMALL_SQUARE:
        s_1 = 1.0 - square / 6.0 * (1.0 - square / 20.0)
        s_2 = 0.5 - square / 24.0 * (1.0 - square / 30.0)
        s_3 = 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0)
    else:
        angle = math.sqrt(square)
        sine, cosine = sincos(angle)
        s_1 = sine / angle
        s_2 = (1.0 - cosine) / square
        s_3 = (1.0 - s_1) / square
    across = outer(a, a) - diagonal(same(square))  # [a x]^2
    return identity3() - s_1 * skew(a) + s_2 * across, -h * (identity3() - s_2 * skew(a) + s_3 * across)


@kernel
def symmetric(m):
    """The symmetric part of a matrix."""
    return 0.5 * (m + transpose(m))


@kernel
def predict(p, x, gyro):
    """Carry the estimate from the previous gyro sample x.gyro_before to this one [rad/s].

    The rate of the interval is the mean of its two end samples minus the bias: exact to second order in the period
    where a sample held over the period would lag by half of it.
    """
    carry(x, 0.5 * (x.gyro_before + gyro) - x.bias, p.period, p.gyro_sigma * p.period, p.gyro_walk_sigma)


@kernel
def carry(x, omega, h, angle_noise, walk):
    """The estimate h [s] further at a rate omega [rad/s]; angle_noise [rad], walk of the bias [rad/s]: of the interval."""
    x.quaternion = normalised(x.quaternion * quaternion_from_rotation_vector(h * omega))
    f, g = transition(omega, h)
    attitude, cross, bias = x.attitude_covariance, x.cross_covariance, x.bias_covariance
    moved = f @ cross + g @ bias
    x.attitude_covariance = symmetric((f @ attitude + g @ transpose(cross)) @ transpose(f) + moved @ transpose(g)) + (
        diagonal(same(angle_noise * angle_noise)))
    x.cross_covariance = moved
    x.bias_covariance = bias + diagonal(same(walk * walk))


@kernel
def update(p, x, measured):
    """Correct the estimate with a measured attitude. Returns whether the measurement was within the gate.

    x.innovation [rad]: measured minus predicted attitude, body frame; x.innovation_squared is normalised. The gate is a
    chi-square quantile of 3 degrees of freedom. A measurement beyond it (or NaN) changes nothing else.
    """
    spread = innovate(p, x, measured)
    if not x.innovation_squared <= p.gate:
        return False
    correct(p, x, spread)
    return True


@kernel
def innovate(p, x, measured):
    """The innovation of a measured attitude, into the state; returns the inverse of its covariance [1/rad^2]."""
    variance = p.star_tracker_sigma * p.star_tracker_sigma
    spread = inverse(x.attitude_covariance + diagonal(same(variance)))
    x.innovation = rotation_vector(conjugate(x.quaternion) * measured)
    x.innovation_squared = x.innovation @ (spread @ x.innovation)
    return spread


@kernel
def correct(p, x, spread):
    """Correct the estimate with the innovation that `innovate` left; spread: what it returned."""
    attitude, cross, bias = x.attitude_covariance, x.cross_covariance, x.bias_covariance
    variance = p.star_tracker_sigma * p.star_tracker_sigma
    gain_a, gain_b = attitude @ spread, transpose(cross) @ spread
    # Joseph's form, (1 - K H) P (1 - K H)^T + K R K^T, block by block
    rest = identity3() - gain_a
    across = cross - attitude @ transpose(gain_b)
    drop = gain_b @ cross
    x.attitude_covariance = symmetric(rest @ attitude @ transpose(rest) + variance * (gain_a @ transpose(gain_a)))
    x.cross_covariance = rest @ across + variance * (gain_a @ transpose(gain_b))
    x.bias_covariance = symmetric(bias - drop - transpose(gain_b @ across) + variance * (gain_b @ transpose(gain_b)))
    x.quaternion = normalised(x.quaternion * quaternion_from_rotation_vector(gain_a @ x.innovation))
    x.bias += gain_b @ x.innovation
