"""The Cubli rover free of its corner: flying, and sliding on it.

The cube is rigid with its centre of mass at the centre, moment of inertia I = m l^2 / 6 about any axis through it
(wheels locked), and wheels of axial inertia J_w. With j = I - J_w, r = -l/2 [1, 1, 1] the arm from the centre to the
corner (body frame) and F the ground's force on that corner, Newton and Euler give

    m a = m g + F,   j omega' = u + M_d + r x F - omega x (I omega + J_w Omega),   Omega' = -u / J_w - omega',

so the corner accelerates with a_0 + W F: a_0 if nothing held it, W = (1/m + |r|^2 / j) 1 - r r^T / j. *Flying*: F = 0.
*Sliding* along the unit vector s with friction coefficient mu: F = N (n - mu s), and N keeps the corner in the plane:
N = -n.a_0 / n.W(n - mu s). The disturbance M_d is a pure torque. (Standing needs none of this: its state is about the
corner, `sim_nodes.cubli_dynamics.physical_step`; the force that holds it is m (a - g).)

State (16,): quaternion x y z w (body to balance frame), omega [rad/s], wheel speed Omega [rad/s], position [m] and
velocity [m/s] of the centre in the site frame: x east, y north, z up against gravity, origin where the corner stood
first. There g(x) = (0, 0, -g) + gradient x, and the site turns with `spin`, which gives the centre a Coriolis
acceleration (the turning of the axes themselves, milliradians in a run, is left out). `body` below is any record with
mass, length, wheel_inertia, gravity, gravity_gradient, spin and friction.
"""

import math

from cubli_ros.attitude import (
    quaternion_multiply,
    quaternion_normalise,
    quaternion_to_balance,
    quaternion_to_body,
)
from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector
from sim_nodes.cubli_dynamics import disturbance
from sim_nodes.cubli_plant import SITE_FROM_BALANCE

JAM = 1e-6  # [-] of W_nn: below it friction brakes the corner harder than it can be pressed down (Painleve)


@kernel
def local_gravity(state, body):
    """Gravity and Coriolis acceleration of the centre (three floats) [m/s^2], site frame."""
    v_x, v_y, v_z = state[13], state[14], state[15]
    s_x, s_y, s_z = body.spin[0], body.spin[1], body.spin[2]
    x, y, z = matrix_vector(body.gravity_gradient, state[10], state[11], state[12])
    return (
        x - 2.0 * (s_y * v_z - s_z * v_y),
        y - 2.0 * (s_z * v_x - s_x * v_z),
        z - 2.0 * (s_x * v_y - s_y * v_x) - body.gravity,
    )


@kernel
def free_motion(state, body, torque, disturbing, out):
    """Derivative of omega, Omega, position and velocity without a ground -> out (16,), entries 4 to 15."""
    inertia = body.mass * body.length * body.length / 6.0
    x, y, z = state[4], state[5], state[6]
    h_x, h_y, h_z = body.wheel_inertia * state[7], body.wheel_inertia * state[8], body.wheel_inertia * state[9]
    j = inertia - body.wheel_inertia
    out[4] = (torque[0] + disturbing[0] - (y * h_z - z * h_y)) / j
    out[5] = (torque[1] + disturbing[1] - (z * h_x - x * h_z)) / j
    out[6] = (torque[2] + disturbing[2] - (x * h_y - y * h_x)) / j
    for i in range(3):
        out[7 + i] = -torque[i] / body.wheel_inertia - out[4 + i]
        out[10 + i] = state[13 + i]
    out[13], out[14], out[15] = local_gravity(state, body)


@kernel
def corner_acceleration(state, rates, body, quaternion):
    """Acceleration of the corner (three floats) [m/s^2], site frame, under the derivative `rates` of `state`."""
    r = -0.5 * body.length
    x, y, z = state[4], state[5], state[6]
    v_x, v_y, v_z = r * (y - z), r * (z - x), r * (x - y)  # omega x r
    a_x, a_y, a_z = quaternion_to_balance(
        quaternion,
        r * (rates[5] - rates[6]) + y * v_z - z * v_y,
        r * (rates[6] - rates[4]) + z * v_x - x * v_z,
        r * (rates[4] - rates[5]) + x * v_y - y * v_x,
    )
    return a_x + rates[13], a_y + rates[14], a_z + rates[15]


@kernel
def push_corner(f_x, f_y, f_z, body, quaternion):
    """W f (three floats) [m/s^2]: acceleration of the corner by a force f [N] on it, both in the site frame."""
    arm = -0.5 * body.length
    r_x, r_y, r_z = quaternion_to_balance(quaternion, arm, arm, arm)
    j = body.mass * body.length * body.length / 6.0 - body.wheel_inertia
    along = (r_x * f_x + r_y * f_y + r_z * f_z) / j
    scale = 1.0 / body.mass + (r_x * r_x + r_y * r_y + r_z * r_z) / j
    return scale * f_x - along * r_x, scale * f_y - along * r_y, scale * f_z - along * r_z


