"""The paper's equations of motion and the law's stability, against a rigid body written for that (`rigid_body`).

One function a row of the claims table; each returns (holds, what was found), or several of them by label. Arguments
change a printed term or what the law knows; their defaults change nothing.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from flight_graph.graphs.scenario import load
from flight_math import DualVector, Quaternion, Vec3, view
from lander_ros.landing_law import LandingLaw, landing_law
from papers.lander import energy, rigid_body
from papers.lander import twistor_algebra as algebra
from papers.lander.appendix_b import times
from papers.lander.identities import printed_gamma
from papers.lander.rigid_body import Body, Relative
from sim_nodes.lander.plant import LanderPlantParameters
from sim_nodes.lander.start import approach_attitude, motion_at_start


def reference_body() -> Body:
    """The reference vehicle and site, in the field of a point mass of the asteroid's mu."""
    law = LandingLaw.defaults()
    inertia, place, spin = (np.array(law[name]) for name in ("inertia", "site_position", "site_spin"))
    return Body(law["mass"], inertia, 446300.0, place, spin)


def twistor_rate(body, state, wrench, gamma_2, site_terms):
    """Rate of B and V (16,): Gamma as printed, the terms of Appendix B; site_terms: a factor of the bracket of V2'."""
    b, v = state[:8], state[8:]
    dual = algebra.dual_of(b)
    turn = Rotation.from_quat(dual[:4])
    r = algebra.position(b)
    zeta, eta = turn.inv().apply(body.spin), turn.inv().apply(np.cross(body.spin, body.place + r))
    motor, site = (v[0:3], v[4:7]), (zeta, eta)

    def inertia(a):
        return np.array([body.mass * a[1], body.inertia @ a[0]])
    total = motor[0] + zeta, motor[1] + eta
    first = np.array(times(motor, inertia(total)))  # V x M V_BI, of V1'
    second = np.array(times(site, inertia(motor))) - inertia(times(motor, site))  # V_DI x M V - M (V x V_DI), of V2'
    weight = np.array([body.mass * turn.inv().apply(rigid_body.gravity(body, r)), np.zeros(3)])
    force, torque = np.array(wrench) + weight - first - site_terms * second - np.array(times(site, inertia(site)))
    dv = [*np.linalg.solve(body.inertia, torque), 0.0, *(force / body.mass), 0.0]
    return np.concatenate([0.25 * printed_gamma(b, gamma_2).T @ v, dv])


def unified_dynamics(gamma_2=1.0, site_terms=1.0):
    """The twistor's equations of motion, 30 s under a constant wrench, against Newton and Euler."""
    body, wrench = reference_body(), (np.array([6.0, -4.0, 5.0]), np.array([0.05, -0.03, 0.04]))
    start = Relative(np.array([-90.0, 45.0, 60.0]), Rotation.from_rotvec([0.4, -0.3, 0.6]).as_quat(),
                     np.array([0.004, -0.003, 0.005]), np.array([0.3, -0.2, 0.1]))
    state = rigid_body.inertial(body, start)
    motor = [*start.w, 0.0, *start.alpha, 0.0]
    twistor = np.array([*algebra.twistor_of(algebra.dual_of_pose(start.r, start.q)), *motor])
    dt, steps = 0.25, 120  # [s]
    for number in range(steps):
        t = number * dt
        state = rigid_body.step(lambda t, x: rigid_body.rate(body, t, x, lambda _: wrench), t, state, dt)
        twistor = rigid_body.step(lambda _, x: twistor_rate(body, x, wrench, gamma_2, site_terms), t, twistor, dt)
    end = rigid_body.relative(body, dt * steps, state)
    away = np.linalg.norm(end.r - start.r)
    apart = np.linalg.norm(algebra.position(twistor[:8]) - end.r)
    turn = Rotation.from_quat(end.q).inv() * Rotation.from_quat(algebra.dual_of(twistor[:8])[:4])
    return (bool(apart < 1e-6 and turn.magnitude() < 1e-8),
            f"{apart:.1e} m and {turn.magnitude():.1e} rad apart after 30 s, in which it moves {away:.0f} m")


