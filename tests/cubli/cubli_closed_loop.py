"""Compiled closed loops of the rover for the tests: the law in continuous time, and the law sampled and held.

`gains` (12, 3): rows rho_a0, rho_a_inf, l_a, lambda_a, k_a, eta_a, rho_u0, rho_u_inf, l_u, lambda_u, k_u, eta_u; the
baselines take their two gains from the rows lambda_a and lambda_u. `METRICS` names the entries of a result. Settling
time: last |e_a| > 0.008 rad on any axis; overshoot: largest excursion of the other sign over the initial angle [%];
tail: largest |e_a| of the last sixth; contact: level ground, r = l/2 [1, 1, 1].
"""

import math

import numpy as np

from cubli_ros import appc, funnel, jump_condition
from cubli_ros.attitude import cardan_from_quaternion, gravity_torque, quaternion_from_cardan, to_body
from cubli_ros.backstepping import backstepping
from cubli_ros.pd import proportional_derivative
from flight_graph.kernel import kernel
from sim_nodes import cubli_dynamics
from sim_nodes.reaction_wheels import deliverable_torque

MASS = 2.0  # [kg]
LENGTH = 0.2  # [m]
WHEEL_INERTIA = 1.0e-3  # [kg m^2]
START = (-0.3, 0.3, 0.3)  # [rad]
PHI = 0.01  # [-] smoothing of the sign
ASTEROID = 0.002  # [m/s^2]
EARTH = 9.8  # [m/s^2]
UNLIMITED = 1e9  # [N m] or [rad/s]

APPC, PD, BACKSTEPPING = 0, 1, 2
EXPLICIT, MATCHED, IMPLICIT = 0, 1, 2

METRIC_NAMES = """
    xi_a xi_u settling overshoot tail rate_axis rate_norm rate_across torque effort effort_20 normal_min lift_first
    lift_last lift_time slip_time xi_u_start bad_samples wheel_speed over_first over_last over_time across_time
    fastest_loop
""".split()
METRICS = {name: i for i, name in enumerate(METRIC_NAMES)}


def table(*rows):
    return np.repeat(np.array(rows)[:, None], 3, 1)


TABLE_1 = table(0.5, 0.008, -2.0, 0.55, 0.01, 0.0053, 0.9, 0.08, -2.0, 0.55, 0.01, 0.0053)
TABLE_2 = table(0.4, 0.008, -0.29, 0.041, 0.01, 0.0053, 0.1, 0.005, -0.25, 0.041, 0.01, 0.005)


def slowed(gains, kappa):
    """Gains in slower time: rates scale with kappa, accelerations and adaptation with kappa^2, rho_a and k stay."""
    slow = gains.copy()
    for row in (2, 3, 6, 7, 8):
        slow[row] *= kappa
    for row in (5, 9, 11):
        slow[row] *= kappa * kappa
    return slow


@kernel
def judge(m, t, h, horizon, first, error, xi_a, xi_u, gain_u, bound_u, omega, omega_dot, gravity_body, length, u):
    for i in range(3):
        m[0] = max(m[0], abs(xi_a[i]))
        m[1] = max(m[1], abs(xi_u[i]))
        if abs(error[i]) > 0.008:
            m[2] = t
        m[3] = max(m[3], -error[i] / first[i] * 100.0)
        if t >= horizon * 5.0 / 6.0:
            m[4] = max(m[4], abs(error[i]))
        m[8] = max(m[8], abs(u[i]))
        if t == 0.0:
            m[16] = max(m[16], abs(xi_u[i]))
        square = xi_u[i] * xi_u[i]
        m[23] = max(m[23], gain_u[i] / bound_u[i] * (1.0 + square) / ((1.0 - square) * (1.0 - square)))
    outside = 0.0
    for i in range(3):
        if abs(xi_a[i]) >= 1.0 or abs(xi_u[i]) >= 1.0:
            outside = 1.0
    m[17] += outside
    g = math.sqrt(gravity_body[0] ** 2 + gravity_body[1] ** 2 + gravity_body[2] ** 2)
    norm = jump_condition.rate_norm(omega)
    across = jump_condition.rate_across_diagonal(omega)
    m[5] = max(m[5], jump_condition.largest_axis_rate(omega))
    m[6] = max(m[6], norm)
    m[7] = max(m[7], across)
    if norm > jump_condition.planar_rate_limit(g, length, 1.0):
        if m[21] == 0.0:
            m[19] = t
        m[20] = t
        m[21] += h
    if across > jump_condition.corner_rate_limit(g, length, 1.0):
        m[22] += h
    up = -gravity_body / g
    normal, _, ratio = jump_condition.contact(omega, omega_dot, gravity_body, up, length)
    m[11] = min(m[11], normal)
    if normal < 0.0:
        if m[14] == 0.0:
            m[12] = t
        m[13] = t
        m[14] += h
    if ratio > 0.6:
        m[15] += h


