"""The baseline: a PD law on the position and a PD law on the attitude, which knows no constraint.

Ours, to have something to compare the landing law with: same feed-forward, same clip.
  f = f_ff - k_p r^B - k_d alpha (+ 2 m zeta x alpha with Coriolis compensation)
  tau = tau_ff - k_q sgn(q_0) q_v - D_w w
"""

import math

from flight_graph.components.records import field
from flight_math import DualVector, cross, kernel, rotate_back, short_way, vector_part
from lander_ros.feed_forward import LanderModel, clip_wrench, feed_forward

OURS = "baseline of ours"


class PosePd(LanderModel):
    """Parameters of `pose_pd`. The position loop is critically damped; k_q is k_b/8, the landing law's slope at 0."""

    position_gain: float = field(0.04, unit="N/m", ge=0, source=OURS, doc="k_p")
    velocity_gain: float = field(2.0 * math.sqrt(0.04 * 500.0), unit="N s/m", ge=0, source=OURS, doc="k_d")
    attitude_gain: float = field(4.0, unit="N m", ge=0, source=OURS, doc="k_q")
    angular_damping: float = field(60.0, unit="N m s", ge=0, source=OURS, doc="D_w")
    coriolis_compensation: bool = field(False, source=OURS, doc="add 2 m zeta x alpha")


@kernel
def pose_pd(p, r, q, motor, gravity):
    """The wrench F = f + eps tau after the clip, and how many of its six axes are clipped.

    Arguments as `lander_ros.landing_law.landing_law`.
    """
    w, alpha = motor.real, motor.dual
    forward = feed_forward(p, r, q, gravity)
    force = forward.real - p.position_gain * rotate_back(q, r) - p.velocity_gain * alpha
    if p.coriolis_compensation:
        force = force + 2.0 * p.mass * cross(rotate_back(q, p.site_spin), alpha)
    torque = forward.dual - p.attitude_gain * vector_part(short_way(q)) - p.angular_damping * w
    return clip_wrench(p, DualVector(force, torque))
