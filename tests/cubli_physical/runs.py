"""Runs of the physical plant for the tests, and mechanics written a second time in NumPy and SciPy.

Site frame: z up, the balance frame's diagonal [1, 1, 1] / sqrt(3) turned into it the shortest way.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from papers.appc import metrics

MASS, LENGTH, WHEEL = 2.0, 0.2, 1.0e-3  # [kg], [m], [kg m^2]
CENTRE_INERTIA = MASS * LENGTH**2 / 6.0  # [kg m^2]
THETA = MASS * LENGTH**2 * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))  # [kg m^2]
SITE_FROM_BALANCE = Rotation.from_rotvec(math.acos(1.0 / math.sqrt(3.0)) * np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0))
IDLE = {"controller.torque_limit": 1e-15, "plant.disturbance_amplitude": 0.0}  # nothing acts but gravity and ground
SCALAR = (CENTRE_INERTIA * np.eye(3)).ravel().tolist()
FULL = (THETA - WHEEL * np.eye(3)).ravel().tolist()


class Run:
    """A finished run: t, truth and contact records, the attitude (body to site), metrics."""

    def __init__(self, scenario="cubli_physical", **settings):
        overrides = {"controller.rearm": True}
        for key, value in settings.items():
            overrides[key.replace("__", ".")] = value
        self.scenario = load(scenario, overrides)
        recording = CompiledRun(self.scenario).run()
        self.truth, self.contact = recording["cubli/truth"], recording["cubli/truth/contact"]
        self.funnel = recording["cubli/funnel"]
        self.t = metrics.seconds(self.truth, self.scenario)
        self.attitude = SITE_FROM_BALANCE * Rotation.from_quat(recording["cubli/truth/attitude"]["orientation"])
        self.metrics = metrics.compute(self.scenario, recording)

    @property
    def omega(self):
        return self.truth["rates"]

    def phase(self, value):
        return self.contact["phase"] == value

    def spin_momentum(self):
        """Angular momentum about the centre (n, 3), site frame: I omega + J_w Omega."""
        return self.attitude.apply(CENTRE_INERTIA * self.omega + WHEEL * self.truth["wheel_speed"])

    def energy(self, gravity=0.002):
        """Kinetic energy of body and wheels, and potential energy of the centre [J] (n,)."""
        wheel = self.truth["wheel_speed"]
        turning = (0.5 * CENTRE_INERTIA * self.omega**2 + WHEEL * (self.omega + 0.5 * wheel) * wheel).sum(axis=1)
        moving = 0.5 * MASS * (self.contact["centre_velocity"] ** 2).sum(axis=1)
        return turning + moving + MASS * gravity * self.contact["centre"][:, 2]


def normal_of(tilt, azimuth):
    return np.array([math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), math.cos(tilt)])


def run(scenario="cubli_physical", settings=None, **more):
    """A run with ``component.parameter`` settings and more of them as component__parameter."""
    flat = {key.replace(".", "__"): value for key, value in (settings or {}).items()}
    return Run(scenario, **{**flat, **more})
