"""Navigation of the landing: an error-state extended Kalman filter for pose and motor relative to the site.

Ours; the error state follows Lefferts, Markley, Shuster, "Kalman filtering for spacecraft attitude estimation", J.
Guidance 5(5), 1982. Reference: position r^D [m], velocity v = d(r^D)/dt [m/s] in D, attitude q (x, y, z, w, B to D),
biases of gyro b_g [rad/s] and accelerometer b_a [m/s^2]. Error state, five Vec3: dr, dv (D), dtheta (B, q_true = q
dq(dtheta)), db_g, db_a.

  dr/dt = v,  dv/dt = R (a - b_a) + g - 2 w_D x v - w_D x (w_D x (rho_D + r)),  w_BI = gyro - b_g,  w = w_BI - R^T w_D
  dtheta' = -w_BI x dtheta - db_g,   dv' = -R [a x] dtheta - R db_a - 2 w_D x dv

a: specific force of the interval, from accelerometers; g: gravity of the model, in D. Its gradient over the position's
error is neglected. Measurements are taken one scalar after the other: their noise is the same in all directions.
The covariance P is five by five blocks of 3x3, a correction five rows of three, both in the order below.
p: `lander_ros.navigation.NavigationParameters`; x: its state.
"""

from typing import NamedTuple

from flight_math import (
    Mat3,
    Vec3,
    conjugate,
    cross,
    dot,
    identity3,
    kernel,
    mat3,
    norm,
    normalised,
    outer,
    quaternion,
    quaternion_from_rotation_vector,
    rotate,
    rotate_back,
    rotation_matrix,
    row,
    sincos,
    skew,
    stack_array,
    transpose,
    vec3,
    vector_part,
)

POSITION, VELOCITY, ATTITUDE, GYRO, ACCELEROMETER = range(5)  # places of the parts of the error state
PARTS = 5


@kernel
def spin_quaternion(spin, t):
    """Attitude of D in the inertial frame that equals D at the epoch, t [s] later; spin [rad/s] in D."""
    rate = norm(spin)
    sine, cosine = sincos(0.5 * rate * t)
    return quaternion(sine / rate * spin if rate > 0.0 else spin, cosine)


@kernel
def turned(q, v):
    """q exp(v/2) for the rotation vector v [rad] in B, of norm 1."""
    return normalised(q * quaternion_from_rotation_vector(v))


# -- prediction --------------------------------------------------------------------------------------------------------
class Transition(NamedTuple):
    """The blocks of F, the transition of the error state over dt [s], that are not 0, 1 or dt: dv and dtheta by others.

      dr <- dr + dt dv,   dv <- vv dv + va dtheta + vb db_a,   dtheta <- aa dtheta - dt db_g
    """

    dt: float
    vv: Mat3
    va: Mat3
    vb: Mat3
    aa: Mat3


@kernel
def predict(p, x, force, gyro, gravity):
    """Carry estimate and covariance over p.period; force a [m/s^2] and gyro [rad/s] as measured, gravity g^D [m/s^2]."""
    dt, q, spin = p.period, x.orientation, p.site_spin
    a = force - x.accelerometer_bias
    w = 0.5 * (gyro + x.rate_before) - x.gyro_bias  # w_BI
    spread(p, x.covariance, transition(q, a, w, spin, dt))
    centrifugal_and_coriolis = cross(spin, cross(spin, p.site_position + x.position) + 2.0 * x.velocity)
    acceleration = rotate(q, a) + gravity - centrifugal_and_coriolis
    x.position = x.position + dt * (x.velocity + 0.5 * dt * acceleration)
    x.velocity = x.velocity + dt * acceleration
    x.orientation = turned(q, dt * (w - rotate_back(q, spin)))
    x.rate_before = gyro


@kernel
def transition(q, a, w, spin, dt):
    """F to first order, at the attitude q, specific force a, inertial rate w in B and spin w_D in D."""
    r = rotation_matrix(q)
    return Transition(dt, identity3() - 2.0 * dt * skew(spin), -dt * (r @ skew(a)), -dt * r, identity3() - dt * skew(w))


@kernel
def moved(f, parts):
    """F times a column of five blocks."""
    r, v, a, g, b = parts
    return r + f.dt * v, f.vv @ v + f.va @ a + f.vb @ b, f.aa @ a - f.dt * g, g, b


@kernel
def spread(p, covariance, f):
    """P <- F P F^T + noise of the sensors over a period, in place, exactly symmetric."""
    for j in range(PARTS):
        put_column(covariance, j, moved(f, block_column(covariance, j)))
    for i in range(PARTS):
        put_row(covariance, i, moved(f, block_row(covariance, i)))
    for i in range(PARTS):
        for j in range(i):
            covariance[j, i] = transpose(mat3(covariance[i, j]))
        covariance[i, i] = mirrored(mat3(covariance[i, i]))
    add_variance(covariance, VELOCITY, p.accelerometer_sigma * p.period)
    add_variance(covariance, ATTITUDE, p.gyro_sigma * p.period)
    add_variance(covariance, GYRO, p.gyro_walk_sigma)
    add_variance(covariance, ACCELEROMETER, p.accelerometer_walk_sigma)


@kernel
def block_column(blocks, j):
    """The five blocks of column j."""
    return (mat3(blocks[0, j]), mat3(blocks[1, j]), mat3(blocks[2, j]), mat3(blocks[3, j]), mat3(blocks[4, j]))


