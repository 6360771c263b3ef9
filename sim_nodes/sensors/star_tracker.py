"""Star tracker. p: seed, sigma [rad] per axis; boresight and blinding_direction (any length), blinding_angle [rad].

A tracker that sees no stars says so: its quaternion is all zero, which is no attitude.
"""

from flight_math import Quaternion, cos, kernel, norm, normalised, quaternion_from_rotation_vector, rotate
from sim_nodes.sensors.white_noise import white_noise

STAR_TRACKER_DRAW = 0  # [-] first of three draw indices


@kernel
def measured_attitude(t_ns, p, attitude):
    """q dq(n): the true quaternion turned by a small body-frame angle n."""
    error = white_noise(p.seed, t_ns, STAR_TRACKER_DRAW, p.sigma)
    return normalised(attitude * quaternion_from_rotation_vector(error))


NO_FIX = Quaternion(0.0, 0.0, 0.0, 0.0)  # [-] what a tracker sends that sees no stars


@kernel
def is_blinded(p, attitude):
    """Whether the boresight (body frame) is within blinding_angle of blinding_direction (frame of the attitude's q)."""
    if p.blinding_angle <= 0.0:
        return False
    size = norm(p.boresight) * norm(p.blinding_direction)
    return rotate(attitude, p.boresight) @ p.blinding_direction >= size * cos(p.blinding_angle)
