"""Motion of the Cubli rover about the corner it stands on: the paper's model and a physical one.

Source: Aerospace 2022, 9(11), 728, equations (1)-(5), (42). Frames as in `cubli_ros.attitude`.

*Paper model*: state (phi, theta, psi, omega) (6,), scalar inertia I0 = m l^2 / 6, no gyroscopic terms, no wheel
momentum:

    angles' = G omega,   omega' = (M_g + u) / I0 + d,   d_i = amplitude_i sin(frequency t + phase_i) [rad/s^2].

*Physical model*: state (quaternion x y z w, omega, wheel speed Omega) (10,), inertia Theta about the corner with the
wheels locked, wheels of axial inertia J_w:

    (Theta - J_w 1) omega' = M_g + u + M_d - omega x (Theta omega + J_w Omega),   Omega' = -u / J_w - omega'.

In both the torque u is held over the step and the integrator is the classical Runge-Kutta of fourth order.
"""

import math

import numpy as np

from cubli_ros.attitude import (
    cardan_rates,
    diagonal_torque,
    quaternion_normalise,
    quaternion_to_body,
    to_body,
)
from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector


def level_gravity(gravity: float) -> np.ndarray:
    """Gravity vector (3,) [m/s^2] in the balance frame on level ground: -g / sqrt(3) [1, 1, 1], eq. (4)."""
    return np.full(3, -gravity / math.sqrt(3.0))


def paper_inertia(mass: float, length: float) -> float:
    """I0 = m l^2 / 6 [kg m^2], a solid cube about its centre, which the paper uses about the corner."""
    return mass * length * length / 6.0


def corner_inertia(mass: float, length: float) -> np.ndarray:
    """Theta (3, 3) [kg m^2] of a solid cube about its corner: m l^2 (11/12 1 - 1/4 [1 1 1]^T [1 1 1])."""
    return mass * length * length * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))


@kernel
def disturbance(time, amplitude, frequency, phase, out):
    """Eq. (42), amplitude_i sin(frequency t + phase_i) -> out (3,), the amplitude's unit; [s], [rad/s], [rad]."""
    for i in range(3):
        if amplitude[i] == 0.0:
            out[i] = 0.0
        elif i > 0 and amplitude[i] == amplitude[0] and phase[i] == phase[0]:
            out[i] = out[0]
        else:
            out[i] = amplitude[i] * math.sin(frequency * time + phase[i])


@kernel
def paper_rates(state, torque, disturbing, gravity, sign, mass, length, inertia, out):
    """Right-hand side of (2) and (5) -> out (6,).

    state (6,) [rad, rad/s]; torque u (3,) [N m]; disturbing d (3,) [rad/s^2]; gravity (3,) [m/s^2], balance frame;
    sign +1 inverted pendulum, -1 as printed; inertia I0 [kg m^2].
    """
    x, y, z = to_body(state, gravity[0], gravity[1], gravity[2])
    m_x, m_y, m_z = diagonal_torque(sign, mass, length, x, y, z)
    out[0], out[1], out[2] = cardan_rates(state, state[3], state[4], state[5])
    out[3] = (m_x + torque[0]) / inertia + disturbing[0]
    out[4] = (m_y + torque[1]) / inertia + disturbing[1]
    out[5] = (m_z + torque[2]) / inertia + disturbing[2]


@kernel
def paper_step(
    state, time, period, substeps, torque, amplitude, frequency, phase, gravity, sign, mass, length, inertia, work
):
    """Advance state (6,) in place from time over period [s] in `substeps` steps, torque held; work (4, 6)."""
    h = period / substeps
    slope = work[0]
    total = work[1]
    trial = work[2]
    disturbing = work[3]
    disturbance(time, amplitude, frequency, phase, disturbing)
    for step in range(substeps):
        t = time + step * h
        paper_rates(state, torque, disturbing, gravity, sign, mass, length, inertia, slope)
        for i in range(6):
            total[i] = slope[i]
            trial[i] = state[i] + 0.5 * h * slope[i]
        disturbance(t + 0.5 * h, amplitude, frequency, phase, disturbing)
        paper_rates(trial, torque, disturbing, gravity, sign, mass, length, inertia, slope)
        for i in range(6):
            total[i] += 2.0 * slope[i]
            trial[i] = state[i] + 0.5 * h * slope[i]
        paper_rates(trial, torque, disturbing, gravity, sign, mass, length, inertia, slope)
        for i in range(6):
            total[i] += 2.0 * slope[i]
            trial[i] = state[i] + h * slope[i]
        disturbance(t + h, amplitude, frequency, phase, disturbing)
        paper_rates(trial, torque, disturbing, gravity, sign, mass, length, inertia, slope)
        for i in range(6):
            state[i] += h / 6.0 * (total[i] + slope[i])


