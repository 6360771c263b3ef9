"""What the contact of the Cubli rover does at each step: stand, slide, fly, land, fall.

Kernels over the parameters p and the state x of `sim_nodes.cubli.physical_plant`; the events are described there, the
equations of motion in `sim_nodes.cubli.dynamics` (standing) and `sim_nodes.cubli.contact`. normal: of the ground. Vectors
without a note are in the site frame.
"""

import math

from cubli_ros.attitude import level_gravity
from cubli_ros.jump_condition import LOST_CONTACT_RATIO, centre_acceleration, friction_ratio, split
from flight_math import Vec3, kernel, maximum, minimum, norm, rotate, same
from sim_nodes.cubli import contact, dynamics
from sim_nodes.cubli.contact import SLIDING
from sim_nodes.cubli.plant import SITE_FROM_BALANCE

STANDING, FLYING, ENDED = 0, 2, 3  # modes, beside SLIDING
FLY, SLIDE = 0, 1  # choices of on_lift_off and on_slip
LANDED, FELL, JAMMED = 1, 2, 3  # outcomes
LOST = LOST_CONTACT_RATIO


@kernel
def motion_of(x):
    """The motion of `sim_nodes.cubli.contact` in the state."""
    return x.attitude, x.rates, x.wheel_speed, x.centre, x.centre_velocity


@kernel
def push(p, x):
    """Disturbing torque M_d now [N m], body frame."""
    return dynamics.centre_momentum(p, x.disturbance)


@kernel
def standing_force(p, x):
    """Force m (a - g) [N] that holds the standing corner; the angular acceleration into the state."""
    _, x.accelerations, _ = dynamics.standing_rates(
        (p, level_gravity(p), x.torque), push(p, x), (x.attitude, x.rates, x.wheel_speed))
    acceleration = centre_acceleration(x.rates, x.accelerations, p.length)
    return p.mass * (rotate(SITE_FROM_BALANCE * x.attitude, acceleration) + Vec3(0.0, 0.0, p.gravity))


@kernel
def released(p, x):
    """Acceleration of the corner [m/s^2] if nothing held it; the angular acceleration into the state."""
    x.accelerations, acceleration = contact.free_acceleration(p, x.torque, push(p, x), motion_of(x))
    return contact.corner_acceleration(p, SITE_FROM_BALANCE * x.attitude, x.rates, x.accelerations, acceleration)


@kernel
def across(vector, normal, otherwise):
    """Unit vector of a vector's part across the normal; ``otherwise`` where there is none."""
    part = vector - (vector @ normal) * normal
    size = norm(part)
    return part / size if size > 0.0 else otherwise


@kernel
def note(p, x, along, sideways):
    """Extremes since the last message; parts [N] of the force along the normal and across it."""
    x.normal_force = minimum(x.normal_force, along / (p.mass * p.gravity))
    x.friction_ratio = maximum(x.friction_ratio, friction_ratio(along, sideways))


@kernel
def first_time(before, t):
    """t where it is the first time (before is negative)."""
    return t if before < 0.0 else before


@kernel
def events(t, p, x, normal):
    """What the contact does from now on, t [s]; force and extremes into the state."""
    x.disturbance = dynamics.disturbance(p, t)
    if x.mode == STANDING:
        keep_standing(t, p, x, normal)
    elif x.mode == SLIDING:
        keep_sliding(t, p, x, normal)
    elif x.mode == FLYING:
        released(p, x)
        note(p, x, 0.0, 0.0)


@kernel
def keep_standing(t, p, x, normal):
    """Force of the standing corner; where the ground cannot give it, it flies or slides."""
    x.force = standing_force(p, x)
    along, sideways = split(x.force, normal)
    note(p, x, along, sideways)
    x.slipping = sideways > p.friction * along
    if x.slipping:
        x.slip_time = first_time(x.slip_time, t)
    if along < 0.0:
        x.lift_off_time = first_time(x.lift_off_time, t)
        if p.on_lift_off == FLY:
            let_go(p, x, normal)
    elif x.slipping and p.on_slip == SLIDE:
        x.slide = -across(x.force, normal, x.slide)
        x.mode = SLIDING


@kernel
def let_go(p, x, normal):
    """The corner is released: it flies, or slides where it would move into the ground."""
    acceleration = released(p, x)
    x.force = same(0.0)
    if acceleration @ normal > 0.0:
        x.mode = FLYING
        x.flown = True
    else:
        x.mode = SLIDING
        x.slide = across(acceleration, normal, x.slide)


@kernel
def keep_sliding(t, p, x, normal):
    """Direction and force of the sliding corner; it stops within the friction cone, lifts off, or jams."""
    position, velocity = contact.corner_motion(p, 0, motion_of(x))
    if velocity @ x.slide > 0.0:
        x.slide = across(velocity, normal, x.slide)
    else:
        force = standing_force(p, x)
        along, sideways = split(force, normal)
        if along > 0.0 and sideways <= p.friction * along:
            x.anchor, x.force = position, force
            x.centre, x.centre_velocity = contact.standing_at(p, x.attitude, x.rates, x.anchor)
            x.mode, x.slipping = STANDING, False
            note(p, x, along, sideways)
            return
        if along > 0.0:
            x.slide = -across(force, normal, x.slide)
    size = contact.sliding_force(p, SITE_FROM_BALANCE * x.attitude, released(p, x), normal, x.slide)
    if math.isnan(size):
        x.mode, x.outcome, x.end_time = ENDED, JAMMED, t
        return
    if size < 0.0:
        x.lift_off_time = first_time(x.lift_off_time, t)
        x.mode, x.flown = FLYING, True
        size = 0.0
    x.force = size * (normal - p.friction * x.slide)
    note(p, x, size, p.friction * size)


@kernel
def advance(t, h, p, x, normal):
    """One step of h [s] in the mode of now."""
    if x.mode == STANDING:
        x.attitude, x.rates, x.wheel_speed = dynamics.standing_step(
            (p, level_gravity(p), x.torque), t, h, (x.attitude, x.rates, x.wheel_speed))
        x.centre, x.centre_velocity = contact.standing_at(p, x.attitude, x.rates, x.anchor)
        return
    motion = contact.moving_step((p, x, normal), t, h, motion_of(x))
    x.attitude, x.rates, x.wheel_speed, x.centre, x.centre_velocity = motion
    if x.mode == SLIDING:  # what rounding and the held direction move out of the plane is put back
        position, velocity = contact.corner_motion(p, 0, motion_of(x))
        x.centre -= (position @ normal) * normal
        x.centre_velocity -= (velocity @ normal) * normal


@kernel
def touch(t, p, x, normal):
    """Whether a corner meets the ground: that decides the run."""
    first = 0 if x.mode == FLYING else 1
    for corner in range(first, 8):
        position, velocity = contact.corner_motion(p, corner, motion_of(x))
        speed = velocity @ normal
        if position @ normal < 0.0 and speed < 0.0 and x.mode != ENDED:
            x.mode, x.end_time = ENDED, t
            x.outcome = LANDED if x.flown else FELL
            x.touching_corner, x.touching_speed = corner, -speed
