"""APPC as a component: attitude in, wheel torques and funnel telemetry out.

Source: Aerospace 2022, 9(11), 728, equations (10)-(16), Tables 1 and 2; the laws are in `cubli_ros.appc` (as printed) and
`cubli_ros.sampled_appc`.
"""

import math

from cubli_ros.appc import adapted, attitude_loop, rate_loop, torque_demand
from cubli_ros.attitude import (
    body_rates,
    cardan_from_quaternion,
    gravity_torque,
    is_known,
    level_gravity,
)
from cubli_ros.funnel import attitude_bound, rate_bound, rearm, transformed_error
from cubli_ros.reference import reference
from cubli_ros.sampled_appc import sampled_law
from flight_graph.components.component import Component
from flight_graph.components.records import Choice, Parameters, State, field
from flight_graph.errors import FlightError
from flight_graph.timebase import SECOND
from flight_math import Mat3, Vec3, clip, elementwise, kernel, rotate_back, same, sign, sincos, smallest
from msg_schemas import cubli

EXPLICIT = 0
OUTSIDE_ATTITUDE, OUTSIDE_RATE, OUTSIDE_RATE_ANYHOW = 1, 2, 3
NO_LIMIT = 1e9  # [1] an adaptive gain never comes near it


class RoverModel(Parameters):
    """What a controller believes of the rover."""

    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    gravity: float = field(0.002, unit="m/s^2", ge=0, source="section 5.2", doc="surface gravity the law reckons with")
    gravity_sign: int = field(1, ge=-1, le=1, source="eq. (4)",
                              doc="+1: inverted pendulum; -1: as printed (hanging)")
    inertia: Mat3 = field([0.08 / 6, 0, 0, 0, 0.08 / 6, 0, 0, 0, 0.08 / 6], unit="kg m^2",
                          source="m l^2 / 6", doc="inertia that turns accelerations into torques")
    torque_limit: float = field(0.02, unit="N m", gt=0, doc="each wheel's largest torque")
    reference: Vec3 = field(0.0, unit="rad", doc="Cardan angles to hold")


class AppcParameters(RoverModel):
    law: Choice("explicit", "implicit") = field("implicit", doc="as printed, or its sampled (backward Euler) form")
    smoothing: float = field(0.0, unit="1", ge=0, used_if={"law": ["explicit"]},
                             doc="phi of tanh(eps/phi) for sgn(eps) in the explicit law; 0: sgn")
    feed_forward: float = field(1.0, unit="1", ge=0, le=1.5, doc="part of the gravity torque that is cancelled")
    rho_a0: Vec3 = field(0.4, unit="rad", gt=0, source="Table 2", doc="attitude funnel at the start")
    rho_a_inf: Vec3 = field(0.008, unit="rad", gt=0, source="Table 2", doc="attitude funnel at the end")
    l_a: Vec3 = field(-0.29, unit="1/s", lt=0, source="Table 2", doc="rate of the attitude funnel")
    lambda_a: Vec3 = field(0.041, unit="rad/s", gt=0, source="Table 2", doc="gain on the attitude error, eq. (15)")
    k_a: Vec3 = field(0.01, unit="rad/s", ge=0, source="Table 2", doc="gain on the adaptive term, eq. (15)")
    eta_a: Vec3 = field(0.0053, unit="1/s", ge=0, source="Table 2", doc="adaptation rate, eq. (15)")
    rho_u0: Vec3 = field(0.1, unit="rad/s", gt=0, source="Table 2", doc="rate funnel at the start")
    rho_u_inf: Vec3 = field(0.005, unit="rad/s", gt=0, source="Table 2", doc="rate funnel at the end")
    l_u: Vec3 = field(-0.25, unit="1/s", lt=0, source="Table 2", doc="rate of the rate funnel")
    lambda_u: Vec3 = field(0.041, unit="rad/s^2", gt=0, source="Table 2", doc="gain on the rate error, eq. (16)")
    k_u: Vec3 = field(0.01, unit="rad/s^2", ge=0, source="Table 2", doc="gain on the adaptive term, eq. (16)")
    eta_u: Vec3 = field(0.005, unit="1/s", ge=0, source="Table 2", doc="adaptation rate, eq. (16)")
    adaptive_a_limit: float = field(NO_LIMIT, unit="1", gt=0, doc="cap of v_a; rho_u_inf / (8 k_a) keeps its jump small")
    adaptive_u_limit: float = field(NO_LIMIT, unit="1", gt=0, doc="cap of v_u")
    reference_form: Choice("constant", "critically_damped", "minimum_jerk") = field(
        "constant", source="eq. (10)", doc="how the reference moves to the angles to hold; constant: it is there")
    reference_initial: Vec3 = field(0.0, unit="rad", doc="where a moving reference starts",
                                    used_if={"reference_form": ["critically_damped", "minimum_jerk"]})
    reference_capture: bool = field(False, doc="start a moving reference at the first attitude instead",
                                    used_if={"reference_form": ["critically_damped", "minimum_jerk"]})
    reference_rate: float = field(0.1, unit="1/s", gt=0, doc="q of the critically damped reference (1 + q t) exp(-q t)",
                                  used_if={"reference_form": ["critically_damped"]})
    reference_duration: float = field(30.0, unit="s", gt=0, doc="T of the minimum-jerk reference",
                                      used_if={"reference_form": ["minimum_jerk"]})
    rearm: bool = field(False, doc="widen rho_a when it is about to be left, and start outside a funnel")


