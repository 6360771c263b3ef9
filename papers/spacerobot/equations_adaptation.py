"""Equations (42)-(45) as printed, on closed loops that learn: one function a row of the claims table.

Source: Aerospace 2023, 10(8), 679, section 3.2.2. Theta has the base's position too, so that the dynamics are linear in
pi. The arguments and answers are those of `papers.spacerobot.equations`.
"""

from dataclasses import replace

import numpy as np

from papers.spacerobot.equations import STATES, agree
from papers.spacerobot.equations_control import beside, loops, rate_of_v


def adaptive_rate(corrected: bool = False):
    """(42), (43): dV/dt with a parameter error, Y that of the reference motion.

    Corrected: error^T Lambda K_D error without the half in (42), Lambda K_D Lambda in (43)."""
    return agree(_adaptive(loop, draw, corrected, True) for loop, draw in _drawn())


def adaptive_regressor(corrected: bool = False):
    """(43): with the terms of (42) mended, Y of the actual accelerations as printed (corrected: of the reference)."""
    return agree(_adaptive(loop, draw, True, corrected) for loop, draw in _drawn())


def _drawn():
    draw = np.random.default_rng(43)
    return ((loop, draw) for loop in loops(whole=True))


def _adaptive(loop, draw, terms_corrected, reference):
    """(printed, true) rate of V with a random error of pi and any rate of it."""
    pi_error = 0.1 * loop.arm.pi * draw.standard_normal(loop.arm.pi.shape)
    pi_rate, gain = draw.standard_normal(loop.arm.pi.shape), np.exp(draw.uniform(-1.0, 1.0, loop.arm.pi.shape))
    torque = loop.reference_torque(loop.arm.pi + pi_error) + loop.damping @ loop.sigma
    second = loop.second(torque)
    product = loop.weight @ loop.damping
    share, last = (2.0 * product, product @ loop.weight) if terms_corrected else (product, product)
    if reference:
        mispredicted = loop.reference_torque(pi_error)
    else:
        mispredicted = loop.matrix(loop.q, pi_error) @ second + loop.coriolis(pi=pi_error) @ loop.rate
    adaptation = (pi_error * gain * pi_rate).sum()  # pi_error^T K_pi d pi_error/dt, in V and in (43)
    kept = loop.error_rate @ loop.damping @ loop.error_rate
    printed = -kept - loop.error @ last @ loop.error + adaptation - loop.sigma @ mispredicted
    return beside(printed, rate_of_v(loop, share, torque) + adaptation, kept)


def predicted_acceleration(rows: int = 7):
    """(43), mended, with no force on the base and the reference acceleration that makes the estimated force vanish.

    rows: in Y^T sigma, the moments' and joints' or all ten; sigma of the position is the integral of a_r - a."""
    pairs = []
    for loop, draw in _drawn():
        pi_error = 0.1 * loop.arm.pi * draw.standard_normal(loop.arm.pi.shape)
        believed = loop.arm.pi + pi_error
        second, velocity = loop.reference_second, loop.coriolis(pi=believed) @ loop.reference_rate
        matrix = loop.matrix(loop.q, believed)
        second[:3] = -np.linalg.solve(matrix[:3, :3], matrix[:3, 3:] @ second[3:] + velocity[:3])
        damping, product = loop.damping.copy(), loop.weight @ loop.damping
        damping[:3] = product[:3] = 0.0
        moved = replace(loop, desired_second=second - loop.weight @ loop.error_rate)
        torque = matrix @ second + velocity + damping @ loop.sigma
        mispredicted = moved.reference_torque(pi_error)
        kept = loop.error_rate @ damping @ loop.error_rate
        printed = -kept - loop.error @ product @ loop.weight @ loop.error - (loop.sigma * mispredicted)[-rows:].sum()
        pairs.append(beside(printed, rate_of_v(moved, 2.0 * product, torque), kept))
    return agree(pairs)


def adaptation_law(factor: float = 1.0):
    """(44) makes the last term of (43) zero, whatever K_pi, Y and sigma. factor: of K_pi^-1."""
    draw, pairs = np.random.default_rng(44), []
    for _ in range(STATES):
        spread = draw.standard_normal((50, 50))
        gain, y, sigma, error = spread @ spread.T + np.eye(50), *(draw.standard_normal(n) for n in ((7, 50), 7, 50))
        rate = factor * np.linalg.solve(gain, y.T @ sigma)
        pairs.append(beside(error @ (gain @ rate - y.T @ sigma), 0.0, abs(error) @ abs(y.T @ sigma)))
    return agree(pairs)


def adaptation_error(corrected: bool = False):
    """(45): the sum in brackets is sigma of (44), with Theta_dot as the text has it (corrected: the error's rate)."""
    return agree(((loop.error_rate if corrected else loop.rate) + loop.weight @ loop.error, loop.sigma) for loop in loops())
