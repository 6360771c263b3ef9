"""Statements of the Cubli paper's law and of its proof that are no metric of a run: printed equations, recomputed.

Source: Aerospace 2022, 9(11), 728, sections 4.1 and 4.2; checks as in `papers.appc.checks`. Equations along the motion
are compared with the differences of a run that `papers.appc.printed_law` integrates.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.integrate import trapezoid

from papers.appc import printed_law as law

SAMPLE = 100  # every so many steps of a run are compared


@lru_cache(maxsize=1)
def trajectory() -> law.Trajectory:
    """The paper's run on the asteroid, 3 s."""
    return law.run()


def compared(derivative, values) -> float:
    """Largest difference of a derivative (n, 3) from the central differences of values (n, 3) on the run."""
    step = trajectory().t[1]
    change = (values[2:] - values[:-2]) / (2.0 * step)
    return float(np.abs(derivative[1:-1] - change)[::SAMPLE].max())


def rate_funnel(time_in_exponent=False):
    """rho_u after eq. (16), (rho_0 - rho_inf) exp(l) + rho_inf t as printed, narrows over Table 2's run."""
    begin, end = ((law.RHO_U0 - law.RHO_U_INF) * math.exp(law.L_U * (t if time_in_exponent else 1.0))
                  + law.RHO_U_INF * (1.0 if time_in_exponent else t) for t in (0.0, 60.0))
    return end < begin, f"{begin:.3f} rad/s at the start, {end:.3f} rad/s at 60 s"


def error_transform(sign=-1.0):
    """eps = xi / (1 + sign xi^2) grows without bound over the funnel, -1 < xi < 1."""
    xi = np.linspace(-1.0, 1.0, 200001)[1:-1]
    epsilon = xi / (1.0 + sign * xi * xi)
    holds = bool((np.diff(epsilon) > 0.0).all() and -epsilon[0] > 1e4 and epsilon[-1] > 1e4)
    return holds, f"from {epsilon[0]:.3g} to {epsilon[-1]:.3g}; beyond the funnel its sign is the other one"


def rate_error_derivative(besides=1.0):
    """Eq. (14), e_u' = omega' - delta' + d, besides: times that d is added; omega' is that of eq. (5), which has d."""
    run = trajectory()
    virtual_dot = np.gradient(run.virtual, run.t, axis=0)
    error = compared(run.rates_dot - virtual_dot + besides * run.disturbance, run.rates - run.virtual)
    return error < 1e-4, f"off by {error:.4f} rad/s^2 at most; d is 0.02 sin t rad/s^2"


def rate_error_in_proof(unit=1.0):
    """Y_u of eq. (19), with d as an angular acceleration; unit: what d is multiplied by (1 / I0: d were a torque)."""
    run = trajectory()
    rho = np.array([law.bounds(t)[1] for t in run.t])[:, None]
    error, virtual_dot = run.rates - run.virtual, np.gradient(run.virtual, run.t, axis=0)
    undisturbed = run.rates_dot - run.disturbance  # I0^-1 (M_g + u), eq. (5)
    printed = (undisturbed - law.L_U * (rho - law.RHO_U_INF) * error / rho - virtual_dot + unit * run.disturbance) / rho
    off = compared(printed, error / rho)
    return off < 1e-2, f"off by {off:.1e} 1/s at most"


def attitude_error_in_proof(rate_error=0.0):
    """Y_a of eq. (19), (22), with G_a Gamma_a for G_a omega; rate_error: part of G_a e_u that is added."""
    run = trajectory()
    rho = np.array([law.bounds(t)[0] for t in run.t])[:, None]
    rates = run.virtual + rate_error * (run.rates - run.virtual)
    angles_dot = np.array([law.kinematics(angles) @ rate for angles, rate in zip(run.angles, rates, strict=True)])
    printed = (angles_dot - law.L_A * (rho - law.RHO_A_INF) * run.angles / rho) / rho
    off = compared(printed, run.angles / rho)
    return off < 1e-3, f"off by {off:.2g} 1/s at most"