class AppcState(State):
    """Adaptive gains, the attitude funnel's own start, the virtual rate of the last sample, counters."""

    begun: bool
    adaptive_a: Vec3
    adaptive_u: Vec3
    start_bound: Vec3
    start_time: Vec3
    virtual_rate: Vec3
    first: Vec3
    feasible_lambda_a: Vec3
    rearmed: int
    outside: int
    clipped: int


@kernel
def start(p, x):
    x.start_bound = p.rho_a0
    x.first = p.reference_initial


@kernel
def appc_kernel(t_ns, p, x, attitude, command, funnel):
    """Eq. (10)-(16): attitude -> torque of the three wheels [N m]. Zero torque until a first attitude is there."""
    if not is_known(attitude):
        command.effort = same(0.0)
        return
    t = t_ns / SECOND
    angles, omega = cardan_from_quaternion(attitude.orientation), attitude.angular_velocity
    turn = sincos(angles)
    if p.reference_capture and not x.begun:
        x.first = angles
    target, target_rate = reference(p, x.first, t)
    error_a = angles - target  # (10)
    if p.rearm:
        rearm(p, x, t, error_a)
    bound_a, bound_u = attitude_bound(p, x, t), rate_bound(p, t)
    xi_a = error_a / bound_a
    if p.law == EXPLICIT or not x.begun:
        epsilon_a, x.virtual_rate = attitude_loop(p, x, turn, xi_a, target_rate)  # (11), (15)
    error_u = omega - x.virtual_rate  # (12)
    xi_u = error_u / bound_u
    if not x.begun and not p.rearm:
        check_start(p, x, turn, xi_a, error_u, bound_u)
    if p.law == EXPLICIT:
        epsilon_u, acceleration = rate_loop(p, x, xi_u)  # (16)
    else:
        epsilon_a, epsilon_u, acceleration = sampled_law(p, x, t, angles, turn, omega)
    x.begun = True
    gravity = rotate_back(attitude.orientation, level_gravity(p))
    demand = torque_demand(p, acceleration, gravity_torque(p, gravity))
    torque = clip(demand, -p.torque_limit, p.torque_limit)
    clipped = any(torque != demand)
    x.outside += any(abs(xi_a) >= 1.0) or any(abs(xi_u) >= 1.0)
    x.clipped += clipped
    command.effort = torque
    funnel.attitude_error, funnel.attitude_bound, funnel.attitude_xi = error_a, bound_a, xi_a
    funnel.rate_error, funnel.rate_bound, funnel.rate_xi = error_u, bound_u, xi_u
    funnel.adaptive_a, funnel.adaptive_u = x.adaptive_a, x.adaptive_u
    funnel.torque_demand, funnel.torque = demand, torque
    funnel.rearmed, funnel.outside, funnel.clipped = x.rearmed, x.outside, x.clipped
    if not clipped:  # a clipped torque says nothing about the disturbance
        x.adaptive_a = adapted(p.period, x.adaptive_a, p.eta_a, epsilon_a, xi_a, p.adaptive_a_limit)
        x.adaptive_u = adapted(p.period, x.adaptive_u, p.eta_u, epsilon_u, xi_u, p.adaptive_u_limit)


