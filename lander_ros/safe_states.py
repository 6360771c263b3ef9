"""The lander's safe states as control laws: hover and climb on one law of position and attitude; what they cost.

  v_ref = sat(k_p e_u, v_c) u + sat(k_p e_n, v_c),   e = r_hold - r,  e_u = e.u,  e_n = e - e_u u
  f = f_ff + m R^T sat(k_v (v_ref - v), a_max),      tau = tau_ff - k_q sgn(e_0) e_v - D_w w,  (e_v, e_0) = q_hold* q

u: unit vector of the line on which the craft climbs. f_ff carries the weight and the site's own motion, so v - v_ref
decays as exp(-k_v t), and then e as exp(-k_p t), never faster than v_c; k_v >= 4 k_p leaves no overshoot. The law's own
force is limited by its size, not by axis, so a limit never turns its direction; m a_max and the weight together stay below
the thrusters' limit.

hover   r_hold: where a deceleration of min(s v, a_max) brings the craft to rest, s = k_v (1 + sqrt(1 - 4 k_p/k_v))/2 the
        faster pole of the law, so that it does not pass it; but not lower than hover_floor
abort   u = r/|r|, the line of sight from the goal, raised to 45 degrees where it is lower;
        r_hold = u max(abort_distance, |r| + abort_climb)
both    q_hold: the attitude with thrust_axis turned onto u by the least rotation; z_B, so that the camera keeps the mark,
        or another axis where the thrusters of z_B are dead

Cost, an upper bound by the triangle inequality, where g_e = |f_ff|/m + 2 |w_D| v_c:
  hover   |v| + g_e hold_time
  abort   |v - v_c u| + v_c + g_e (climb_time + hold_time),  climb_time = (|r_hold| - |r| + |v - v_c u|/k_v)/v_c
"""

from typing import NamedTuple

from flight_graph.components.records import field
from flight_math import (
    DualVector,
    Quaternion,
    Vec3,
    conjugate,
    cross,
    dot,
    hypot,
    kernel,
    norm,
    normalised,
    quaternion,
    rotate,
    rotate_back,
    short_way,
    sqrt,
    vector_part,
)
from lander_ros.feed_forward import LanderModel, clip_wrench, feed_forward


class SafeStates(LanderModel):
    approach_gain: float = field(0.04, unit="1/s", gt=0, doc="k_p, from distance to speed")
    velocity_gain: float = field(0.2, unit="1/s", gt=0, doc="k_v, from speed to acceleration; at least 4 k_p")
    acceleration_limit: float = field(0.05, unit="m/s^2", gt=0, doc="a_max, besides the weight")
    attitude_gain: float = field(8.0, unit="N m", gt=0, doc="k_q")
    angular_damping: float = field(60.0, unit="N m s", gt=0, doc="D_w")
    thrust_axis: Vec3 = field((0.0, 0.0, 1.0), unit="1", ge=-1, le=1, doc="unit vector in B that is turned up the line")
    climb_speed: float = field(0.5, unit="m/s", gt=0, doc="v_c")
    abort_distance: float = field(150.0, unit="m", gt=0, doc="from the goal, where an abort holds")
    abort_climb: float = field(20.0, unit="m", gt=0, doc="climb of an abort that begins beyond")
    hover_floor: float = field(5.0, unit="m", gt=0, doc="smallest height of a hover")
    hold_time: float = field(600.0, unit="s", ge=0, doc="of hover or hold that must be paid for")


class Station(NamedTuple):
    """Where a safe state goes: r_hold [m] in D, q_hold (B -> D), and u, the line's direction in D."""

    position: Vec3
    orientation: Quaternion
    line: Vec3


class Cost(NamedTuple):
    """delta-v [m/s] and time [s] of a safe state."""

    delta_v: float
    time: float


@kernel
def limited(v, size):
    """sat(v, size): the vector, or one of that size in its direction."""
    length = norm(v)
    return v if length <= size else size / length * v


@kernel
def facing(q, axis, up):
    """The attitude with an axis in B turned onto a direction in D by the least rotation; none where they are opposite."""
    now = rotate(q, axis)
    half = 1.0 + dot(now, up)
    return normalised(quaternion(cross(now, up), half)) * q if half > 1e-6 else q


@kernel
def line_of_sight(r):
    """u, from the goal to the craft; at least 45 degrees up, and straight up close to the goal."""
    raised = Vec3(r.x, r.y, max(r.z, hypot(r.x, r.y)))
    return normalised(raised) if norm(r) > 1.0 else Vec3(0.0, 0.0, 1.0)


@kernel
def stopping_distance(p, speed):
    """The way [m] in which a deceleration of min(s v, a_max) takes a speed [m/s] away, s: the law's faster pole [1/s]."""
    fast = 0.5 * p.velocity_gain * (1.0 + sqrt(max(1.0 - 4.0 * p.approach_gain / p.velocity_gain, 0.0)))
    slow = min(speed, p.acceleration_limit / fast)
    return (speed * speed - slow * slow) / (2.0 * p.acceleration_limit) + slow / fast


@kernel
def hover_station(p, r, q, v):
    """Where a hover that begins at r^D, q, v [m/s] in D holds."""
    speed = norm(v)
    place = r + stopping_distance(p, speed) / speed * v if speed > 0.0 else r
    place = Vec3(place.x, place.y, max(place.z, p.hover_floor))
    up = line_of_sight(place)
    return Station(place, facing(q, p.thrust_axis, up), up)


@kernel
def abort_station(p, r, q):
    """Where an abort that begins at r^D, q holds."""
    up = line_of_sight(r)
    return Station(max(p.abort_distance, norm(r) + p.abort_climb) * up, facing(q, p.thrust_axis, up), up)


@kernel
def safe_wrench(p, pose, station, gravity):
    """The wrench towards a station; pose: r^D, q, V as of `pose_and_motor`; gravity: the model's g^D [m/s^2]."""
    r, q, motor = pose
    forward = feed_forward(p, r, q, gravity)
    gap = station.position - r
    rise = dot(gap, station.line) * station.line
    wanted = limited(p.approach_gain * rise, p.climb_speed) + limited(p.approach_gain * (gap - rise), p.climb_speed)
    push = limited(p.velocity_gain * (rotate_back(q, wanted) - motor.dual), p.acceleration_limit)
    turn = vector_part(short_way(conjugate(station.orientation) * q))
    torque = forward.dual - p.attitude_gain * turn - p.angular_damping * motor.real
    wrench, _ = clip_wrench(p, DualVector(forward.real + p.mass * push, torque))
    return wrench


@kernel
def weight(p, forward):
    """g_e [m/s^2] that a safe state has to carry at most."""
    return norm(forward.real) / p.mass + 2.0 * norm(p.site_spin) * p.climb_speed


@kernel
def hover_cost(p, v, carried):
    """Of stopping from v [m/s] and hovering for hold_time; carried: `weight`."""
    return Cost(norm(v) + carried * p.hold_time, p.hold_time)


@kernel
def abort_cost(p, r, v, carried):
    """Of an abort from r^D at v [m/s] in D, and the time of its climb."""
    up = line_of_sight(r)
    change = norm(v - p.climb_speed * up)
    way = max(p.abort_distance, norm(r) + p.abort_climb) - norm(r) + change / p.velocity_gain
    climb = way / p.climb_speed
    return Cost(change + p.climb_speed + carried * (climb + p.hold_time), climb)
