"""Rotations as the lander's kernels use them: scalars in, tuples out, no allocation.

A quaternion is a float64 array (4,), Hamilton, in the order x, y, z, w: the order of geometry_msgs and of the paper's
8-vectors (vector part, then scalar). The quaternion ``q`` of an attitude rotates body coordinates (B) into landing-site
coordinates (D): r^D = q r^B q*.
"""

from flight_graph.kernel import kernel
from flight_graph.vectors import cross


@kernel
def to_site(q, x, y, z):
    """Coordinates in D of a vector given in B: q (x, y, z) q*, for a unit quaternion q (x, y, z, w) of B -> D."""
    tx, ty, tz = cross(q[0], q[1], q[2], x, y, z)
    tx, ty, tz = 2.0 * tx, 2.0 * ty, 2.0 * tz
    ux, uy, uz = cross(q[0], q[1], q[2], tx, ty, tz)
    return x + q[3] * tx + ux, y + q[3] * ty + uy, z + q[3] * tz + uz


@kernel
def to_body(q, x, y, z):
    """Coordinates in B of a vector given in D: q* (x, y, z) q, for a unit quaternion q (x, y, z, w) of B -> D."""
    tx, ty, tz = cross(q[0], q[1], q[2], x, y, z)
    tx, ty, tz = 2.0 * tx, 2.0 * ty, 2.0 * tz
    ux, uy, uz = cross(q[0], q[1], q[2], tx, ty, tz)
    return x - q[3] * tx + ux, y - q[3] * ty + uy, z - q[3] * tz + uz


@kernel
def multiply(a, b, out):
    """Hamilton product a b of quaternions (4,) in the order x, y, z, w; ``out`` is neither of them."""
    out[0] = a[3] * b[0] + b[3] * a[0] + a[1] * b[2] - a[2] * b[1]
    out[1] = a[3] * b[1] + b[3] * a[1] + a[2] * b[0] - a[0] * b[2]
    out[2] = a[3] * b[2] + b[3] * a[2] + a[0] * b[1] - a[1] * b[0]
    out[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]