@kernel
def check_start(p, x, turn, xi_a, error_u, bound_u):
    """A first sample outside of a funnel is a fault; x.feasible_lambda_a is the gain that would do.

    With v_a = 0, e_u = e_0 + G^-1 lambda_a eps_a, eq. (12) and (15): lambda_a by the largest common factor.
    """
    if any(abs(xi_a) >= 1.0):
        x.fault = OUTSIDE_ATTITUDE
    elif any(abs(error_u / bound_u) >= 1.0):
        x.fault = OUTSIDE_RATE
        part = body_rates(turn, p.lambda_a * transformed_error(xi_a))
        x.feasible_lambda_a = smallest(largest_factor(part, error_u - part, bound_u)) * p.lambda_a
        if any(x.feasible_lambda_a <= 0.0):
            x.fault = OUTSIDE_RATE_ANYHOW


@elementwise
def largest_factor(part, rest, bound):
    """Largest factor with |rest + factor part| < bound: zero when none is small enough."""
    if abs(rest) >= bound:
        return 0.0
    return math.inf if part == 0.0 else (bound - sign(part) * rest) / abs(part)


class AppcController(Component):
    """Adaptive prescribed performance control of the Cubli rover's attitude.

    Promises: a torque on the body by each wheel [N m], axes of `cubli_base`, none beyond `torque_limit`, by eq.
    (10)-(16). As long as no torque is clipped, the error of the Cardan angles [rad] stays inside the funnel rho_a and
    the error of the rates [rad/s] inside rho_u. The funnel's telemetry says at every firing how much of both is used
    (xi), and counts what was clipped, outside of a funnel, or rearmed.

    Bad input: zero torque while no attitude with a known orientation is there (covariance -1: unknown). It does not
    look at ages: an old attitude is answered as it is, and the mode manager is who takes over. While a torque is
    clipped the adaptive gains rest. A first sample outside of a funnel ends the run, unless `rearm` widens it.
    """

    parameters, state = AppcParameters, AppcState
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND, "funnel": cubli.FUNNEL}
    rate_hz = 100.0
    start, kernel = start, appc_kernel
    faults = {
        OUTSIDE_ATTITUDE: "the initial attitude error {attitude_error} rad is outside the funnel rho_a0 = {rho_a0} rad "
                          "(xi_a = {attitude_xi}, allowed: |xi_a| < 1); widen rho_a0, or set rearm to true",
        OUTSIDE_RATE: "the initial rate error {rate_error} rad/s is outside the funnel rho_u0 = {rho_u0} rad/s "
                      "(xi_u = {rate_xi}, allowed: |xi_u| < 1); take a lambda_a below {feasible_lambda_a} rad/s, widen "
                  "rho_u0, or set rearm to true",
        OUTSIDE_RATE_ANYHOW: "the initial rate error {rate_error} rad/s is outside the funnel rho_u0 = {rho_u0} rad/s "
                             "(xi_u = {rate_xi}, allowed: |xi_u| < 1), whatever lambda_a; widen rho_u0, start more slowly, "
                             "or set rearm to true",
    }

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
        for outer, inner in (("rho_a0", "rho_a_inf"), ("rho_u0", "rho_u_inf")):
            if any(a < b for a, b in zip(values[outer], values[inner])):
                raise FlightError(
                        f"{where}: {outer} = {values[outer]} is below {inner} = {values[inner]}; a funnel narrows")
