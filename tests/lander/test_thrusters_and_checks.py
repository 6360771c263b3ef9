"""Thruster limits, impulse bits and propellant; and the sentences a user gets before a landing starts."""

import math

import numpy as np
import pytest

from flight_math import DualVector, Vec3
from lander_ros.landing_checks import gain_warnings, require_start, require_vehicle, start_margins
from lander_ros.landing_law import LandingLaw
from lander_ros.pose_pd import PosePd
from sim_nodes.lander.start import approach_attitude
from sim_nodes.lander.thrusters import LanderThrusters, apply_thrusters
from tests.lander.reference_landing import record


def applied(thrusters, force, torque):
    wrench, flow = apply_thrusters(thrusters, DualVector(Vec3(*force), Vec3(*torque)))
    return flow, wrench.real, wrench.dual


def test_ideal_thrusters_only_limit():
    flow, force, torque = applied(LanderThrusters(), [50.0, -1e-9, -41.0], [3.0, -11.0, 0.0])
    np.testing.assert_array_equal(force, [40.0, -1e-9, -40.0])
    np.testing.assert_array_equal(torque, [3.0, -10.0, 0.0])
    assert flow == 0.0


def test_less_than_an_impulse_bit_is_not_delivered():
    thrusters = LanderThrusters(force_impulse_bit=0.05, torque_impulse_bit=0.02)  # [N s], [N m s]
    _, force, torque = applied(thrusters, [0.49, 0.51, -0.49], [0.19, -0.21, 0.0])
    np.testing.assert_array_equal(force, [0.0, 0.51, 0.0])
    np.testing.assert_array_equal(torque, [0.0, -0.21, 0.0])


def test_propellant_is_that_of_the_rocket_equation():
    thrusters = LanderThrusters(specific_impulse=220.0, torque_arm=0.5)  # [s], [m]
    flow, _, _ = applied(thrusters, [10.0, -20.0, 0.0], [1.0, 0.0, -2.0])
    assert flow == pytest.approx((30.0 + 3.0 / 0.5) / (220.0 * 9.80665))
    flow, _, _ = applied(thrusters._replace(torque_arm=0.0), [10.0, 0, 0], [5.0, 0, 0])
    assert flow == pytest.approx(10.0 / (220.0 * 9.80665))


def test_reference_gains_and_start_are_accepted(reference):
    require_vehicle(reference.law)
    require_start(reference.law, reference.r0, reference.q0)
    assert gain_warnings(reference.law, 5.03e-3, 0.1, 0.4) == []
    d, margin = start_margins(reference.law, reference.r0, reference.q0)
    assert d == pytest.approx(50.206074, abs=1e-5)
    assert math.degrees(margin) == pytest.approx(12.0, abs=1e-9)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"inertia": np.diag([1.0, 1.0, 3.0]).tolist()}, "no rigid body"),
        ({"inertia": np.diag([1.0, -1.0, 1.0]).tolist()}, "must all be > 0"),
        ({"inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "not symmetric"),
    ],
)
def test_a_vehicle_that_cannot_be_is_refused(values, words):
    with pytest.raises(ValueError, match=words):
        require_vehicle(record(PosePd, **values))


def test_a_mass_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match="mass"):
        record(LandingLaw, mass=0.0)


def test_a_start_in_the_funnel_or_without_the_site_is_refused_with_margins(reference):
    low = reference.r0 - Vec3(0.0, 0.0, 60.0)
    with pytest.raises(ValueError, match=r"keep-out funnel: clearance -9\.794 m"):
        require_start(reference.law, low, approach_attitude(low, 0.0, 0.1, 0.0))
    tilted = approach_attitude(reference.r0, 0.0, math.radians(31.0), 0.0)
    with pytest.raises(ValueError, match=r"site in view: .*31\.00 deg of at most 30\.00 deg"):
        require_start(reference.law, reference.r0, tilted)


def test_gains_that_must_saturate_are_named_with_numbers():
    p = record(LandingLaw, pull_gain=2.0, terrain_gain=10.0, angular_damping=3000.0)
    text = " | ".join(gain_warnings(p, 5e-3, 0.1, 0.0))
    assert "70.00 + 2.50 N is not below force_limit = 40.00 N" in text
    assert "absorbs 20.0 J" in text
    assert "2 J/D_w = 0.080 s of axis x" in text
