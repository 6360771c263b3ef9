"""Compiled closed loops of the rover for the tests: the law in continuous time, and the law sampled and held.

`gains` (12, 3): rows rho_a0, rho_a_inf, l_a, lambda_a, k_a, eta_a, rho_u0, rho_u_inf, l_u, lambda_u, k_u, eta_u; the
baselines take their two gains from the rows lambda_a and lambda_u. `METRICS` names the entries of a result. Settling
time: last |e_a| > 0.008 rad on any axis; overshoot: largest excursion of the other sign over the initial angle [%];
tail: largest |e_a| of the last sixth; contact: level ground, r = l/2 [1, 1, 1].
"""

import math

import numpy as np

from cubli_ros import appc, jump_condition
from cubli_ros.appc_controller import AppcParameters, AppcState
from cubli_ros.attitude import (
    body_rates,
    cardan_from_quaternion,
    gravity_torque,
    level_gravity,
    quaternion_from_cardan,
    to_body,
)
from cubli_ros.backstepping import backstepping
from cubli_ros.funnel import attitude_bound, capped_error, matched_cap, rate_bound, rearm, switching_sign
from cubli_ros.pd import proportional_derivative
from cubli_ros.sampled_appc import sampled_law
from flight_math import Vec3, clip, kernel, largest, norm, rk4, same, sincos
from sim_nodes.cubli import dynamics
from sim_nodes.cubli.plant import CubliPlantParameters
from sim_nodes.cubli.reaction_wheels import deliverable_torque
from tests.cubli.records import made

MASS = 2.0  # [kg]
LENGTH = 0.2  # [m]
WHEEL_INERTIA = 1.0e-3  # [kg m^2] the plant's default
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
GAINS = "rho_a0 rho_a_inf l_a lambda_a k_a eta_a rho_u0 rho_u_inf l_u lambda_u k_u eta_u".split()
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
def judge(m, p, t, horizon, sample):
    """Metrics m of one sample: see `METRIC_NAMES`."""
    h, first, angles, omega, omega_dot, gravity, xi_a, xi_u, rho_u, u = sample
    m[0] = max(m[0], largest(abs(xi_a)))
    m[1] = max(m[1], largest(abs(xi_u)))
    if any(abs(angles) > 0.008):
        m[2] = t
    m[3] = max(m[3], largest(-angles / first) * 100.0)
    if t >= horizon * 5.0 / 6.0:
        m[4] = max(m[4], largest(abs(angles)))
    m[8] = max(m[8], largest(abs(u)))
    if t == 0.0:
        m[16] = largest(abs(xi_u))
    square = xi_u * xi_u
    m[23] = max(m[23], largest(p.lambda_u / rho_u * (1.0 + square) / ((1.0 - square) * (1.0 - square))))
    if any(abs(xi_a) >= 1.0) or any(abs(xi_u) >= 1.0):
        m[17] += 1.0
    across = jump_condition.rate_across_diagonal(omega)
    m[5] = max(m[5], largest(abs(omega)))
    m[6] = max(m[6], norm(omega))
    m[7] = max(m[7], across)
    if norm(omega) > jump_condition.planar_rate_limit(p.gravity, p.length, 1.0):
        if m[21] == 0.0:
            m[19] = t
        m[20] = t
        m[21] += h
    if across > jump_condition.corner_rate_limit(p.gravity, p.length, 1.0):
        m[22] += h
    normal, _, ratio = jump_condition.contact(omega, omega_dot, gravity, -gravity / p.gravity, p.length)
    m[11] = min(m[11], normal)
    if normal < 0.0:
        if m[14] == 0.0:
            m[12] = t
        m[13] = t
        m[14] += h
    if ratio > 0.6:
        m[15] += h


@kernel
def explicit(p, x, t, turn, angles, omega):
    """The printed law: xi_a, eps_a, rho_u, xi_u, eps_u, acceleration; the virtual rate into x."""
    xi_a = angles / attitude_bound(p, x, t)
    epsilon_a, x.virtual_rate = appc.attitude_loop(p, x, turn, xi_a, same(0.0))
    rho_u = rate_bound(p, t)
    xi_u = (omega - x.virtual_rate) / rho_u
    epsilon_u, acceleration = appc.rate_loop(p, x, xi_u)
    return xi_a, epsilon_a, rho_u, xi_u, epsilon_u, acceleration


@kernel
def law(kind, p, x, t, motion):
    """Torque u, gravity in the body frame, |eps_a|, |eps_u|, xi_a, xi_u and rho_u of the continuous law."""
    angles, omega, x.adaptive_a, x.adaptive_u = motion
    turn = sincos(angles)
    gravity = to_body(turn, level_gravity(p))
    moment = gravity_torque(p, gravity)
    xi_a, epsilon_a, rho_u, xi_u, epsilon_u, acceleration = explicit(p, x, t, turn, angles, omega)
    u = appc.torque_demand(p, acceleration, moment)
    if kind == PD:
        u = p.inertia @ proportional_derivative(p, angles, omega)
    elif kind == BACKSTEPPING:
        u = p.inertia @ backstepping(p, turn, angles, omega)[1] - moment
    return u, gravity, abs(epsilon_a), abs(epsilon_u), xi_a, xi_u, rho_u


