"""The baseline: a PD law on the position and a PD law on the attitude, which knows no constraint.

Ours, to have something to compare the landing law with: same feed-forward, same clip.
  f = f_ff - k_p r^B - k_d alpha (+ 2 m zeta x alpha with Coriolis compensation)
  tau = tau_ff - k_q sgn(q_0) q_v - D_w w
"""

import math

from flight_graph.components.records import field
from flight_graph.kernel import kernel
from flight_graph.vectors import cross
from lander_ros.feed_forward import LanderModel, clip_wrench, feed_forward
from lander_ros.rotation import to_body

OURS = "baseline of ours"


class PosePd(LanderModel):
    """Parameters of `pose_pd`. The position loop is critically damped; k_q is k_b/8, the landing law's slope at 0."""

    position_gain: float = field(0.04, unit="N/m", ge=0, source=OURS, doc="k_p")
    velocity_gain: float = field(2.0 * math.sqrt(0.04 * 500.0), unit="N s/m", ge=0, source=OURS, doc="k_d")
    attitude_gain: float = field(4.0, unit="N m", ge=0, source=OURS, doc="k_q")
    angular_damping: float = field(60.0, unit="N m s", ge=0, source=OURS, doc="D_w")
    coriolis_compensation: bool = field(False, source=OURS, doc="add 2 m zeta x alpha")


@kernel
def pose_pd(p, r, q, alpha, w, gravity, work, gradient, force, torque):
    """Force (3,) [N] and torque (3,) [N m] in B, after the clip; arguments as `lander_ros.landing_law.landing_law`.

    ``gradient`` (6,) receives (k_q sgn(q_0) q_v, k_p r^B); ``work`` is not used.
    """
    fx, fy, fz, tx, ty, tz = feed_forward(p, r, q, gravity)
    sign = 1.0
    if q[3] < 0.0:
        sign = -1.0
    gradient[0] = p.attitude_gain * sign * q[0]
    gradient[1] = p.attitude_gain * sign * q[1]
    gradient[2] = p.attitude_gain * sign * q[2]
    x, y, z = to_body(q, r[0], r[1], r[2])
    gradient[3], gradient[4], gradient[5] = p.position_gain * x, p.position_gain * y, p.position_gain * z
    if p.coriolis_compensation:
        zx, zy, zz = to_body(q, p.site_spin[0], p.site_spin[1], p.site_spin[2])
        cx, cy, cz = cross(zx, zy, zz, alpha[0], alpha[1], alpha[2])
        fx, fy, fz = fx + 2.0 * p.mass * cx, fy + 2.0 * p.mass * cy, fz + 2.0 * p.mass * cz
    force[0] = fx - gradient[3] - p.velocity_gain * alpha[0]
    force[1] = fy - gradient[4] - p.velocity_gain * alpha[1]
    force[2] = fz - gradient[5] - p.velocity_gain * alpha[2]
    torque[0] = tx - gradient[0] - p.angular_damping * w[0]
    torque[1] = ty - gradient[1] - p.angular_damping * w[1]
    torque[2] = tz - gradient[2] - p.angular_damping * w[2]
    return clip_wrench(force, torque, p.force_limit, p.torque_limit)
