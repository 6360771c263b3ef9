"""Inertial measurement unit and star tracker, from the true state and counter-based noise; the rover's and the lander's.

Frames as in `cubli_ros.attitude`. The rover's inertial measurement unit sits at the cube's centre. Standard deviations of
the noise are per sample and per axis; zero switches a source off. Draws use the index ranges below, so streams may share
a key.
"""

from cubli_ros.attitude import quaternion_from_rotation_vector, quaternion_multiply, quaternion_normalise
from cubli_ros.jump_condition import centre_acceleration
from flight_graph.components.records import State, Vec3
from flight_graph.kernel import kernel
from flight_graph.noise import gaussian

GYRO_DRAW = 0  # [-] first of three draw indices: gyro white noise
WALK_DRAW = 3  # [-] gyro bias random walk
ACCELEROMETER_DRAW = 6  # [-] accelerometer white noise
STAR_TRACKER_DRAW = 0  # [-] star tracker, on its own key


class ImuState(State):
    """bias: of the gyro [rad/s]."""

    bias: Vec3


@kernel
def start_imu(p, x):
    """The gyro's bias starts at gyro_bias."""
    for i in range(3):
        x.bias[i] = p.gyro_bias[i]


@kernel
def noise_vector(key, tick, first_index, sigma, out):
    """out (3,) += sigma times three standard normal draws; nothing is drawn for sigma = 0."""
    if sigma > 0.0:
        for i in range(3):
            out[i] += sigma * gaussian(key, tick, first_index + i)


@kernel
def gyro_sample(key, tick, omega, gyro_sigma, walk_sigma, bias, out):
    """Measured rate out (3,) [rad/s] = omega + bias + white noise; then bias (3,) [rad/s] walks one step, in place.

    key: noise stream; tick: sample number; gyro_sigma (1e-4 rad/s is the default sensor's) and walk_sigma [rad/s] per
    sample.
    """
    for i in range(3):
        out[i] = omega[i] + bias[i]
    noise_vector(key, tick, GYRO_DRAW, gyro_sigma, out)
    noise_vector(key, tick, WALK_DRAW, walk_sigma, bias)


@kernel
def accelerometer_sample(key, tick, omega, omega_dot, gravity_body, length, sigma, out):
    """Specific force at the cube's centre out (3,) [m/s^2], body frame, while the corner is at rest: acceleration -
    gravity.

    omega [rad/s], omega_dot [rad/s^2], gravity_body [m/s^2], all (3,) in the body frame; length l [m]; sigma [m/s^2].
    """
    x, y, z = centre_acceleration(omega, omega_dot, length)
    out[0] = x - gravity_body[0]
    out[1] = y - gravity_body[1]
    out[2] = z - gravity_body[2]
    noise_vector(key, tick, ACCELEROMETER_DRAW, sigma, out)


@kernel
def star_tracker_sample(key, tick, q, sigma, out, work):
    """Measured attitude out (4,) = q dq(n): true quaternion turned by a small body-frame angle n; work (2, 4).

    sigma [rad] per axis (5e-5 is the default sensor's).
    """
    for i in range(3):
        work[0, i] = 0.0
    noise_vector(key, tick, STAR_TRACKER_DRAW, sigma, work[0])
    quaternion_from_rotation_vector(work[0, 0], work[0, 1], work[0, 2], work[1])
    quaternion_multiply(q, work[1], out)
    quaternion_normalise(out)
