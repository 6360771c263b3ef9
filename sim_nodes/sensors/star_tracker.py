"""Star tracker. p: seed, sigma [rad] per axis."""

from flight_math import kernel, normalised, quaternion_from_rotation_vector
from sim_nodes.sensors.white_noise import white_noise

STAR_TRACKER_DRAW = 0  # [-] first of three draw indices


@kernel
def measured_attitude(t_ns, p, attitude):
    """q dq(n): the true quaternion turned by a small body-frame angle n."""
    error = white_noise(p.seed, t_ns, STAR_TRACKER_DRAW, p.sigma)
    return normalised(attitude * quaternion_from_rotation_vector(error))
