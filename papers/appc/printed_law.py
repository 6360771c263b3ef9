"""The rover and its law, integrated once more from the printed equations alone.

Source: Aerospace 2022, 9(11), 728, equations (1), (2), (4), (5), (15), (16), (42), Table 2. Nothing of the project is
used: plain numpy, the classical Runge-Kutta method in continuous time, r = +l/2 [1, 1, 1] (the standing cube), sgn
smoothed to tanh(eps / 0.01).
"""

import math
from dataclasses import dataclass

import numpy as np

MASS, LENGTH, GRAVITY = 2.0, 0.2, 0.002  # [kg], [m], [m/s^2] section 5.2
INERTIA = MASS * LENGTH * LENGTH / 6.0  # [kg m^2]
ANGLES = np.array([-0.3, 0.3, 0.3])  # [rad] section 5
DISTURBANCE = 0.02  # [rad/s^2] eq. (42), at 1 rad/s
RHO_A0, RHO_A_INF, L_A, LAMBDA_A, K_A, ETA_A = 0.4, 0.008, -0.29, 0.041, 0.01, 0.0053  # Table 2
RHO_U0, RHO_U_INF, L_U, LAMBDA_U, K_U, ETA_U = 0.1, 0.005, -0.25, 0.041, 0.01, 0.005
SMOOTHING = 0.01


@dataclass(frozen=True)
class Trajectory:
    """Columns of a run (n, 3): what eq. (2), (5), (12), (15) have at the times t (n,) [s]."""

    t: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    rates_dot: np.ndarray
    virtual: np.ndarray  # Gamma_a [rad/s]
    disturbance: np.ndarray  # [rad/s^2]


def attitude(angles) -> np.ndarray:
    """A (3, 3) of eq. (1), entry by entry as printed."""
    (s1, s2, s3), (c1, c2, c3) = np.sin(angles), np.cos(angles)
    return np.array([[c2 * c3, s1 * s2 * c3 + c1 * s3, -c1 * c3 * s2 + s1 * s3],
                     [-c2 * s3, -s1 * s2 * s3 + c1 * c3, c1 * s2 * s3 + s1 * c3],
                     [s2, -s1 * c2, c1 * c2]])


def kinematics(angles) -> np.ndarray:
    """G_a (3, 3) of eq. (2), entry by entry as printed."""
    _, theta, psi = angles
    s, c, cosine, tangent = math.sin(psi), math.cos(psi), math.cos(theta), math.tan(theta)
    return np.array([[c / cosine, -s / cosine, 0.0], [s, c, 0.0], [-c * tangent, s * tangent, 1.0]])


def moment(angles, arm=0.5 * LENGTH, gravity=GRAVITY) -> np.ndarray:
    """M_g [N m] of eq. (4) with r = arm [1, 1, 1]."""
    return np.cross(np.full(3, arm), attitude(angles) @ np.full(3, -MASS * gravity / math.sqrt(3.0)))


def transform(xi):
    """eps = xi / (1 - xi^2), after eq. (15)."""
    return xi / (1.0 - xi * xi)


def bounds(t):
    """rho_a [rad] and rho_u [rad/s] at t [s], with the time in the exponent."""
    return ((RHO_A0 - RHO_A_INF) * math.exp(L_A * t) + RHO_A_INF, (RHO_U0 - RHO_U_INF) * math.exp(L_U * t) + RHO_U_INF)


def disturbance(t) -> np.ndarray:
    """d (3,) [rad/s^2], eq. (42)."""
    return np.full(3, DISTURBANCE * math.sin(t))


def closed_loop(t, state):
    """Derivative (12,) of (angles, rates, v_a, v_u), and Gamma_a."""
    angles, rates, v_a, v_u = state.reshape(4, 3)
    rho_a, rho_u = bounds(t)
    g = kinematics(angles)
    eps_a = transform(angles / rho_a)
    virtual = -np.linalg.solve(g, LAMBDA_A * eps_a + np.tanh(eps_a / SMOOTHING) * K_A * v_a)  # (15)
    eps_u = transform((rates - virtual) / rho_u)
    torque = -INERTIA * (LAMBDA_U * eps_u + np.tanh(eps_u / SMOOTHING) * K_U * v_u)  # (16)
    rates_dot = (moment(angles) + torque) / INERTIA + disturbance(t)  # (5)
    return np.concatenate([g @ rates, rates_dot, ETA_A * np.abs(eps_a), ETA_U * np.abs(eps_u)]), virtual


def run(duration=3.0, step=2e-3, angles=ANGLES) -> Trajectory:
    """A run of duration [s] from rest at angles [rad]; it ends early where the numbers do."""
    state, rows = np.concatenate([np.array(angles, float), np.zeros(9)]), []
    with np.errstate(all="ignore"):
        for n in range(round(duration / step) + 1):
            t = n * step
            rate, virtual = closed_loop(t, state)
            if not np.isfinite(rate).all() or np.abs(state[:6]).max() > 20.0:
                break
            rows.append((t, state[:3], state[3:6], rate[3:6], virtual, disturbance(t)))
            k2 = closed_loop(t + 0.5 * step, state + 0.5 * step * rate)[0]
            k3 = closed_loop(t + 0.5 * step, state + 0.5 * step * k2)[0]
            k4 = closed_loop(t + step, state + step * k3)[0]
            state = state + step / 6.0 * (rate + 2.0 * k2 + 2.0 * k3 + k4)
    return Trajectory(*(np.array(column) for column in zip(*rows, strict=True)))
