"""Design rules: funnels of the APPC law that keep the Cubli rover on the ground of a small body.

The law and its funnels: Aerospace 2022, 9(11), 728, equations (9)-(16). The paper's own gains throw the rover off:
eq. (9) holds for each axis, but not for the rate across the body diagonal, and nothing limits the ground force.

*A*: a held reference, funnels so narrow that the rate across the diagonal stays below omega_3D = sqrt(2 g cos a /
(sqrt(3) l)) whatever the law does inside of them. Says nothing about friction.

*B*: a critically damped reference whose largest acceleration needs half of the friction coefficient.

*best*: a minimum-jerk reference of the shortest duration T whose ground force, from the exact kinematics on the
worst-sided slope, keeps to 0.8 of the friction coefficient less what the disturbance needs, and to a normal force of
0.4 m g; a rate funnel so narrow that the rate limit of rule A holds too while |xi| < 1, and that need not narrow, so
that gyro noise shakes the wheels less; an inner loop fast against the disturbance.

The rules are recipes with an argument, checked by simulation, and no proof.
"""

import math
from dataclasses import dataclass, field

from cubli_ros import jump_condition
from cubli_ros.design_site import Rover, Site, check, contact, disturbance_friction, norms, path
from cubli_ros.reference import CRITICALLY_DAMPED, MINIMUM_JERK
from flight_graph.errors import FlightError
from flight_math import plain

RULES = ("A", "B", "best")
RATES_HZ = (20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10000)
K = 0.01  # [rad/s], [rad/s^2] gains k_a, k_u on the adaptive terms, as in Table 2
START_XI = 0.75  # [-] |xi_a| of rule A at the start
RATE_SHARE = 0.95  # [-] of omega_3D: the rest is for k_a v_a
FRICTION_SHARE = 0.8  # [-] of the friction coefficient that the best rule plans with
LEAST_NORMAL_FORCE = 0.4  # [m g] along the reference
REFERENCE_FUNNEL = (0.03, 0.008)  # [rad] rho_a at the start and at the end, where the reference starts at the rover
PEAK = math.sqrt(10.0 / math.sqrt(3.0))  # [-] q T: q^2 is the largest s'' of a minimum-jerk reference
TORQUE_LIMIT = 0.02  # [N m] of a wheel


@dataclass
class Design:
    """What a rule gives: parameters of the controller, its rate, expected settling, numbers, argument and warnings."""

    rule: str
    parameters: dict
    rate_hz: float
    minimum_rate_hz: float
    settling_s: float
    margins: dict
    argument: list
    warnings: list = field(default_factory=list)


def design(rule: str, site: Site, rover: Rover = Rover()) -> Design:
    """Parameters by one of the rules. Raises FlightError with a sentence where there is no design."""
    if rule not in RULES:
        raise FlightError(f"rule: '{rule}' is not allowed; allowed: {', '.join(RULES)}")
    check(site, rover)
    return {"A": rule_a, "B": rule_b, "best": best}[rule](site, rover)


def rule_a(site: Site, rover: Rover) -> Design:
    """|omega| < omega_3D while |xi| < 1, from a held reference."""
    limit = RATE_SHARE * rate_limit(site, rover)
    error = max(map(abs, rover.start))
    rho_a0 = error / START_XI
    forward, inverse, inverse_2 = norms(rover, min(rho_a0, 1.2))
    x = limit / (math.sqrt(3.0) * (1.0 + inverse_2 * (forward + 1.0)))
    pace = x / rho_a0
    epsilon = START_XI / (1.0 - START_XI**2)
    fall = 3.0 * math.sqrt(3.0) * site.gravity / rover.length * rover.start_tilt
    paper = rover.model == "paper"
    parameters = {
        "law": "explicit" if paper else "implicit", "feed_forward": 0.0 if paper else 1.0, "reference_form": "constant",
        "rho_a0": rho_a0, "rho_a_inf": min(0.008, 0.5 * rho_a0), "l_a": -pace,
        "lambda_a": 0.7 * x / (inverse * epsilon), "rho_u0": x, "rho_u_inf": 0.15 * x, "l_u": -pace,
        "lambda_u": 1.1 * fall + site.disturbance, **adaptation(0.15 * x, pace, 1.1 * fall + site.disturbance, pace)}
    argument = [
        f"omega_3D = {limit / RATE_SHARE:.4g} rad/s; {1 - RATE_SHARE:.0%} of it is kept for the switching term k_a v_a",
        f"while |xi| < 1: lambda_a eps_a <= {forward:.3g} rho_u0 + |l| rho_a0 = {(forward + 1) * x:.4g} rad/s",
        f"so |omega| <= sqrt(3) rho_u0 (1 + {inverse_2:.3g} ({forward:.3g} + 1)) = {limit:.4g} rad/s < omega_3D",
        "friction is not looked at: the first torque step alone can make the corner slide",
    ]
    # 2.5 / |l_a| is where simulated runs settle, the same for every gravity
    return finish("A", site, rover, parameters, 2.5 / pace, argument, {"rate_bound_share": RATE_SHARE},
                  (fall if paper else 0.3 * fall) + site.disturbance, 0.0)