@kernel
def explicit(angles, omega, t, gains, v_a, v_u, phi, cap_a, cap_u, a):
    """a (12, 3): 0 e_a, 1 rho_a, 2 xi_a, 3 eps_a, 4 delta, 5 e_u, 6 rho_u, 7 xi_u, 8 eps_u, 9 demand; 10, 11 zero."""
    appc.rate_bounds(t, gains[0], gains[1], gains[2], a[1])
    appc.rate_bounds(t, gains[6], gains[7], gains[8], a[6])
    appc.attitude_loop(angles, a[10], a[11], a[1], gains[3], gains[4], v_a, phi, cap_a, a[0], a[2], a[3], a[4])
    appc.rate_loop(omega, a[4], a[6], gains[9], gains[10], v_u, phi, cap_u, a[5], a[7], a[8], a[9])


@kernel
def law(kind, t, y, gains, phi, sign, mass, length, inertia, gravity, cap, a, m_g, u, v_rate):
    """Continuous law at y (12,): torque u (3,) and the adaptive gains' rates v_rate (6,)."""
    gravity_torque(y, gravity, sign, mass, length, m_g)
    explicit(y, y[3:6], t, gains, y[6:9], y[9:12], phi, cap, cap, a)
    for i in range(3):
        v_rate[i] = gains[5, i] * abs(a[3, i])
        v_rate[3 + i] = gains[11, i] * abs(a[8, i])
    if kind == APPC:
        appc.torque_demand(inertia, a[9], m_g, 0.0, u)
    elif kind == PD:
        proportional_derivative(a[0], y[3:6], gains[3], gains[9], inertia, u)
    else:
        backstepping(y, a[0], y[3:6], gains[3, 0], gains[9, 0], inertia, m_g, u, a[4])


@kernel
def continuous(kind, y, horizon, steps, gains, phi, g, sign, mass, length, amplitude, frequency, phase, m):
    """Runge-Kutta of plant and law together, in place on y (12,) = angles, rates, v_a, v_u; metrics in m."""
    h = horizon / steps
    i0 = mass * length * length / 6.0
    inertia = i0 * np.eye(3)
    gravity = np.full(3, -g / math.sqrt(3.0))
    cap = np.ones(3)
    a = np.zeros((12, 3))
    m_g = np.zeros(3)
    u = np.zeros(3)
    d = np.zeros(3)
    g_b = np.zeros(3)
    first = y[:3].copy()
    trial = np.zeros(12)
    slope = np.zeros(12)
    total = np.zeros(12)
    power = 0.0
    m[11] = 1e9
    for step in range(steps + 1):
        t = step * h
        for stage in range(4):
            c = 0.5 * h
            if stage == 0:
                c = 0.0
            if stage == 3:
                c = h
            for i in range(12):
                trial[i] = y[i] + c * slope[i]
            law(kind, t + c, trial, gains, phi, sign, mass, length, inertia, gravity, cap, a, m_g, u, slope[6:])
            cubli_dynamics.disturbance(t + c, amplitude, frequency, phase, d)
            cubli_dynamics.paper_rates(trial, u, d, gravity, sign, mass, length, i0, slope)
            if stage == 0:
                g_b[0], g_b[1], g_b[2] = to_body(y, gravity[0], gravity[1], gravity[2])
                judge(
                    m, t, h, horizon, first, a[0], a[2], a[7], gains[9], a[6], y[3:6], slope[3:6], g_b, length, u
                )
                new_power = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
                if step > 0:
                    m[9] += 0.5 * h * (power + new_power)
                    if t <= 20.0 + 0.5 * h:
                        m[10] = m[9]
                power = new_power
            weight = 2.0
            if stage == 0 or stage == 3:
                weight = 1.0
            for i in range(12):
                if stage == 0:
                    total[i] = slope[i]
                else:
                    total[i] += weight * slope[i]
        if step < steps:
            for i in range(12):
                y[i] += h / 6.0 * total[i]