@kernel
def rates(given, t, motion):
    """Rates of (angles, omega, v_a, v_u) under the continuous law."""
    kind, p, x = given
    u, _, epsilon_a, epsilon_u, _, _, _ = law(kind, p, x, t, motion)
    angles_dot, omega_dot = dynamics.paper_rates(
        (p, level_gravity(p), u), dynamics.disturbance(p, t), (motion[0], motion[1]))
    return angles_dot, omega_dot, p.eta_a * epsilon_a, p.eta_u * epsilon_u


@kernel
def continuous(kind, p, x, horizon, steps, m):
    """Runge-Kutta of plant and law together; the last (angles, omega, v_a, v_u); metrics in m."""
    h = horizon / steps
    motion = (p.initial_angles, p.initial_rates, same(0.0), same(0.0))
    power = 0.0
    m[11] = 1e9
    for step in range(steps + 1):
        t = step * h
        u, gravity, _, _, xi_a, xi_u, rho_u = law(kind, p, x, t, motion)
        omega_dot = dynamics.paper_acceleration(p, gravity, u, dynamics.disturbance(p, t))
        judge(m, p, t, horizon, (
            h, p.initial_angles, motion[0], motion[1], omega_dot, gravity, xi_a, xi_u, rho_u, u))
        if step > 0:
            m[9] += 0.5 * h * (power + u @ u)
            if t <= 20.0 + 0.5 * h:
                m[10] = m[9]
        power = u @ u
        if step < steps:
            motion = rk4(rates, (kind, p, x), t, motion, h)
    return motion


@kernel
def matched(p, x, t, turn, angles, omega):
    """The printed law with the error transform continued linearly where the sampled loop would be too stiff."""
    rho_a, rho_u = attitude_bound(p, x, t), rate_bound(p, t)
    xi_a = angles / rho_a
    epsilon_a = capped_error(xi_a, matched_cap(p.period, p.lambda_a, rho_a, 0.98))
    feedback = p.lambda_a * epsilon_a + switching_sign(epsilon_a, p.smoothing) * p.k_a * x.adaptive_a
    x.virtual_rate = body_rates(turn, -feedback)
    xi_u = (omega - x.virtual_rate) / rho_u
    epsilon_u = capped_error(xi_u, matched_cap(p.period, p.lambda_u, rho_u, 0.98))
    feedback = p.lambda_u * epsilon_u + switching_sign(epsilon_u, p.smoothing) * p.k_u * x.adaptive_u
    return xi_a, epsilon_a, rho_u, xi_u, epsilon_u, -feedback


@kernel
def sampled_forms(form, p, x, t, turn, angles, omega):
    """What `explicit` gives, of each form of the law."""
    if form == EXPLICIT:
        return explicit(p, x, t, turn, angles, omega)
    if form == MATCHED:
        return matched(p, x, t, turn, angles, omega)
    if not x.begun:
        explicit(p, x, t, turn, angles, omega)
        x.begun = True
    xi_a, rho_u = angles / attitude_bound(p, x, t), rate_bound(p, t)
    xi_u = (omega - x.virtual_rate) / rho_u
    epsilon_a, epsilon_u, acceleration = sampled_law(p, x, t, angles, turn, omega)
    return xi_a, epsilon_a, rho_u, xi_u, epsilon_u, acceleration


@kernel
def paper_period(held, t, h, substeps, angles, omega):
    """The paper's plant one period on."""
    begin, motion = dynamics.disturbance(held[0], t), (angles, omega)
    for k in range(substeps):
        motion, begin = dynamics.paper_step(held, begin, t + k * h, h, motion)
    return motion


@kernel
def standing_period(held, t, h, substeps, motion):
    """The physical plant one period on."""
    for k in range(substeps):
        motion = dynamics.standing_step(held, t + k * h, h, motion)
    return motion