def rule_b(site: Site, rover: Rover) -> Design:
    """A critically damped reference that needs half of the friction coefficient."""
    grip = site.friction * math.cos(site.tilt) - math.sin(site.tilt)
    q = math.sqrt(0.5 * grip * site.gravity / (rover.arm * rover.start_tilt))
    along = path(rover, CRITICALLY_DAMPED)
    found = contact(rover, site, along, 1.0 / q)
    parameters = {
        "law": "implicit", "feed_forward": 1.0, "reference_form": "critically_damped", "reference_initial": rover.start,
        "reference_rate": q, "rho_a0": REFERENCE_FUNNEL[0], "rho_a_inf": REFERENCE_FUNNEL[1], "l_a": -q,
        "lambda_a": 0.02 * q,
        "rho_u0": 0.3 * q, "rho_u_inf": 0.1 * q, "l_u": -q, "lambda_u": q * q + 3.0 * site.disturbance,
        **adaptation(0.1 * q, q, q * q + site.disturbance, q)}
    argument = [
        f"q = sqrt(0.5 (mu cos a - sin a) g / (r tilt)) = {q:.4g} 1/s with r = {rover.arm:.4g} m, tilt = "
        f"{rover.start_tilt:.4g} rad: the largest acceleration of the centre, q^2 r tilt, takes half of the friction",
        f"the reference itself needs a friction ratio of {found['friction']:.3g} and leaves a normal force of "
        f"{found['normal']:.3g} m g",
    ]
    bound = (found["across"] + funnel_rate(rover, parameters)) / rate_limit(site, rover)
    return finish("B", site, rover, parameters, along.settled / q, argument, {"rate_bound_share": bound},
                  0.4 * q * q + 1.1 * site.disturbance, found["friction"], found["normal"])


