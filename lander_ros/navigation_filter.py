"""Navigation of the landing: an error-state extended Kalman filter for pose and motor relative to the site.

Ours; the error state follows Lefferts, Markley, Shuster, "Kalman filtering for spacecraft attitude estimation", J.
Guidance 5(5), 1982. Reference: position r^D [m], velocity v = d(r^D)/dt [m/s] in D, attitude q (x, y, z, w, B to D),
biases of gyro b_g [rad/s] and accelerometer b_a [m/s^2]. Error state (15,): dr, dv (D), dtheta (B, q_true = q
dq(dtheta)), db_g, db_a.

  dr/dt = v,  dv/dt = R (a - b_a) + g - 2 w_D x v - w_D x (w_D x (rho_D + r)),  w_BI = gyro - b_g,  w = w_BI - R^T w_D
  dtheta' = -w_BI x dtheta - db_g,   dv' = -R [a x] dtheta - R db_a - 2 w_D x dv

a: specific force of the interval, from accelerometers; g: gravity of the model, in D. Its gradient over the position's
error is neglected. Measurements are taken one scalar after the other: their noise is the same in all directions.
"""

import math

from flight_graph.kernel import kernel
from flight_graph.vectors import cross
from lander_ros.rotation import multiply, to_body, to_site

STATES = 15  # length of the error state
POSITION, VELOCITY, ATTITUDE, GYRO, ACCELEROMETER = 0, 3, 6, 9, 12  # where its parts start


@kernel
def spin_quaternion(spin, t, out):
    """Attitude (4,) of D in the inertial frame that equals D at the epoch, t [s] later; spin (3,) [rad/s] in D."""
    rate = math.sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2])
    scale = math.sin(0.5 * rate * t) / rate if rate > 0.0 else 0.0
    for i in range(3):
        out[i] = scale * spin[i]
    out[3] = math.cos(0.5 * rate * t)


@kernel
def relative_attitude(site, inertial, out):
    """q (4,), B to D, from the attitudes of D (``site``) and B (``inertial``) in the inertial frame: site* inertial."""
    for i in range(3):
        site[i] = -site[i]
    multiply(site, inertial, out)
    for i in range(3):
        site[i] = -site[i]


