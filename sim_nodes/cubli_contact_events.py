"""What the contact of the Cubli rover does at each step: stand, slide, fly, land, fall.

Kernels over the parameters p and the state x of `sim_nodes.cubli_physical_plant`; the events are described there, the
equations of motion in `sim_nodes.cubli_contact`. Vectors without a note are in the site frame.
"""

import math

from cubli_ros import jump_condition
from cubli_ros.attitude import quaternion_multiply, quaternion_to_balance
from flight_graph.kernel import kernel
from sim_nodes import cubli_contact, cubli_dynamics
from sim_nodes.cubli_plant import SITE_FROM_BALANCE

STANDING, SLIDING, FLYING, ENDED = 0, 1, 2, 3  # modes
FLY, SLIDE = 0, 1  # choices of on_lift_off and on_slip
LANDED, FELL, JAMMED = 1, 2, 3  # outcomes
LOST = jump_condition.LOST_CONTACT_RATIO


@kernel
def standing_force(p, x):
    """Force F = m (a - g) that holds the standing corner -> x.force, and (normal, tangential) [N]."""
    cubli_dynamics.physical_rates(x.motion, x.torque, x.push, x.gravity, p.mass, p.length, x.theta, x.inverse,
                                  p.wheel_inertia, x.rates)
    for i in range(3):
        x.accelerations[i] = x.rates[4 + i]
    quaternion_multiply(SITE_FROM_BALANCE, x.motion, x.quaternion)
    a_x, a_y, a_z = jump_condition.centre_acceleration(x.motion[4:7], x.accelerations, p.length)
    x.force[0], x.force[1], x.force[2] = quaternion_to_balance(x.quaternion, a_x, a_y, a_z)
    x.force[2] += p.gravity
    for i in range(3):
        x.force[i] *= p.mass
    return split(x.force, x.normal)


@kernel
def split(force, normal):
    """Parts of a force (3,) along the normal (3,) and across it: two floats."""
    along = force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]
    square = 0.0
    for i in range(3):
        square += (force[i] - along * normal[i]) * (force[i] - along * normal[i])
    return along, math.sqrt(square)


@kernel
def across(vector, normal, out):
    """Unit vector of the part of vector (3,) across the normal -> out (3,), kept at length 0; returns that length."""
    along = vector[0] * normal[0] + vector[1] * normal[1] + vector[2] * normal[2]
    _, size = split(vector, normal)
    if size > 0.0:
        for i in range(3):
            out[i] = (vector[i] - along * normal[i]) / size
    return size


@kernel
def events(t, p, x):
    """What the contact does from now on, t [s]; force and extremes into the state."""
    cubli_dynamics.disturbance(t, x.push_amplitude, p.disturbance_frequency, p.disturbance_phase, x.push)
    if x.mode == STANDING:
        along, sideways = standing_force(p, x)
        note(p, x, along, sideways)
        x.slipping = sideways > p.friction * along
        if x.slipping and x.slip_time < 0.0:
            x.slip_time = t
        if along < 0.0:
            if x.lift_off_time < 0.0:
                x.lift_off_time = t
            if p.on_lift_off == FLY:
                let_go(p, x)
        elif x.slipping and p.on_slip == SLIDE:
            across(x.force, x.normal, x.slide)
            for i in range(3):
                x.slide[i] = -x.slide[i]
            x.mode = SLIDING
    elif x.mode == SLIDING:
        keep_sliding(t, p, x)
    elif x.mode == FLYING:
        cubli_contact.free_motion(x.motion, p, x.torque, x.push, x.rates)
        note(p, x, 0.0, 0.0)
    if x.mode != STANDING:
        for i in range(3):
            x.accelerations[i] = x.rates[4 + i]


@kernel
def note(p, x, along, sideways):
    """Extremes since the last message."""
    weight = p.mass * p.gravity
    x.normal_force = min(x.normal_force, along / weight)
    ratio = LOST
    if sideways < LOST * along:
        ratio = sideways / along
    x.friction_ratio = max(x.friction_ratio, ratio)