def best(site: Site, rover: Rover) -> Design:
    """A minimum-jerk reference as short as the ground force allows."""
    at_once = disturbance_friction(rover, site)
    slope = math.tan(site.tilt)
    wanted = FRICTION_SHARE * site.friction - 0.25 * at_once
    wanted = max(wanted, slope + 0.25 * (site.friction - slope))
    limit = RATE_SHARE * rate_limit(site, rover)
    along = path(rover, MINIMUM_JERK)
    rho_a0, rho_a_inf = REFERENCE_FUNNEL
    forward, _, inverse_2 = norms(rover, min(1.2, max(map(abs, rover.start)) + rho_a0))
    funnels = math.sqrt(3.0) * (inverse_2 * rho_a0 + 0.06 * (1.0 + inverse_2 * forward))
    duration = shortest(site, rover, along, wanted, limit, funnels)
    found = contact(rover, site, along, duration)
    q = PEAK / duration
    room = limit - found["across"] - math.sqrt(3.0) * inverse_2 * q * rho_a0
    rho_u0 = min(0.12 * q, room / (math.sqrt(3.0) * (1.0 + inverse_2 * forward)))
    lambda_u = max(4.0 * (q * q + site.disturbance), 4.0 * site.frequency * rho_u0 if site.disturbance else 0.0)
    parameters = {
        "law": "implicit", "feed_forward": 1.0, "reference_form": "minimum_jerk", "reference_initial": rover.start,
        "reference_duration": duration, "rho_a0": rho_a0, "rho_a_inf": rho_a_inf, "l_a": -q, "lambda_a": 0.02 * q,
        "rho_u0": rho_u0, "rho_u_inf": rho_u0, "l_u": -q, "lambda_u": lambda_u,
        **adaptation(rho_u0, q, q * q + site.disturbance, q)}
    argument = [
        f"T = {duration:.4g} s is the shortest minimum-jerk reference with a friction ratio of at most {wanted:.3g} "
        f"and a normal force of at least {LEAST_NORMAL_FORCE:g} m g: it needs {found['friction']:.3g} and leaves "
        f"{found['normal']:.3g}",
        f"{FRICTION_SHARE:g} mu less a quarter of the {at_once:.3g} that the disturbance needs "
        f"uncompensated: the inner loop, lambda_u / rho_u0 = {lambda_u / rho_u0:.3g} 1/s, takes the rest away",
        f"while |xi| < 1: |omega| <= {found['across']:.3g} (reference) + sqrt(3) (rho_u0 + {inverse_2:.3g} "
        f"({forward:.3g} rho_u0 + |l| rho_a0)) rad/s <= {RATE_SHARE:g} omega_3D = {limit:.4g} rad/s",
    ]
    bound = (found["across"] + funnel_rate(rover, parameters)) / rate_limit(site, rover)
    return finish("best", site, rover, parameters, along.settled * duration, argument, {"rate_bound_share": bound},
                  q * q * max(map(abs, rover.start)) * 1.3 + 1.1 * site.disturbance, found["friction"], found["normal"])


def shortest(site, rover, along, friction, limit, funnels) -> float:
    """Shortest duration [s] of a reference within friction, normal force and rate limit, beside funnels of q times
    `funnels` [rad/s]."""
    low, high = 0.1 * math.sqrt(rover.arm / site.gravity), 1000.0 * math.sqrt(rover.arm / site.gravity)
    for _ in range(45):
        middle = math.sqrt(low * high)
        found = contact(rover, site, along, middle)
        good = (found["friction"] <= friction and found["normal"] >= LEAST_NORMAL_FORCE * math.cos(site.tilt)
                and found["across"] + funnels * PEAK / middle <= limit)
        low, high = (low, middle) if good else (middle, high)
    return high


def rate_limit(site, rover) -> float:
    """omega_3D [rad/s]."""
    return plain(jump_condition.corner_rate_limit)(site.gravity, rover.length, math.cos(site.tilt))


def funnel_rate(rover, parameters) -> float:
    """What |omega| can add to the reference's while |xi| < 1 [rad/s]."""
    forward, _, inverse_2 = norms(rover, min(1.2, max(map(abs, rover.start)) + parameters["rho_a0"]))
    inner = forward * parameters["rho_u0"] - parameters["l_a"] * parameters["rho_a0"]
    return math.sqrt(3.0) * (parameters["rho_u0"] + inverse_2 * inner)


def adaptation(rho_u_inf, pace, gain, pace_u) -> dict:
    """k, eta and their cap: v_a stays so small that its switching cannot throw the rate out of its funnel."""
    return {"k_a": K, "k_u": K, "eta_a": 0.05 * rho_u_inf * pace / (8.0 * K), "eta_u": 0.05 * gain * pace_u / (8.0 * K),
            "adaptive_a_limit": rho_u_inf / (8.0 * K)}