@kernel
def sampled(
    form, physical, y, horizon, steps, substeps, gains, phi, model, feed_forward, g, sign, mass, length, amplitude,
    frequency, phase, torque_limit, speed_limit, kick_time, kick, rearm, m,
):  # fmt: skip
    """Law at rate steps / horizon, torque held, v by forward Euler; y (12,) angles, rates, v_a, v_u in place; metrics
    in m.

    physical 0: paper plant; 1: physical plant with wheels. model (3, 3): the inertia the law uses. amplitude in rad/s^2
    for both (the physical plant gets I0 d). kick (3,) is added to omega at kick_time. rearm 1 widens rho_a when it is
    nearly left.
    """
    h = horizon / steps
    i0 = mass * length * length / 6.0
    gravity = np.full(3, -g / math.sqrt(3.0))
    theta = mass * length * length * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))
    inverse = np.linalg.inv(theta - WHEEL_INERTIA * np.eye(3))
    a = np.zeros((12, 3))
    cap_a = np.ones(3)
    cap_u = np.ones(3)
    m_g = np.zeros(3)
    u = np.zeros(3)
    demand = np.zeros(3)
    d = np.zeros(3)
    g_b = np.zeros(3)
    next_a = np.zeros(3)
    next_u = np.zeros(3)
    predicted = np.zeros(3)
    first = y[:3].copy()
    state = np.zeros(10)
    slope = np.zeros(10)
    work = np.zeros((4, 10))
    start_bound = gains[0].copy()
    start_time = np.zeros(3)
    v_a = y[6:9]
    v_u = y[9:12]
    quaternion_from_cardan(y, state)
    state[4:7] = y[3:6]
    kicked = False
    m[11] = 1e9
    for step in range(steps + 1):
        t = step * h
        if not kicked and t >= kick_time:
            kicked = True
            for i in range(3):
                y[3 + i] += kick[i]
                state[4 + i] += kick[i]
        if physical:
            cardan_from_quaternion(state, y)
            y[3:6] = state[4:7]
        if rearm:
            funnel.rearm(t, y[:3], gains[1], gains[2], start_bound, start_time)
        gravity_torque(y, gravity, sign, mass, length, m_g)
        appc.attitude_bounds(t, start_bound, start_time, gains[1], gains[2], a[1])
        appc.rate_bounds(t, gains[6], gains[7], gains[8], a[6])
        if form == IMPLICIT:
            if step == 0:
                explicit(y[:3], y[3:6], t, gains, v_a, v_u, phi, cap_a, cap_u, a)
            appc.normalise(y, a[10], a[1], a[0], a[2])
            appc.normalise(y[3:6], a[4], a[6], a[5], a[7])
            appc.attitude_bounds(t + h, start_bound, start_time, gains[1], gains[2], next_a)
            appc.rate_bounds(t + h, gains[6], gains[7], gains[8], next_u)
            appc.implicit_attitude_loop(
                y, y[3:6], a[10], a[11], next_a, gains[3], gains[4], v_a, h, predicted, a[3], a[4]
            )
            appc.implicit_rate_loop(y[3:6], a[4], next_u, gains[9], gains[10], v_u, h, a[8], a[9])
        else:
            if form == MATCHED:
                for i in range(3):
                    cap_a[i] = funnel.matched_cap(h, gains[3, i], a[1, i], 0.98)
                    cap_u[i] = funnel.matched_cap(h, gains[9, i], a[6, i], 0.98)
            appc.attitude_loop(y, a[10], a[11], a[1], gains[3], gains[4], v_a, phi, cap_a, a[0], a[2], a[3], a[4])
            appc.rate_loop(y[3:6], a[4], a[6], gains[9], gains[10], v_u, phi, cap_u, a[5], a[7], a[8], a[9])
        appc.torque_demand(model, a[9], m_g, feed_forward, demand)
        clipped = appc.limit_torque(demand, torque_limit, u)
        if physical:
            deliverable_torque(demand, state[7:], torque_limit, speed_limit, WHEEL_INERTIA, h, u)
        cubli_dynamics.disturbance(t, amplitude, frequency, phase, d)
        g_b[0], g_b[1], g_b[2] = to_body(y, gravity[0], gravity[1], gravity[2])
        if physical:
            for i in range(3):
                d[i] *= i0
            cubli_dynamics.physical_rates(state, u, d, gravity, mass, length, theta, inverse, WHEEL_INERTIA, slope)
            judge(m, t, h, horizon, first, a[0], a[2], a[7], gains[9], a[6], y[3:6], slope[4:7], g_b, length, u)
            for i in range(3):
                m[18] = max(m[18], abs(state[7 + i]))
        else:
            cubli_dynamics.paper_rates(y, u, d, gravity, sign, mass, length, i0, slope)
            judge(m, t, h, horizon, first, a[0], a[2], a[7], gains[9], a[6], y[3:6], slope[3:6], g_b, length, u)
        if step < steps:
            m[9] += h * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
            if t + h <= 20.0 + 0.5 * h:
                m[10] = m[9]
            if physical:
                cubli_dynamics.physical_step(
                    state, t, h, substeps, u, amplitude * i0, frequency, phase, gravity, mass, length, theta, inverse,
                    WHEEL_INERTIA, work,
                )  # fmt: skip
            else:
                cubli_dynamics.paper_step(
                    y[:6], t, h, substeps, u, amplitude, frequency, phase, gravity, sign, mass, length, i0, work
                )
            appc.adapt(h, gains[5], a[3], a[2], clipped, 1e9, v_a)
            appc.adapt(h, gains[11], a[8], a[7], clipped, 1e9, v_u)