@kernel
def physical_rates(
    state, torque, disturbing, gravity, mass, length, corner_inertia, body_inertia_inverse, wheel_inertia, out
):
    """Right-hand side of the physical model -> out (10,).

    state (10,); torque u (3,) [N m]; disturbing torque M_d (3,) [N m]; gravity (3,) [m/s^2], balance frame, any
    direction; corner_inertia Theta (3, 3) and body_inertia_inverse (Theta - J_w 1)^-1 (3, 3); wheel_inertia J_w [kg
    m^2].
    """
    x = state[4]
    y = state[5]
    z = state[6]
    out[0] = 0.5 * (state[3] * x + state[1] * z - state[2] * y)
    out[1] = 0.5 * (state[3] * y + state[2] * x - state[0] * z)
    out[2] = 0.5 * (state[3] * z + state[0] * y - state[1] * x)
    out[3] = -0.5 * (state[0] * x + state[1] * y + state[2] * z)
    h_x, h_y, h_z = matrix_vector(corner_inertia, x, y, z)
    h_x += wheel_inertia * state[7]
    h_y += wheel_inertia * state[8]
    h_z += wheel_inertia * state[9]
    g_x, g_y, g_z = quaternion_to_body(state, gravity[0], gravity[1], gravity[2])
    m_x, m_y, m_z = diagonal_torque(1.0, mass, length, g_x, g_y, g_z)
    out[4], out[5], out[6] = matrix_vector(
        body_inertia_inverse,
        m_x + torque[0] + disturbing[0] - (y * h_z - z * h_y),
        m_y + torque[1] + disturbing[1] - (z * h_x - x * h_z),
        m_z + torque[2] + disturbing[2] - (x * h_y - y * h_x),
    )
    for i in range(3):
        out[7 + i] = -torque[i] / wheel_inertia - out[4 + i]


@kernel
def physical_step(
    state,
    time,
    period,
    substeps,
    torque,
    amplitude,
    frequency,
    phase,
    gravity,
    mass,
    length,
    corner_inertia,
    body_inertia_inverse,
    wheel_inertia,
    work,
):
    """Advance state (10,) in place over period [s] in `substeps` Runge-Kutta steps, torque held; work (4, 10).

    The disturbance is a torque here: amplitude (3,) [N m]. The quaternion is normalised after every substep.
    """
    h = period / substeps
    slope = work[0]
    total = work[1]
    trial = work[2]
    push = work[3]
    theta = corner_inertia
    inverse = body_inertia_inverse
    for step in range(substeps):
        t = time + step * h
        disturbance(t, amplitude, frequency, phase, push)
        physical_rates(state, torque, push, gravity, mass, length, theta, inverse, wheel_inertia, slope)
        for i in range(10):
            total[i] = slope[i]
            trial[i] = state[i] + 0.5 * h * slope[i]
        disturbance(t + 0.5 * h, amplitude, frequency, phase, push)
        physical_rates(trial, torque, push, gravity, mass, length, theta, inverse, wheel_inertia, slope)
        for i in range(10):
            total[i] += 2.0 * slope[i]
            trial[i] = state[i] + 0.5 * h * slope[i]
        physical_rates(trial, torque, push, gravity, mass, length, theta, inverse, wheel_inertia, slope)
        for i in range(10):
            total[i] += 2.0 * slope[i]
            trial[i] = state[i] + h * slope[i]
        disturbance(t + h, amplitude, frequency, phase, push)
        physical_rates(trial, torque, push, gravity, mass, length, theta, inverse, wheel_inertia, slope)
        for i in range(10):
            state[i] += h / 6.0 * (total[i] + slope[i])
        quaternion_normalise(state)