def finish(rule, site, rover, parameters, settling, argument, margins, load, friction, normal=1.0) -> Design:
    """Rate, common parameters, margins and warnings. load [rad/s^2]: what the rate loop must deliver."""
    epsilon = load / parameters["lambda_u"]
    xi = 2.0 * epsilon / (1.0 + math.sqrt(1.0 + 4.0 * epsilon * epsilon))
    steepness = (1.0 + xi * xi) / (1.0 - xi * xi) ** 2
    gain = parameters["lambda_u"] / parameters["rho_u_inf"]
    slowest = max(0.5 * gain * steepness, 10.0 * site.frequency / (2.0 * math.pi) if site.disturbance else 0.0)
    fitting = [rate for rate in RATES_HZ if rate >= max(20.0, 2.5 * slowest)]
    if not fitting:
        raise FlightError(f"rule {rule}: the law would need {slowest:.3g} Hz at least (inner gain {gain:.3g} 1/s); "
                          f"allowed: up to {RATES_HZ[-1] / 2.5:g} Hz; a smaller disturbance or a larger gravity helps")
    rate = float(fitting[0])
    at_once = disturbance_friction(rover, site)
    held = at_once / math.sqrt(1.0 + (parameters["lambda_u"] / parameters["rho_u0"] / max(site.frequency, 1e-9)) ** 2)
    noise = min(gain, rate) * rover.gyro_sigma * math.sqrt(2.0) * rover.arm / site.gravity
    torque = rover.mass * site.gravity * rover.arm * math.sin(rover.start_tilt) + rover.inertia.max() * load
    margins = {
        **margins, "friction_reference": friction, "friction_disturbance_at_once": at_once,
        "friction_disturbance_held": held, "normal_force_reference_mg": normal, "friction_gyro_noise": noise,
        "xi_u_expected": xi, "inner_gain_1_s": gain, "torque_Nm": torque,
        **({"rho_u_inf_over_gyro_noise": parameters["rho_u_inf"] / rover.gyro_sigma} if rover.gyro_sigma else {})}
    parameters = {name: float(value) if isinstance(value, float) else value for name, value in parameters.items()}
    parameters = {"mass": rover.mass, "length": rover.length, "gravity": site.gravity, "gravity_sign": 1,
                  "inertia": [float(value) for value in rover.inertia.reshape(-1)], "smoothing": 0.0,
                  "torque_limit": TORQUE_LIMIT, "reference": [0.0, 0.0, 0.0], **parameters}
    parameters["reference_initial"] = [float(angle) for angle in parameters.get("reference_initial", (0.0, 0.0, 0.0))]
    warnings = warn(rule, site, rover, parameters, margins)
    return Design(rule, parameters, rate, float(slowest), float(settling),
                  {name: float(value) for name, value in margins.items()}, argument, warnings)


def warn(rule, site, rover, parameters, margins) -> list:
    """What the design cannot promise, in sentences with numbers."""
    found, slope = [], math.tan(site.tilt)
    rho, sigma = parameters["rho_u_inf"], rover.gyro_sigma
    if rho < 5.0 * sigma:
        found.append(f"the rate funnel ends at {rho:.3g} rad/s, {rho / sigma:.2g} times the gyro noise of {sigma:g} "
                     f"rad/s: it is tighter than 5 standard deviations; allowed noise: {rho / 5.0:.2g} rad/s")
    if margins["friction_gyro_noise"] > 0.1 * site.friction:
        allowed = 0.1 * site.friction * sigma / margins["friction_gyro_noise"]
        found.append(f"gyro noise of {sigma:g} rad/s shakes the ground force by a friction ratio of "
                     f"{margins['friction_gyro_noise']:.2g} (one standard deviation, friction coefficient "
                     f"{site.friction:g}); filter the rate to {allowed:.2g} rad/s or better")
    if margins["friction_disturbance_at_once"] + slope > site.friction:
        at_once = margins["friction_disturbance_at_once"] + slope
        found.append(f"the disturbance needs a friction ratio of {at_once:.3g} before any law can answer, the ground "
                     f"gives {site.friction:g}: expect a slip when it begins")
    total = margins["friction_reference"] + margins["friction_disturbance_held"]
    if rule != "A" and total > site.friction:
        found.append(f"reference and disturbance together need a friction ratio of {total:.3g}, the ground gives "
                     f"{site.friction:g}")
    if margins["rate_bound_share"] > 1.0:
        found.append(f"inside of the funnels the rate may reach {margins['rate_bound_share']:.3g} omega_3D: the "
                     "funnels alone do not keep the rover down (the reference does)")
    if margins["torque_Nm"] > parameters["torque_limit"]:
        found.append(f"the manoeuvre needs about {margins['torque_Nm']:.3g} N m, a wheel gives "
                     f"{parameters['torque_limit']:g} N m")
    return found