@kernel
def sampled(form, physical, p, x, run, m):
    """Law at rate steps / horizon, torque held, v by forward Euler; the last angles; metrics in m.

    physical 0: paper plant; 1: physical plant with wheels (it gets I0 d). run: horizon, steps, substeps, kick_time, kick
    (added to omega at kick_time), rearm (1: widen rho_a when it is nearly left).
    """
    horizon, steps, substeps, kick_time, kick, rearming = run
    h = horizon / steps
    angles, omega, attitude, wheel_speed = p.initial_angles, p.initial_rates, quaternion_from_cardan(p.initial_angles), same(0.0)
    kicked = False
    m[11] = 1e9
    for step in range(steps + 1):
        t = step * h
        if not kicked and t >= kick_time:
            kicked = True
            omega += kick
        if physical:
            angles = cardan_from_quaternion(attitude)
        if rearming:
            rearm(p, x, t, angles)
        turn = sincos(angles)
        gravity = to_body(turn, level_gravity(p))
        xi_a, epsilon_a, rho_u, xi_u, epsilon_u, acceleration = sampled_forms(form, p, x, t, turn, angles, omega)
        demand = appc.torque_demand(p, acceleration, gravity_torque(p, gravity))
        u = clip(demand, -p.torque_limit, p.torque_limit)
        clipped = any(u != demand)
        disturbing = dynamics.disturbance(p, t)
        omega_dot = dynamics.paper_acceleration(p, gravity, u, disturbing)
        if physical:
            u = deliverable_torque(p, demand, wheel_speed)
            push = dynamics.centre_inertia(p) * disturbing
            _, omega_dot, _ = dynamics.standing_rates((p, level_gravity(p), u), push, (attitude, omega, wheel_speed))
            m[18] = max(m[18], largest(abs(wheel_speed)))
        judge(m, p, t, horizon, (h, p.initial_angles, angles, omega, omega_dot, gravity, xi_a, xi_u, rho_u, u))
        if step < steps:
            m[9] += h * (u @ u)
            if t + h <= 20.0 + 0.5 * h:
                m[10] = m[9]
            held = (p, level_gravity(p), u)
            if physical:
                attitude, omega, wheel_speed = standing_period(
                    held, t, h / substeps, substeps, (attitude, omega, wheel_speed))
            else:
                angles, omega = paper_period(held, t, h / substeps, substeps, angles, omega)
            if not clipped:
                x.adaptive_a = appc.adapted(h, x.adaptive_a, p.eta_a, epsilon_a, xi_a, 1e9)
                x.adaptive_u = appc.adapted(h, x.adaptive_u, p.eta_u, epsilon_u, xi_u, 1e9)
    return angles


class LoopParameters(CubliPlantParameters, AppcParameters):
    """Plant and laws in one record."""

    kp: Vec3
    kd: Vec3
    c1: float
    c2: float


def records(gains, period, **values):
    """Parameters and state for these gains; the baselines take theirs from the rows lambda_a and lambda_u."""
    rows = dict(zip(GAINS, gains))
    rows |= {"kp": rows["lambda_a"], "kd": rows["lambda_u"], "c1": rows["lambda_a"][0], "c2": rows["lambda_u"][0]}
    p = made(LoopParameters, period, **rows, **values)
    x = made(AppcState, start_bound=rows["rho_a0"])
    return p, x


def named(m):
    return {name: float(m[i]) for name, i in METRICS.items()}


def run_continuous(
    g, gains, horizon, step, kind=APPC, phi=PHI, sign=1, amplitude=0.02, frequency=1.0, phase=(0.0, 0.0, 0.0)
):
    """Result dictionary of the continuous loop, with the adaptive gains at the end as v_a, v_u."""
    m = np.zeros(len(METRICS))
    p, x = records(gains, step, initial_angles=START, gravity=g, gravity_sign=int(sign), smoothing=phi, feed_forward=0.0,
                   disturbance_amplitude=amplitude, disturbance_frequency=frequency, disturbance_phase=list(phase))
    motion = continuous(kind, p, x, float(horizon), round(horizon / step), m)
    return named(m) | {"v_a": np.array(motion[2]), "v_u": np.array(motion[3])}


def run_sampled(
    g, gains, horizon, rate, form=EXPLICIT, phi=PHI, sign=1, amplitude=0.02, frequency=1.0, phase=(0.0, 0.0, 0.0),
    feed_forward=0.0, physical=0, model=None, torque_limit=UNLIMITED, speed_limit=UNLIMITED, substeps=None, start=START,
    kick_time=1e9, kick=(0.0, 0.0, 0.0), rearm=0,
):  # fmt: skip
    """Result dictionary of the sampled loop at `rate` [Hz]; the plant's step is at most 1 ms unless given."""
    m = np.zeros(len(METRICS))
    steps = round(horizon * rate)
    if substeps is None:
        substeps = max(1, math.ceil(horizon / steps / 1e-3 - 1e-9))
    if model is None:
        model = MASS * LENGTH**2 / 6.0 * np.eye(3)
    p, x = records(
        gains, horizon / steps, initial_angles=start, gravity=g, gravity_sign=int(sign), smoothing=phi,
        feed_forward=feed_forward, disturbance_amplitude=amplitude, disturbance_frequency=frequency,
        disturbance_phase=list(phase), inertia=model.tolist(), torque_limit=torque_limit, speed_limit=speed_limit)
    run = (float(horizon), steps, substeps, float(kick_time), Vec3(*kick), rearm)
    angles = sampled(form, physical, p, x, run, m)
    return named(m) | {"v_a": np.array(x.adaptive_a), "v_u": np.array(x.adaptive_u), "y": np.array(angles)}