def safe_states(count):
    """Random motions relative to the site, clear of both constraints."""
    random = np.random.default_rng(100)
    law = LandingLaw.defaults()
    for _ in range(count):
        x, y = random.uniform(-800.0, 800.0, 2)
        surface = (law["funnel_alpha"] * (x * x + law["funnel_beta"] * y * y + 100.0)) ** (1.0 / 3.0)
        r = np.array([x, y, surface + random.uniform(10.0, 300.0)])
        yaw, tilt, direction = random.uniform(-3.0, 3.0), random.uniform(0.0, 0.45), random.uniform(-3.0, 3.0)
        q = np.array(approach_attitude(Vec3(*r), yaw, tilt, direction))
        yield Relative(r, q, random.uniform(-0.02, 0.02, 3), random.uniform(-0.6, 0.6, 3)), random.uniform(0.3, 3.0, 2)


def lyapunov_identity(known_spin=1.0):
    """dL/dt of the loop of law and rigid body, by differences along the motion, against the damping's power.

    At 40 random states, each with weights k_a, k_w of its own and nothing clipped; known_spin: a factor of the
    asteroid's spin that the law is told.
    """
    body, worst = reference_body(), 0.0
    for start, (k_a, k_w) in safe_states(40):
        values = {**LandingLaw.defaults(), "force_weight": k_a, "torque_weight": k_w, "force_limit": 1e9,
                  "torque_limit": 1e9, "site_spin": list(known_spin * body.spin)}
        p = view(LandingLaw.record(values)[0], LandingLaw.kinds)

        def wrench(at, p=p):
            given, _ = landing_law(p, Vec3(*at.r), Quaternion(*at.q), DualVector(Vec3(*at.w), Vec3(*at.alpha)),
                                   Vec3(*rigid_body.gravity(body, at.r)))
            return np.array(given.real), np.array(given.dual)

        def level(t, start=start, wrench=wrench, values=values):
            state = rigid_body.inertial(body, start)
            moved = rigid_body.step(lambda s, x: rigid_body.rate(body, s, x, wrench), 0.0, state, t)
            at = rigid_body.relative(body, t, moved)
            return energy.lyapunov(values, body.mass, at.r[None], at.alpha[None], at.q[None], at.w[None])[0]
        h = 0.01  # [s]
        near, far = ((level(t) - level(-t)) / (2.0 * t) for t in (h, 2.0 * h))
        formula = -energy.dissipated(values, start.alpha[None], start.w[None])[0]
        worst = max(worst, abs((4.0 * near - far) / 3.0 / formula - 1.0))
    return bool(worst < 1e-6), f"largest relative difference {worst:.1e} at 40 random states and weights"


def floors(clearance_floor=0.05, view_floor=0.005):
    """The barriers at the floors that d and c - c_m are taken at in flight, against the energy of the nominal start."""
    scenario = load("lander_nominal")
    law, plant = (scenario.graph.nodes[name].values for name in ("controller", "plant"))
    motion = motion_at_start(view(LanderPlantParameters.record(plant)[0], LanderPlantParameters.kinds))
    start = energy.lyapunov(law, law["mass"], *(np.array([part]) for part in motion[:4]))[0]
    found = {}
    for distance in (200.0, 20.0):
        level = law["terrain_gain"] / (1.0 + (law["terrain_radius"] / distance) ** 4) / clearance_floor
        found[f"terrain, {distance:g} m"] = level > start, f"{level:.0f} J of {start:.0f} J"
    level = law["view_gain"] * (1.0 - math.cos(law["view_half_angle"])) / view_floor
    found["view"] = level > start, f"{level:.0f} J of {start:.0f} J, at the largest"
    return found