@kernel
def let_go(p, x):
    """The corner is released: it flies, or slides where it would move into the ground."""
    cubli_contact.free_motion(x.motion, p, x.torque, x.push, x.rates)
    x.velocity[0], x.velocity[1], x.velocity[2] = cubli_contact.corner_acceleration(x.motion, x.rates, p, x.quaternion)
    along, _ = split(x.velocity, x.normal)
    for i in range(3):
        x.force[i] = 0.0
    if along > 0.0:
        x.mode = FLYING
        x.flown = True
    else:
        x.mode = SLIDING
        across(x.velocity, x.normal, x.slide)


@kernel
def keep_sliding(t, p, x):
    """Direction and force of the sliding corner; it stops within the friction cone, lifts off, or jams."""
    cubli_contact.corner_motion(x.motion, p.length, 0, x.quaternion, x.position, x.velocity)
    ahead = x.velocity[0] * x.slide[0] + x.velocity[1] * x.slide[1] + x.velocity[2] * x.slide[2]
    if ahead > 0.0:
        across(x.velocity, x.normal, x.slide)
    else:
        along, sideways = standing_force(p, x)
        if along > 0.0 and sideways <= p.friction * along:
            for i in range(3):
                x.anchor[i] = x.position[i]
            cubli_contact.stand_at(x.motion, p.length, x.anchor, x.quaternion)
            x.mode = STANDING
            x.slipping = False
            note(p, x, along, sideways)
            return
        if along > 0.0:
            across(x.force, x.normal, x.slide)
            for i in range(3):
                x.slide[i] = -x.slide[i]
    cubli_contact.free_motion(x.motion, p, x.torque, x.push, x.rates)
    force = cubli_contact.sliding_force(x.motion, x.rates, p, x.normal, x.slide, x.quaternion)
    if math.isnan(force):
        x.outcome = JAMMED
        x.end_time = t
        x.mode = ENDED
        return
    if force < 0.0:
        if x.lift_off_time < 0.0:
            x.lift_off_time = t
        x.mode = FLYING
        x.flown = True
        force = 0.0
    for i in range(3):
        x.force[i] = force * (x.normal[i] - p.friction * x.slide[i])
    note(p, x, force, p.friction * force)


@kernel
def advance(t, h, p, x):
    """One step of h [s] in the mode of now."""
    if x.mode == STANDING:
        cubli_dynamics.physical_step(
            x.motion, t, h, 1, x.torque, x.push_amplitude, p.disturbance_frequency, p.disturbance_phase, x.gravity,
            p.mass, p.length, x.theta, x.inverse, p.wheel_inertia, x.work)
        cubli_contact.stand_at(x.motion, p.length, x.anchor, x.quaternion)
        return
    cubli_contact.moving_step(
        x.motion, t, h, p, x.torque, x.push_amplitude, p.disturbance_frequency, p.disturbance_phase, x.mode == SLIDING,
        x.normal, x.slide, x.quaternion, x.work)
    if x.mode == SLIDING:  # what rounding and the held direction move out of the plane is put back
        cubli_contact.corner_motion(x.motion, p.length, 0, x.quaternion, x.position, x.velocity)
        height, _ = split(x.position, x.normal)
        speed, _ = split(x.velocity, x.normal)
        for i in range(3):
            x.motion[10 + i] -= height * x.normal[i]
            x.motion[13 + i] -= speed * x.normal[i]


@kernel
def touch(t, p, x):
    """Whether a corner meets the ground: that decides the run."""
    first = 0 if x.mode == FLYING else 1
    for corner in range(first, 8):
        cubli_contact.corner_motion(x.motion, p.length, corner, x.quaternion, x.position, x.velocity)
        height, _ = split(x.position, x.normal)
        speed, _ = split(x.velocity, x.normal)
        if height < 0.0 and speed < 0.0 and x.mode != ENDED:
            x.mode = ENDED
            x.outcome = LANDED if x.flown else FELL
            x.end_time = t
            x.touching_corner = corner
            x.touching_speed = -speed