def lower_bounds(strict=True):
    """Eq. (23): 0 < p_l <= p_a and 0 < R_l <= R_a = |rho' e| / rho^2, here over 10 s; strict: above zero, not at it."""
    run = law.run(10.0, 5e-3)
    rho = np.array([law.bounds(t)[0] for t in run.t])[:, None]
    drift = law.L_A * (rho - law.RHO_A_INF) * run.angles / rho**2
    turns = np.sign(drift[1:]) != np.sign(drift[:-1])
    first = run.t[1:][turns.any(axis=1)]
    found = f"R_a of an axis is zero at {first[0]:.2f} s, where its error changes sign" if len(first) else "R_a is not zero"
    return {"p_a": (bool((1.0 / rho).min() > 0.0), f"{(1.0 / rho).min():.3g} 1/rad at least"),
            "R_a": (len(first) == 0 or not strict, found)}


def estimate_in_proof(learning=1.0):
    """After eq. (24): v - v_hat is the constant R_h / (p_l k), v constant, so v_hat is; learning: times eta_a."""
    run = trajectory()
    rho = np.array([law.bounds(t)[0] for t in run.t])[:, None]
    most = np.abs(law.L_A * (rho - law.RHO_A_INF) * run.angles / rho**2).max()
    constant = most / ((1.0 / rho).min() * law.K_A)
    grown = learning * law.ETA_A * trapezoid(np.abs(law.transform(run.angles / rho)), run.t, axis=0).max()
    return bool(grown < 1e-9), f"it would be {constant:.1f}, and falls by {grown:.3f} within 3 s, as v_hat grows"


def lyapunov_derivative(half=0.5):
    """Eq. (21): the derivative of half ln(1 / (1 - xi^2)) is eps xi'."""
    xi, step = np.linspace(-0.95, 0.95, 39), 1e-6
    change = half * (np.log(1.0 / (1.0 - (xi + step) ** 2)) - np.log(1.0 / (1.0 - (xi - step) ** 2))) / (2.0 * step)
    error = np.abs(change - law.transform(xi)).max()
    return error < 1e-6, f"largest difference {error:.1e}"


def other_axes_derivative(dotted=False):
    """Eq. (28), (35): xi' = (e' - rho / rho e) / rho, where eq. (21) has rho' / rho; dotted: with the dot."""
    run = trajectory()
    rho = np.array([law.bounds(t)[0] for t in run.t])[:, None]
    over = law.L_A * (rho - law.RHO_A_INF) if dotted else rho
    angles_dot = np.array([law.kinematics(angles) @ rate for angles, rate in zip(run.angles, run.rates, strict=True)])
    off = compared((angles_dot - over / rho * run.angles) / rho, run.angles / rho)
    return off < 1e-3, f"off by {off:.2g} 1/s at most"


def bound_on_xi(exponent=1.0):
    """After eq. (26): |xi_a| < sqrt(1 - exp(exponent sigma)), for the start of Table 2 alone (v exact)."""
    xi = 0.75
    sigma = 0.5 * math.log(1.0 / (1.0 - xi * xi))
    square = 1.0 - math.exp(exponent * sigma)
    holds = square >= xi * xi - 1e-12
    return holds, f"sigma = {sigma:.3f}, |xi| = {xi}: the root is of {square:.4f}, and {xi * xi:.4f} is needed"


def globally(lean=1.0):
    """From (-a, a, a) at rest, a = 0.42 rad (outside rho_a0) and 0.32 rad (inside), times lean, it comes to zero."""
    found = {}
    for angle, label in ((0.42, "outside the attitude funnel"), (0.32, "inside it, outside the rate funnel")):
        run = law.run(10.0, 5e-3, lean * angle * np.array([-1.0, 1.0, 1.0]))
        held = run.t[-1] > 9.99 and np.abs(run.angles[-1]).max() < law.bounds(10.0)[0]
        found[f"{angle} rad, {label}"] = held, (f"{np.abs(run.angles[-1]).max():.2g} rad at {run.t[-1]:.3g} s; "
                                                f"|xi_u(0)| = {np.abs(run.virtual[0]).max() / law.RHO_U0:.2f}")
    return found
