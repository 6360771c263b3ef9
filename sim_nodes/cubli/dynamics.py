"""Motion of the Cubli rover about the corner it stands on: the paper's model and a physical one.

Source: Aerospace 2022, 9(11), 728, equations (1)-(5), (42). Frames as in `cubli_ros.attitude`.

*Paper model*: Cardan angles and body rates, scalar inertia I0 = m l^2 / 6, no gyroscopic terms, no wheel momentum:

    angles' = G omega,   omega' = (M_g + u) / I0 + d,   d_i = amplitude_i sin(frequency t + phase_i) [rad/s^2].

*Physical model*: attitude q, omega, wheel speed Omega; inertia Theta = m l^2 (11/12 1 - 1/4 [1 1 1]^T [1 1 1]) about the
corner with the wheels locked, wheels of axial inertia J_w:

    (Theta - J_w 1) omega' = M_g + u + M_d - omega x (Theta omega + J_w Omega),   Omega' = -u / J_w - omega'.

*An inertia of the user's own* (p.body_inertia, a full matrix, wheels included): J. In the paper's model J stands for I0,
and the gyroscopic moment that a scalar has not comes in: J omega' = M_g + u - omega x (J omega) + J d. In the physical
model it is the inertia about the centre, so Theta = J + m l^2 (3/4 1 - 1/4 [1 1 1]^T [1 1 1]).

In both the torque u is held over the step and the integrator is the classical Runge-Kutta of fourth order. p: parameters
of `sim_nodes.cubli.plant` and `sim_nodes.cubli.physical_plant`.
"""

from cubli_ros.attitude import cardan_rates, gravity_torque, to_body
from flight_math import (
    cross,
    diagonal,
    from_rows,
    inverse,
    kernel,
    normalised,
    quaternion_rates,
    rk4_between,
    rotate_back,
    same,
    sin,
    sincos,
    total,
    where,
)


@kernel
def disturbance(p, t):
    """Eq. (42), d [rad/s^2] at t [s]."""
    amplitude = p.disturbance_amplitude
    return where(amplitude == 0.0, 0.0, amplitude * sin(p.disturbance_frequency * t + p.disturbance_phase))


@kernel
def centre_inertia(p):
    """I0 = m l^2 / 6 [kg m^2], a solid cube about its centre, which the paper uses about the corner."""
    return p.mass * p.length * p.length / 6.0


@kernel
def has_own_inertia(p):
    """Whether the body has an inertia of the user's own; else it is a solid cube."""
    return p.body_inertia[0, 0] > 0.0


@kernel
def centre_momentum(p, omega):
    """I omega [N m s] about the centre, wheels locked; of an acceleration the moment [N m]."""
    if has_own_inertia(p):
        return p.body_inertia @ omega
    return centre_inertia(p) * omega


# -- the paper's model -------------------------------------------------------------------------------------------------
@kernel
def paper_acceleration(p, gravity, torque, disturbing):
    """Eq. (5), omega' [rad/s^2]; gravity [m/s^2] in the body frame, torque u [N m], disturbing d [rad/s^2]."""
    return (gravity_torque(p, gravity) + torque) / centre_inertia(p) + disturbing


@kernel
def body_acceleration(p, gravity, omega, torque, disturbing):
    """As `paper_acceleration`; of a body with an inertia of its own with its gyroscopic moment. omega [rad/s]."""
    if has_own_inertia(p):
        moment = gravity_torque(p, gravity) + torque - cross(omega, p.body_inertia @ omega)
        return inverse(p.body_inertia) @ moment + disturbing
    return paper_acceleration(p, gravity, torque, disturbing)


@kernel
def paper_rates(held, disturbing, motion):
    """Right-hand side of (2) and (5): angles' and omega' of motion = (angles, omega).

    held: p, gravity [m/s^2] in the balance frame, torque u [N m]; disturbing: d [rad/s^2].
    """
    p, gravity, torque = held
    angles, omega = motion
    turn = sincos(angles)
    return cardan_rates(turn, omega), body_acceleration(p, to_body(turn, gravity), omega, torque, disturbing)


@kernel
def paper_step(held, begin, t, h, motion):
    """Motion and disturbance one step of h [s] after t [s], where the disturbance is ``begin`` [rad/s^2]."""
    middle, end = disturbance(held[0], t + 0.5 * h), disturbance(held[0], t + h)
    return rk4_between(paper_rates, held, (begin, middle, end), motion, h), end


# -- the physical model ------------------------------------------------------------------------------------------------
@kernel
def corner_momentum(p, omega):
    """Theta omega [N m s]."""
    if has_own_inertia(p):
        return p.body_inertia @ omega + p.mass * p.length * p.length * (0.75 * omega - 0.25 * total(omega))
    return p.mass * p.length * p.length * (11.0 / 12.0 * omega - 0.25 * total(omega))


@kernel
def standing_acceleration(p, moment):
    """(Theta - J_w 1)^-1 moment [rad/s^2], after Sherman and Morrison.

    The inertia is 11/12 m l^2 - J_w across the body diagonal, m l^2 / 6 - J_w along it.
    """
    if has_own_inertia(p):
        square = p.mass * p.length * p.length
        ones = from_rows(same(square), same(square), same(square))
        return inverse(p.body_inertia + diagonal(same(0.75 * square - p.wheel_inertia)) - 0.25 * ones) @ moment
    across = 11.0 / 12.0 * p.mass * p.length * p.length - p.wheel_inertia
    along = centre_inertia(p) - p.wheel_inertia
    return (moment + 0.25 * p.mass * p.length * p.length / along * total(moment)) / across


@kernel
def standing_rates(held, push, motion):
    """q', omega' and Omega' of motion = (q, omega, Omega).

    held: p, gravity [m/s^2] in the balance frame, any direction, torque u [N m]; push: disturbing torque M_d [N m].
    """
    p, gravity, torque = held
    attitude, omega, wheel_speed = motion
    weight = cross(same(0.5 * p.length), p.mass * rotate_back(attitude, gravity))  # (4)
    momentum = corner_momentum(p, omega) + p.wheel_inertia * wheel_speed
    omega_dot = standing_acceleration(p, weight + torque + push - cross(omega, momentum))
    return quaternion_rates(attitude, omega), omega_dot, -torque / p.wheel_inertia - omega_dot


@kernel
def pushes(p, t, h):
    """Disturbing torques M_d = I d [N m] at the begin, the middle and the end of a step of h [s] after t [s]."""
    middle, end = disturbance(p, t + 0.5 * h), disturbance(p, t + h)
    return centre_momentum(p, disturbance(p, t)), centre_momentum(p, middle), centre_momentum(p, end)


@kernel
def standing_step(held, t, h, motion):
    """Motion one step of h [s] after t [s]; the quaternion is normalised."""
    attitude, omega, wheel_speed = rk4_between(standing_rates, held, pushes(held[0], t, h), motion, h)
    return normalised(attitude), omega, wheel_speed
