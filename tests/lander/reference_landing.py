"""The reference landing of the tests: an Eros-like ellipsoid, its site, vehicle, law and start."""

import math
from types import SimpleNamespace

import numpy as np

from lander_ros.landing_law import LandingLaw, landing_law, lyapunov
from lander_ros.pose_pd import PosePd, pose_pd
from lander_ros.potential import potential
from sim_nodes.ellipsoid_gravity import EROS_LIKE_SPIN, ellipsoid_site, eros_like
from sim_nodes.lander_descent import fly
from sim_nodes.lander_dynamics import approach_attitude, body_velocity, lander_plant, site_gravity


def record(parameters, **values):
    """What a kernel takes: a record of the defaults, with some values changed."""
    return parameters.record(values).view(np.recarray)[0]


def start_state(r, v, q, w):
    """State (14,) of position [m], velocity [m/s] in D, attitude x, y, z, w, and rates [deg/s]."""
    return np.array([*r, *v, *q, *np.radians(w), 500.0])


def reference_landing():
    """Body, site, plant, law, start, and what flies and evaluates them, as a namespace."""
    body = eros_like()
    rho, rotation = ellipsoid_site(body.semi_axes, math.radians(25.0), math.radians(40.0), 1.5)
    law = record(LandingLaw)
    plant = lander_plant(law.inertia, rotation, rho, EROS_LIKE_SPIN)
    r0 = np.array([-900.0, 450.0, 340.0])  # [m]
    q0 = approach_attitude(r0, math.radians(25.0), math.radians(18.0), math.radians(30.0))
    state = start_state(r0, [0.3, -0.2, 0.1], q0, [0.2, -0.1, 0.15])

    def fly_law(changes=(), **options):
        law = record(LandingLaw, **dict(changes))
        return fly(landing_law, law, body, plant, options.pop("state", state), **options)

    def fly_pd(changes=(), **options):
        return fly(pose_pd, record(PosePd, **dict(changes)), body, plant, state, **options)

    def evaluate(state, p=law):
        """Law, potential and model gravity at a state, as a namespace."""
        at = SimpleNamespace(
            g=np.zeros(3), alpha=np.zeros(3), gradient=np.zeros(6), force=np.zeros(3), torque=np.zeros(3)
        )
        work = np.zeros((3, 3))
        at.r, at.q, at.w = state[0:3].copy(), state[6:10].copy(), state[10:13].copy()
        site_gravity(body, plant, state, at.g)
        body_velocity(state, np.zeros((3, 3)), at.alpha)
        at.clipped = landing_law(p, at.r, at.q, at.alpha, at.w, at.g, work, at.gradient, at.force, at.torque)
        *terms, at.d, at.c = potential(p, at.r, at.q, work, np.zeros(6))
        at.U = sum(terms)
        at.L = lyapunov(p, at.U, at.alpha, at.w)
        return at

    return SimpleNamespace(
        body=body,
        rho=rho,
        rotation=rotation,
        law=law,
        plant=plant,
        r0=r0,
        q0=q0,
        state=state,
        fly_law=fly_law,
        fly_pd=fly_pd,
        evaluate=evaluate,
    )
