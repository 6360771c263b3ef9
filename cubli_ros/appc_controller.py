"""APPC as a component: attitude in, wheel torques and funnel telemetry out.

Source: Aerospace 2022, 9(11), 728, equations (10)-(16), Tables 1 and 2; the laws themselves are in `cubli_ros.appc`.
"""

import math

from cubli_ros import appc, funnel
from cubli_ros.attitude import body_rates, cardan_from_quaternion, gravity_torque
from cubli_ros.reference import reference
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, Parameters, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from msg_schemas import cubli

EXPLICIT, IMPLICIT = 0, 1
OUTSIDE_ATTITUDE, OUTSIDE_RATE = 1, 2
NO_LIMIT = 1e9  # [1] an adaptive gain never comes near it


class RoverModel(Parameters):
    """What a controller believes of the rover."""

    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    gravity: float = field(0.002, unit="m/s^2", ge=0, source="section 5.2", doc="surface gravity the law reckons with")
    gravity_sign: int = field(1, ge=-1, le=1, source="eq. (4)",
                              doc="+1: inverted pendulum; -1: as printed (hanging)")
    inertia: Array(3, 3) = field([0.08 / 6, 0, 0, 0, 0.08 / 6, 0, 0, 0, 0.08 / 6], unit="kg m^2",
                                 source="m l^2 / 6", doc="inertia that turns accelerations into torques")
    torque_limit: float = field(0.02, unit="N m", gt=0, doc="each wheel's largest torque")
    reference: Vec3 = field(0.0, unit="rad", doc="Cardan angles to hold")


class AppcParameters(RoverModel):
    law: Choice("explicit", "implicit") = field("implicit", doc="as printed, or its sampled (backward Euler) form")
    smoothing: float = field(0.0, unit="1", ge=0, doc="phi of tanh(eps/phi) for sgn(eps) in the explicit law; 0: sgn")
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
    reference_initial: Vec3 = field(0.0, unit="rad", doc="where a moving reference starts")
    reference_capture: bool = field(False, doc="start a moving reference at the first attitude instead")
    reference_rate: float = field(0.1, unit="1/s", gt=0, doc="q of the critically damped reference (1 + q t) exp(-q t)")
    reference_duration: float = field(30.0, unit="s", gt=0, doc="T of the minimum-jerk reference")
    rearm: bool = field(False, doc="widen rho_a when it is about to be left, and start outside a funnel")


class AppcState(State):
    """Adaptive gains, the attitude funnel's own start, and scratch arrays."""

    begun: bool
    adaptive_a: Vec3
    adaptive_u: Vec3
    start_bound: Vec3
    start_time: Vec3
    virtual_rate: Vec3
    angles: Vec3
    omega: Vec3
    first: Vec3
    reference: Vec3
    reference_rate: Vec3
    part: Vec3
    feasible_lambda_a: Vec3
    cap: Vec3
    attitude_error: Vec3
    attitude_bound: Vec3
    attitude_xi: Vec3
    attitude_epsilon: Vec3
    rate_error: Vec3
    rate_bound: Vec3
    rate_xi: Vec3
    rate_epsilon: Vec3
    next_attitude_bound: Vec3
    next_rate_bound: Vec3
    predicted: Vec3
    acceleration: Vec3
    gravity: Vec3
    gravity_torque: Vec3
    demand: Vec3
    rearmed: float
    outside: float
    clipped: float


@kernel
def start(p, x):
    for i in range(3):
        x.start_bound[i] = p.rho_a0[i]
        x.cap[i] = 1.0
        x.gravity[i] = -p.gravity / math.sqrt(3.0)
        x.first[i] = p.reference_initial[i]


@kernel
def explicit_errors(p, x):
    """Errors and demand of the printed law at the bounds in x."""
    appc.attitude_loop(x.angles, x.reference, x.reference_rate, x.attitude_bound, p.lambda_a, p.k_a, x.adaptive_a,
                       p.smoothing, x.cap, x.attitude_error, x.attitude_xi, x.attitude_epsilon, x.virtual_rate)
    appc.rate_loop(x.omega, x.virtual_rate, x.rate_bound, p.lambda_u, p.k_u, x.adaptive_u, p.smoothing, x.cap,
                   x.rate_error, x.rate_xi, x.rate_epsilon, x.acceleration)


@kernel
def implicit_errors(t, p, x):
    """Errors against the rate chosen one sample ago, and the demand for the sample ahead."""
    appc.normalise(x.angles, x.reference, x.attitude_bound, x.attitude_error, x.attitude_xi)
    appc.normalise(x.omega, x.virtual_rate, x.rate_bound, x.rate_error, x.rate_xi)
    appc.attitude_bounds(t + p.period, x.start_bound, x.start_time, p.rho_a_inf, p.l_a, x.next_attitude_bound)
    appc.rate_bounds(t + p.period, p.rho_u0, p.rho_u_inf, p.l_u, x.next_rate_bound)
    reference(p.reference_form, t + p.period, x.first, p.reference, p.reference_rate, p.reference_duration, x.reference,
              x.reference_rate)
    appc.implicit_attitude_loop(x.angles, x.omega, x.reference, x.reference_rate, x.next_attitude_bound, p.lambda_a,
                                p.k_a, x.adaptive_a, p.period, x.predicted, x.attitude_epsilon, x.virtual_rate)
    appc.implicit_rate_loop(x.omega, x.virtual_rate, x.next_rate_bound, p.lambda_u, p.k_u, x.adaptive_u, p.period,
                            x.rate_epsilon, x.acceleration)