@kernel
def put_column(blocks, j, parts):
    """Store what F changes of column j."""
    blocks[POSITION, j], blocks[VELOCITY, j], blocks[ATTITUDE, j] = parts[0], parts[1], parts[2]


@kernel
def block_row(blocks, i):
    """The five blocks of row i, each transposed: a column of the transpose."""
    return (transpose(mat3(blocks[i, 0])), transpose(mat3(blocks[i, 1])), transpose(mat3(blocks[i, 2])),
            transpose(mat3(blocks[i, 3])), transpose(mat3(blocks[i, 4])))


@kernel
def put_row(blocks, i, parts):
    """Store what F^T changes of row i, from the column of the transpose."""
    blocks[i, POSITION], blocks[i, VELOCITY] = transpose(parts[0]), transpose(parts[1])
    blocks[i, ATTITUDE] = transpose(parts[2])


@kernel
def mirrored(m):
    """The lower triangle of m, and above the diagonal its mirror image."""
    return Mat3(m[0, 0], m[1, 0], m[2, 0], m[1, 0], m[1, 1], m[2, 1], m[2, 0], m[2, 1], m[2, 2])


@kernel
def add_variance(covariance, part, sigma):
    """Add an equal standard deviation sigma on each axis of a part of the error state."""
    covariance[part, part] = mat3(covariance[part, part]) + sigma * sigma * identity3()


# -- measurements ------------------------------------------------------------------------------------------------------
@kernel
def take_scalar(p, x, correction, by_place, by_turn, residual, sigma):
    """One scalar measurement, residual = by_place . dr + by_turn . dtheta + noise of sigma, into correction and P.

    Returns the normalised innovation squared; one beyond p.gate changes nothing, but is counted.
    """
    gain = stack_array(PARTS, 3)
    for i in range(PARTS):
        gain[i] = mat3(x.covariance[i, POSITION]) @ by_place + mat3(x.covariance[i, ATTITUDE]) @ by_turn
    variance = sigma * sigma + dot(by_place, vec3(gain[POSITION])) + dot(by_turn, vec3(gain[ATTITUDE]))
    residual -= dot(by_place, vec3(correction[POSITION])) + dot(by_turn, vec3(correction[ATTITUDE]))
    squared = residual * residual / variance
    if not squared <= p.gate:
        x.rejected += 1.0
        return squared
    for i in range(PARTS):
        correction[i] = vec3(correction[i]) + residual / variance * vec3(gain[i])
        for j in range(i + 1):
            block = mat3(x.covariance[i, j]) - 1.0 / variance * outer(vec3(gain[i]), vec3(gain[j]))
            x.covariance[i, j] = block
            x.covariance[j, i] = transpose(block)
    x.accepted += 1.0
    return squared


@kernel
def attitude_residual(x, measured):
    """Small rotation vector [rad] in B from the estimated attitude to a measured one, B to D."""
    error = conjugate(x.orientation) * measured
    return (2.0 if error.w >= 0.0 else -2.0) * vector_part(error)


@kernel
def take_attitude(p, x, correction, measured):
    """A star tracker's attitude, B to D, with noise star_tracker_sigma [rad]; returns its innovation squared."""
    angle = attitude_residual(x, measured)
    nothing, squared = Vec3(0.0, 0.0, 0.0), 0.0
    for axis in range(3):
        squared += take_scalar(p, x, correction, nothing, row(identity3(), axis), angle[axis], p.star_tracker_sigma)
    return squared


@kernel
def mark_direction(p, position):
    """Unit vector from B to the mark in D, and the distance [m]."""
    to_mark = -position - Vec3(0.0, 0.0, p.mark_depth)
    distance = norm(to_mark)
    return to_mark / distance, distance


@kernel
def range_sigma(p, distance):
    """Noise [m] of the altimeter at a distance [m]."""
    return p.altimeter_sigma + p.altimeter_relative_sigma * distance


@kernel
def take_range(p, x, correction, measured):
    """A distance to the mark [m]; returns its innovation squared."""
    direction, distance = mark_direction(p, x.position)
    sigma = range_sigma(p, distance)
    return take_scalar(p, x, correction, -direction, Vec3(0.0, 0.0, 0.0), measured - distance, sigma)


@kernel
def direction_seen(p, x):
    """The unit vector u to the mark in B, and its derivatives by dr and by dtheta.

    u = R^T m/|m|:  du = -R^T (1 - (m m^T)/|m|^2)/|m| dr + [u x] dtheta; the axis e_i of B is row i of R^T.
    """
    direction, distance = mark_direction(p, x.position)
    seen = rotate_back(x.orientation, direction)
    by_place = -(transpose(rotation_matrix(x.orientation)) - outer(seen, direction)) / distance
    return seen, by_place, skew(seen)


@kernel
def take_direction(p, x, correction, measured):
    """A unit vector u to the mark, in B; returns its innovation squared, of two degrees of freedom."""
    seen, by_place, by_turn = direction_seen(p, x)
    squared = 0.0
    for i in range(3):
        squared += take_scalar(p, x, correction, row(by_place, i), row(by_turn, i), measured[i] - seen[i], p.camera_sigma)
    return squared


@kernel
def inject(x, correction):
    """Move the correction into the estimate."""
    x.position = x.position + vec3(correction[POSITION])
    x.velocity = x.velocity + vec3(correction[VELOCITY])
    x.orientation = turned(x.orientation, vec3(correction[ATTITUDE]))
    x.gyro_bias = x.gyro_bias + vec3(correction[GYRO])
    x.accelerometer_bias = x.accelerometer_bias + vec3(correction[ACCELEROMETER])
