"""Contact with the ground: limits of eq. (9), and the corner force against an independent momentum balance."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from cubli_ros import jump_condition
from flight_math import Vec3, largest, norm, same


def test_rate_limits():
    """Reference values at g = 0.002 and 9.8 m/s^2, l = 0.2 m."""
    assert abs(jump_condition.planar_rate_limit(0.002, 0.2, 1.0) - 0.1189207) < 1e-7
    assert abs(jump_condition.corner_rate_limit(0.002, 0.2, 1.0) - 0.1074570) < 1e-7
    assert abs(jump_condition.planar_rate_limit(9.8, 0.2, 1.0) - 8.3244) < 1e-4
    assert abs(jump_condition.corner_rate_limit(9.8, 0.2, 1.0) - 7.5220) < 1e-4
    assert jump_condition.planar_rate_limit(0.002, 0.2, -0.1) == 0.0
    assert jump_condition.corner_rate_limit(0.002, 0.2, 0.0) == 0.0


def test_rates():
    omega = Vec3(0.1, -0.4, 0.2)
    diagonal = np.ones(3) / math.sqrt(3.0)
    assert largest(abs(omega)) == 0.4
    assert math.isclose(norm(omega), np.linalg.norm(omega))
    across = np.array(omega) - diagonal * (np.array(omega) @ diagonal)
    assert math.isclose(jump_condition.rate_across_diagonal(omega), np.linalg.norm(across))


def test_tilt():
    gravity = Vec3(0.0, 0.0, -2.0)
    alpha = math.radians(10.0)
    normal = Vec3(math.sin(alpha), 0.0, math.cos(alpha))
    assert math.isclose(jump_condition.cosine_of_tilt(gravity, normal), math.cos(alpha))
    assert jump_condition.cosine_of_tilt(same(0.0), normal) == 0.0


def test_standing_still_on_a_slope():
    """At rest the ground carries the weight: normal cos(alpha), tangential sin(alpha), friction ratio tan(alpha)."""
    alpha = 0.2  # [rad]
    gravity = Vec3(-math.sin(alpha), 0.0, -math.cos(alpha)) * 0.002
    up = Vec3(0.0, 0.0, 1.0)
    normal, tangential, ratio = jump_condition.contact(same(0.0), same(0.0), gravity, up, 0.2)
    assert math.isclose(normal, math.cos(alpha))
    assert math.isclose(tangential, math.sin(alpha))
    assert math.isclose(ratio, math.tan(alpha))


def test_force_is_the_centre_of_mass_acceleration():
    """Against a numerical second derivative of the centre's path R(t) r for a prescribed rotation."""
    r = np.full(3, 0.1)
    gravity = np.array([0.3, -0.2, -1.5])  # [m/s^2] balance frame
    up = np.array([0.1, 0.2, 1.0]) / math.sqrt(1.05)

    def rotation(t):
        return Rotation.from_euler("XYZ", [0.2 + 0.5 * t, -0.3 * t + 0.4 * t * t, 0.6 * t])

    step = 1e-3  # [s]
    times = step * np.arange(-3, 4)
    path = np.array([rotation(t).apply(r) for t in times])
    acceleration = np.array([2, -27, 270, -490, 270, -27, 2]) @ path / (180.0 * step * step)
    here = rotation(0.0)

    def rate(t):
        return (rotation(t).inv() * rotation(t + 1e-4)).as_rotvec() / 1e-4

    omega = 0.5 * (rate(0.0) + rate(-1e-4))
    omega_dot = (rate(0.0) - rate(-1e-4)) / 1e-4
    force = acceleration - gravity
    weight = np.linalg.norm(gravity)
    normal, tangential, ratio = jump_condition.contact(
        Vec3(*omega), Vec3(*omega_dot), Vec3(*here.inv().apply(gravity)), Vec3(*here.inv().apply(up)), 0.2
    )
    expected = force @ up
    assert math.isclose(normal, expected / weight, rel_tol=1e-5)
    assert math.isclose(tangential, np.linalg.norm(force - expected * up) / weight, rel_tol=1e-5)
    assert math.isclose(ratio, tangential / normal)


def test_lost_contact_has_a_finite_friction_ratio():
    omega = Vec3(1.0, -1.0, 0.0)  # [rad/s] far beyond the limit at this gravity
    gravity = same(-0.002 / math.sqrt(3.0))
    normal, _, ratio = jump_condition.contact(omega, same(0.0), gravity, same(1.0 / math.sqrt(3.0)), 0.2)
    assert normal < 0.0
    assert ratio == jump_condition.LOST_CONTACT_RATIO
    # Planar case: the centripetal acceleration |omega|^2 r is all that lifts
    assert math.isclose(normal, 1.0 - 2.0 * 0.1 * math.sqrt(3.0) / 0.002)