@kernel
def turn(q, x, y, z, work):
    """q <- q exp(v/2) for the rotation vector v = (x, y, z) [rad] in B, in place; ``work`` is (2, 4)."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = 0.5 - angle * angle / 48.0
    if angle > 1e-3:  # [rad] below, the series is exact
        scale = math.sin(0.5 * angle) / angle
    work[0, 0], work[0, 1], work[0, 2] = scale * x, scale * y, scale * z
    work[0, 3] = math.cos(0.5 * angle)
    multiply(q, work[0], work[1])
    norm = math.sqrt(work[1, 0] * work[1, 0] + work[1, 1] * work[1, 1] + work[1, 2] * work[1, 2]
                     + work[1, 3] * work[1, 3])
    for i in range(4):
        q[i] = work[1, i] / norm


@kernel
def predict(p, x, force, gyro, gravity, dt):
    """Carry estimate and covariance over dt [s].

    p: site_position, site_spin, noise of a sample; x: position, velocity, orientation, gyro_bias, accelerometer_bias,
    covariance, transition, product, rate_before, quaternions. force (3,) [m/s^2], gyro (3,) [rad/s] as measured.
    """
    q, spin = x.orientation, p.site_spin
    ax = force[0] - x.accelerometer_bias[0]
    ay = force[1] - x.accelerometer_bias[1]
    az = force[2] - x.accelerometer_bias[2]
    wx = 0.5 * (gyro[0] + x.rate_before[0]) - x.gyro_bias[0]
    wy = 0.5 * (gyro[1] + x.rate_before[1]) - x.gyro_bias[1]
    wz = 0.5 * (gyro[2] + x.rate_before[2]) - x.gyro_bias[2]
    fill_transition(x.transition, q, ax, ay, az, wx, wy, wz, spin, dt)
    fx, fy, fz = to_site(q, ax, ay, az)
    cx, cy, cz = cross(spin[0], spin[1], spin[2], p.site_position[0] + x.position[0],
                       p.site_position[1] + x.position[1], p.site_position[2] + x.position[2])
    cx, cy, cz = cx + 2.0 * x.velocity[0], cy + 2.0 * x.velocity[1], cz + 2.0 * x.velocity[2]
    cx, cy, cz = cross(spin[0], spin[1], spin[2], cx, cy, cz)
    fx, fy, fz = fx + gravity[0] - cx, fy + gravity[1] - cy, fz + gravity[2] - cz
    x.position[0] += dt * (x.velocity[0] + 0.5 * dt * fx)
    x.position[1] += dt * (x.velocity[1] + 0.5 * dt * fy)
    x.position[2] += dt * (x.velocity[2] + 0.5 * dt * fz)
    x.velocity[0] += dt * fx
    x.velocity[1] += dt * fy
    x.velocity[2] += dt * fz
    zx, zy, zz = to_body(q, spin[0], spin[1], spin[2])
    turn(q, (wx - zx) * dt, (wy - zy) * dt, (wz - zz) * dt, x.quaternions)
    congruence(x.transition, x.covariance, x.product)
    for i in range(3):
        x.rate_before[i] = gyro[i]
        add = p.accelerometer_sigma * dt
        x.covariance[VELOCITY + i, VELOCITY + i] += add * add
        add = p.gyro_sigma * dt
        x.covariance[ATTITUDE + i, ATTITUDE + i] += add * add
        x.covariance[GYRO + i, GYRO + i] += p.gyro_walk_sigma * p.gyro_walk_sigma
        x.covariance[ACCELEROMETER + i, ACCELEROMETER + i] += p.accelerometer_walk_sigma * p.accelerometer_walk_sigma


@kernel
def fill_transition(out, q, ax, ay, az, wx, wy, wz, spin, dt):
    """First-order transition of the error state over dt [s], to (15, 15)."""
    for i in range(STATES):
        for j in range(STATES):
            out[i, j] = 0.0
        out[i, i] = 1.0
    for j in range(3):
        out[POSITION + j, VELOCITY + j] = dt
        out[ATTITUDE + j, GYRO + j] = -dt
        e_x, e_y, e_z = unit(j)
        x, y, z = cross(spin[0], spin[1], spin[2], e_x, e_y, e_z)
        out[3, 3 + j] -= 2.0 * dt * x
        out[4, 3 + j] -= 2.0 * dt * y
        out[5, 3 + j] -= 2.0 * dt * z
        x, y, z = cross(ax, ay, az, e_x, e_y, e_z)
        x, y, z = to_site(q, x, y, z)
        out[3, 6 + j], out[4, 6 + j], out[5, 6 + j] = -dt * x, -dt * y, -dt * z
        x, y, z = to_site(q, e_x, e_y, e_z)
        out[3, 12 + j], out[4, 12 + j], out[5, 12 + j] = -dt * x, -dt * y, -dt * z
        x, y, z = cross(wx, wy, wz, e_x, e_y, e_z)
        out[6, 6 + j] -= dt * x
        out[7, 6 + j] -= dt * y
        out[8, 6 + j] -= dt * z


@kernel
def congruence(matrix, covariance, work):
    """covariance <- matrix covariance matrix^T in place, exactly symmetric; all (15, 15)."""
    for i in range(STATES):
        for j in range(STATES):
            total = 0.0
            for k in range(STATES):
                total += matrix[i, k] * covariance[k, j]
            work[i, j] = total
    for i in range(STATES):
        for j in range(i + 1):
            total = 0.0
            for k in range(STATES):
                total += work[i, k] * matrix[j, k]
            covariance[i, j] = total
            covariance[j, i] = total


@kernel
def take_scalar(covariance, correction, row, residual, variance, gate, gain):
    """One scalar measurement ``residual`` = row . error + noise, into correction (15,) and covariance (15, 15).

    Returns (normalised innovation squared, taken); one beyond ``gate`` changes nothing. ``gain`` (15,) is work.
    """
    spread = variance
    for i in range(STATES):
        total = 0.0
        for j in range(STATES):
            total += covariance[i, j] * row[j]
        gain[i] = total
    for i in range(STATES):
        spread += row[i] * gain[i]
        residual -= row[i] * correction[i]
    squared = residual * residual / spread
    if not squared <= gate:
        return squared, False
    for i in range(STATES):
        correction[i] += gain[i] * residual / spread
        for j in range(i + 1):
            covariance[i, j] -= gain[i] * gain[j] / spread
            covariance[j, i] = covariance[i, j]
    return squared, True


@kernel
def unit(axis):
    """The unit vector of an axis 0, 1, 2, as a tuple."""
    if axis == 0:
        return 1.0, 0.0, 0.0
    if axis == 1:
        return 0.0, 1.0, 0.0
    return 0.0, 0.0, 1.0


@kernel
def clear(vector):
    """Zeros."""
    for i in range(len(vector)):
        vector[i] = 0.0


@kernel
def take_attitude(p, x, measured):
    """A star tracker's attitude (4,), B to D, with noise star_tracker_sigma [rad]; returns its innovation squared."""
    q = x.orientation
    total = 0.0
    for i in range(3):
        q[i] = -q[i]
    multiply(q, measured, x.quaternions[0])
    for i in range(3):
        q[i] = -q[i]
    double = 2.0 if x.quaternions[0, 3] >= 0.0 else -2.0
    for i in range(3):
        clear(x.row)
        x.row[ATTITUDE + i] = 1.0
        squared, taken = take_scalar(x.covariance, x.correction, x.row, double * x.quaternions[0, i],
                                     p.star_tracker_sigma * p.star_tracker_sigma, p.gate, x.gain)
        total += squared
        count(x, taken)
    return total


