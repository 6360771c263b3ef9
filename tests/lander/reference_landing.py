"""The reference landing of the tests: an Eros-like ellipsoid, its site, vehicle, law and start."""

import math
from types import SimpleNamespace

import numpy as np

from flight_math import Quaternion, Vec3, plain, view
from lander_ros.feed_forward import feed_forward
from lander_ros.landing_law import LandingLaw, landing_law, lyapunov
from lander_ros.pose_pd import PosePd, pose_pd
from lander_ros.potential import potential
from sim_nodes.gravity.ellipsoid import EROS_LIKE_SPIN, ellipsoid_site, eros_like
from sim_nodes.lander.descent import Watch, fly, planned
from sim_nodes.lander.dynamics import Motion, Truth, motor, require_truth, site_gravity
from sim_nodes.lander.start import approach_attitude


def record(parameters, **values):
    """What a kernel takes: a view of a record of the defaults, with some values changed."""
    return view(parameters.record(values)[0], parameters.kinds)


def start_motion(r, v, q, w):
    """Motion of position [m], velocity [m/s] in D, attitude x, y, z, w, and rates [deg/s]."""
    return Motion(Vec3(*r), Vec3(*v), Quaternion(*q), Vec3(*np.radians(w)), 500.0)


def numbers(motion):
    """The fourteen numbers of a motion: r, v, q, w, mass."""
    return np.array([*motion.position, *motion.velocity, *motion.attitude, *motion.rates, motion.mass])


def matrix(value):
    """A Mat3 as an array (3, 3)."""
    return np.reshape(value.parts(), (3, 3))


def reference_landing():
    """Body, site, truth, law, start, and what flies and evaluates them, as a namespace."""
    body, law = eros_like(), record(LandingLaw)
    place = SimpleNamespace(semi_axes=body.semi_axes, site_latitude=math.radians(25.0),
                            site_longitude=math.radians(40.0), site_height=1.5)
    rho, rotation = plain(ellipsoid_site)(place)
    truth = Truth(body.mu, body.semi_axes, EROS_LIKE_SPIN, law.inertia, rotation, rho)
    require_truth(truth)
    r0 = Vec3(-900.0, 450.0, 340.0)  # [m]
    q0 = approach_attitude(r0, math.radians(25.0), math.radians(18.0), math.radians(30.0))
    start = start_motion(r0, [0.3, -0.2, 0.1], q0, [0.2, -0.1, 0.15])

    def fly_law(changes=(), start=start, watch=Watch(), **times):
        return fly(landing_law, record(LandingLaw, **dict(changes)), truth, start, planned(**times), watch)

    def fly_pd(changes=(), **times):
        return fly(pose_pd, record(PosePd, **dict(changes)), truth, start, planned(**times), Watch())

    def evaluate(motion, p=law):
        """Law, potential and model gravity at a motion, as a namespace."""
        at = SimpleNamespace(r=motion.position, q=motion.attitude, motor=motor(motion))
        at.g = site_gravity(truth, truth, at.r)
        at.wrench, at.clipped = landing_law(p, at.r, at.q, at.motor, at.g)
        at.forward = feed_forward(p, at.r, at.q, at.g)
        terms, at.d, at.c, at.gradient = potential(p, at.r, at.q)
        at.U = sum(terms)
        at.L = lyapunov(p, at.U, at.motor)
        return at

    return SimpleNamespace(body=body, rho=rho, rotation=rotation, law=law, truth=truth, r0=r0, q0=q0, start=start,
                           fly_law=fly_law, fly_pd=fly_pd, evaluate=evaluate)