@kernel
def sliding_force(state, rates, body, normal, slide, quaternion):
    """Normal force N [N] of the sliding corner; negative: it lifts off. NaN where it jams.

    rates: `free_motion`; normal n and slide s, unit vectors (3,), site frame; quaternion: body to site.
    """
    a_x, a_y, a_z = corner_acceleration(state, rates, body, quaternion)
    w_x, w_y, w_z = push_corner(normal[0] - body.friction * slide[0], normal[1] - body.friction * slide[1],
                                normal[2] - body.friction * slide[2], body, quaternion)
    give = normal[0] * w_x + normal[1] * w_y + normal[2] * w_z
    if give < JAM / body.mass:
        return math.nan
    return -(normal[0] * a_x + normal[1] * a_y + normal[2] * a_z) / give


@kernel
def moving_rates(state, body, torque, disturbing, sliding, normal, slide, quaternion, out):
    """Derivative of the whole state of the flying or sliding rover -> out (16,)."""
    x, y, z = state[4], state[5], state[6]
    out[0] = 0.5 * (state[3] * x + state[1] * z - state[2] * y)
    out[1] = 0.5 * (state[3] * y + state[2] * x - state[0] * z)
    out[2] = 0.5 * (state[3] * z + state[0] * y - state[1] * x)
    out[3] = -0.5 * (state[0] * x + state[1] * y + state[2] * z)
    free_motion(state, body, torque, disturbing, out)
    if not sliding:
        return
    quaternion_multiply(SITE_FROM_BALANCE, state, quaternion)
    force = max(0.0, sliding_force(state, out, body, normal, slide, quaternion))
    f_x = force * (normal[0] - body.friction * slide[0])
    f_y = force * (normal[1] - body.friction * slide[1])
    f_z = force * (normal[2] - body.friction * slide[2])
    b_x, b_y, b_z = quaternion_to_body(quaternion, f_x, f_y, f_z)
    factor = -0.5 * body.length / (body.mass * body.length * body.length / 6.0 - body.wheel_inertia)
    turn_x, turn_y, turn_z = factor * (b_z - b_y), factor * (b_x - b_z), factor * (b_y - b_x)
    out[4] += turn_x
    out[5] += turn_y
    out[6] += turn_z
    out[7] -= turn_x
    out[8] -= turn_y
    out[9] -= turn_z
    out[13] += f_x / body.mass
    out[14] += f_y / body.mass
    out[15] += f_z / body.mass


@kernel
def moving_step(state, time, h, body, torque, amplitude, frequency, phase, sliding, normal, slide, quaternion, work):
    """One Runge-Kutta step of h [s], in place; amplitude (3,) [N m] of the disturbing torque; work (4, 16)."""
    slope = work[0]
    total = work[1]
    trial = work[2]
    push = work[3]
    for i in range(16):
        total[i] = 0.0
        trial[i] = state[i]
    for stage in range(4):
        inner = stage == 1 or stage == 2
        part = 0.5 * h if stage < 2 else h  # to the next stage
        disturbance(time + (0.5 * h if inner else h * (stage // 3)), amplitude, frequency, phase, push)
        moving_rates(trial, body, torque, push, sliding, normal, slide, quaternion, slope)
        for i in range(16):
            total[i] += (2.0 if inner else 1.0) * slope[i]
            trial[i] = state[i] + part * slope[i]
    for i in range(16):
        state[i] += h / 6.0 * total[i]
    quaternion_normalise(state)


@kernel
def corner_motion(state, length, corner, quaternion, position, velocity):
    """Position [m] and velocity [m/s] (3,) of corner 0-7, site frame; bit i of its number: far side along axis i."""
    half = 0.5 * length
    r_x = half if corner & 1 else -half
    r_y = half if corner & 2 else -half
    r_z = half if corner & 4 else -half
    quaternion_multiply(SITE_FROM_BALANCE, state, quaternion)
    p_x, p_y, p_z = quaternion_to_balance(quaternion, r_x, r_y, r_z)
    x, y, z = state[4], state[5], state[6]
    v_x, v_y, v_z = quaternion_to_balance(quaternion, y * r_z - z * r_y, z * r_x - x * r_z, x * r_y - y * r_x)
    position[0] = state[10] + p_x
    position[1] = state[11] + p_y
    position[2] = state[12] + p_z
    velocity[0] = state[13] + v_x
    velocity[1] = state[14] + v_y
    velocity[2] = state[15] + v_z


@kernel
def stand_at(state, length, anchor, quaternion):
    """Put the centre where the corner stands at anchor (3,) [m], at rest: position and velocity of the state."""
    half = 0.5 * length
    quaternion_multiply(SITE_FROM_BALANCE, state, quaternion)
    x, y, z = state[4], state[5], state[6]
    p_x, p_y, p_z = quaternion_to_balance(quaternion, half, half, half)
    v_x, v_y, v_z = quaternion_to_balance(quaternion, half * (y - z), half * (z - x), half * (x - y))
    state[10] = anchor[0] + p_x
    state[11] = anchor[1] + p_y
    state[12] = anchor[2] + p_z
    state[13] = v_x
    state[14] = v_y
    state[15] = v_z