@kernel
def count(x, taken):
    if taken:
        x.accepted += 1.0
    else:
        x.rejected += 1.0


@kernel
def mark_direction(p, x):
    """Unit vector from B to the mark in D, to ``x.direction``, and the distance [m], of the estimate."""
    mx, my, mz = -x.position[0], -x.position[1], -x.position[2] - p.mark_depth
    distance = math.sqrt(mx * mx + my * my + mz * mz)
    x.direction[0], x.direction[1], x.direction[2] = mx / distance, my / distance, mz / distance
    return distance


@kernel
def take_range(p, x, measured):
    """A distance to the mark [m]; returns its innovation squared."""
    distance = mark_direction(p, x)
    sigma = p.altimeter_sigma + p.altimeter_relative_sigma * distance
    clear(x.row)
    for i in range(3):
        x.row[POSITION + i] = -x.direction[i]
    squared, taken = take_scalar(x.covariance, x.correction, x.row, measured - distance, sigma * sigma, p.gate, x.gain)
    count(x, taken)
    return squared


@kernel
def take_direction(p, x, measured):
    """A unit vector to the mark (3,), in B; returns its innovation squared, of two degrees of freedom."""
    distance = mark_direction(p, x)
    d = x.direction
    ux, uy, uz = to_body(x.orientation, d[0], d[1], d[2])
    x.seen[0], x.seen[1], x.seen[2] = ux, uy, uz
    total = 0.0
    for i in range(3):
        clear(x.row)
        e_x, e_y, e_z = unit(i)
        # row i of -R^T (1 - u u^T)/|m|: the axis e_i of B, in D, less its part along u
        ax, ay, az = to_site(x.orientation, e_x, e_y, e_z)
        x.row[0] = -(ax - x.seen[i] * d[0]) / distance
        x.row[1] = -(ay - x.seen[i] * d[1]) / distance
        x.row[2] = -(az - x.seen[i] * d[2]) / distance
        # row i of [u x]: e_i . (u x theta) = (e_i x u) . theta
        x.row[6], x.row[7], x.row[8] = cross(e_x, e_y, e_z, ux, uy, uz)
        squared, taken = take_scalar(x.covariance, x.correction, x.row, measured[i] - x.seen[i],
                                     p.camera_sigma * p.camera_sigma, p.gate, x.gain)
        total += squared
        count(x, taken)
    return total


@kernel
def inject(x):
    """Move the correction into the estimate."""
    for i in range(3):
        x.position[i] += x.correction[POSITION + i]
        x.velocity[i] += x.correction[VELOCITY + i]
        x.gyro_bias[i] += x.correction[GYRO + i]
        x.accelerometer_bias[i] += x.correction[ACCELEROMETER + i]
    turn(x.orientation, x.correction[6], x.correction[7], x.correction[8], x.quaternions)
    clear(x.correction)