@kernel
def largest_gain(p, x):
    """Largest lambda_a, by a common factor, with |xi_u| < 1 at the start (v_a = 0): zero when none is small enough.

    e_u = e_0 + factor G^-1 lambda_a eps_a, eq. (12) and (15).
    """
    x.part[0], x.part[1], x.part[2] = body_rates(
        x.angles, p.lambda_a[0] * x.attitude_epsilon[0], p.lambda_a[1] * x.attitude_epsilon[1],
        p.lambda_a[2] * x.attitude_epsilon[2])
    factor = math.inf
    for i in range(3):
        rest = x.rate_error[i] - x.part[i]
        if abs(rest) >= x.rate_bound[i]:
            factor = 0.0
        elif x.part[i] > 0.0:
            factor = min(factor, (x.rate_bound[i] - rest) / x.part[i])
        elif x.part[i] < 0.0:
            factor = min(factor, (x.rate_bound[i] + rest) / -x.part[i])
    for i in range(3):
        x.feasible_lambda_a[i] = factor * p.lambda_a[i]


@kernel
def appc_kernel(t_ns, p, x, attitude, command, funnels):
    """Eq. (10)-(16): attitude -> torque of the three wheels [N m]. Zero torque until a first attitude is there."""
    if attitude.header.stamp.sec == 0 or attitude.orientation_covariance[0] < 0.0:
        for i in range(3):
            command.effort[i] = 0.0
        return
    t = t_ns / SECOND
    cardan_from_quaternion(attitude.orientation, x.angles)
    for i in range(3):
        x.omega[i] = attitude.angular_velocity[i]
        if p.reference_capture and not x.begun:
            x.first[i] = x.angles[i]
    reference(p.reference_form, t, x.first, p.reference, p.reference_rate, p.reference_duration, x.reference,
              x.reference_rate)
    for i in range(3):
        x.attitude_error[i] = x.angles[i] - x.reference[i]
    if p.rearm:
        x.rearmed += funnel.rearm(t, x.attitude_error, p.rho_a_inf, p.l_a, x.start_bound, x.start_time)
    appc.attitude_bounds(t, x.start_bound, x.start_time, p.rho_a_inf, p.l_a, x.attitude_bound)
    appc.rate_bounds(t, p.rho_u0, p.rho_u_inf, p.l_u, x.rate_bound)
    if p.law == EXPLICIT or not x.begun:
        explicit_errors(p, x)
    if p.law == IMPLICIT:
        implicit_errors(t, p, x)
    outside = False
    for i in range(3):
        if abs(x.attitude_xi[i]) >= 1.0:
            outside = True
            if not x.begun and not p.rearm:
                x.fault = OUTSIDE_ATTITUDE
        if abs(x.rate_xi[i]) >= 1.0:
            outside = True
            if not x.begun and not p.rearm and x.fault == 0:
                x.fault = OUTSIDE_RATE
                largest_gain(p, x)
    x.begun = True
    gravity_torque(x.angles, x.gravity, p.gravity_sign, p.mass, p.length, x.gravity_torque)
    appc.torque_demand(p.inertia, x.acceleration, x.gravity_torque, p.feed_forward, x.demand)
    clipped = appc.limit_torque(x.demand, p.torque_limit, command.effort)
    if outside:
        x.outside += 1.0
    if clipped:
        x.clipped += 1.0
    report(x, command, funnels)
    appc.adapt(p.period, p.eta_a, x.attitude_epsilon, x.attitude_xi, clipped, p.adaptive_a_limit, x.adaptive_a)
    appc.adapt(p.period, p.eta_u, x.rate_epsilon, x.rate_xi, clipped, p.adaptive_u_limit, x.adaptive_u)


@kernel
def report(x, command, funnels):
    for i in range(3):
        funnels.attitude_error[i] = x.attitude_error[i]
        funnels.attitude_bound[i] = x.attitude_bound[i]
        funnels.attitude_xi[i] = x.attitude_xi[i]
        funnels.rate_error[i] = x.rate_error[i]
        funnels.rate_bound[i] = x.rate_bound[i]
        funnels.rate_xi[i] = x.rate_xi[i]
        funnels.adaptive_a[i] = x.adaptive_a[i]
        funnels.adaptive_u[i] = x.adaptive_u[i]
        funnels.torque_demand[i] = x.demand[i]
        funnels.torque[i] = command.effort[i]
    funnels.rearmed = x.rearmed
    funnels.outside = x.outside
    funnels.clipped = x.clipped


class AppcController(Component):
    """Adaptive prescribed performance control of the Cubli rover's attitude."""

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
    }

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
        for outer, inner in (("rho_a0", "rho_a_inf"), ("rho_u0", "rho_u_inf")):
            if any(a < b for a, b in zip(values[outer], values[inner])):
                raise FlightError(
                        f"{where}: {outer} = {values[outer]} is below {inner} = {values[inner]}; a funnel narrows")