def named(m):
    return {name: float(m[i]) for name, i in METRICS.items()}


def run_continuous(
    g, gains, horizon, step, kind=APPC, phi=PHI, sign=1.0, amplitude=0.02, frequency=1.0, phase=(0, 0, 0)
):
    """Result dictionary of the continuous loop, with the adaptive gains at the end as v_a, v_u."""
    y = np.zeros(12)
    y[:3] = START
    m = np.zeros(len(METRICS))
    d = np.full(3, float(amplitude))
    shifts = np.array(phase, dtype=float)
    steps = round(horizon / step)
    continuous(kind, y, float(horizon), steps, gains, phi, g, sign, MASS, LENGTH, d, float(frequency), shifts, m)
    return named(m) | {"v_a": y[6:9].copy(), "v_u": y[9:12].copy(), "y": y}


def run_sampled(
    g, gains, horizon, rate, form=EXPLICIT, phi=PHI, sign=1.0, amplitude=0.02, frequency=1.0, phase=(0, 0, 0),
    feed_forward=0.0, physical=0, model=None, torque_limit=UNLIMITED, speed_limit=UNLIMITED, substeps=None, start=START,
    kick_time=1e9, kick=(0.0, 0.0, 0.0), rearm=0,
):  # fmt: skip
    """Result dictionary of the sampled loop at `rate` [Hz]; the plant's step is at most 1 ms unless given."""
    y = np.zeros(12)
    y[:3] = start
    m = np.zeros(len(METRICS))
    steps = round(horizon * rate)
    if substeps is None:
        substeps = max(1, math.ceil(horizon / steps / 1e-3 - 1e-9))
    if model is None:
        model = MASS * LENGTH**2 / 6.0 * np.eye(3)
    sampled(
        form, physical, y, float(horizon), steps, substeps, gains, phi, model, feed_forward, g, sign, MASS, LENGTH,
        np.full(3, float(amplitude)), float(frequency), np.array(phase, dtype=float), torque_limit, speed_limit,
        kick_time, np.array(kick), rearm, m,
    )  # fmt: skip
    return named(m) | {"v_a": y[6:9].copy(), "v_u": y[9:12].copy(), "y": y}
