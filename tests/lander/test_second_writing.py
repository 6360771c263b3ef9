"""What the claims of the landing are judged by, against numbers by hand, closed forms and SciPy.

The Lyapunov function, the rigid body, the algebra of twistors and the lines of Appendix B are written for the claims alone
(papers/lander); here they are held against what does not come from this project.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lander_ros.landing_law import LandingLaw
from papers.lander import appendix_b, energy, identities, motion, rigid_body
from papers.lander import twistor_algebra as algebra
from papers.lander.appendix_b import State

LAW = LandingLaw.defaults()
STILL = np.zeros((1, 3))


def potential(r, rotation):
    return energy.potential(LAW, np.array([r], float), rotation.as_quat()[None])[0]


@pytest.mark.parametrize(("tilt", "turn", "expected"), [
    (0.0, 0.0, 2483.184 + 117.745),  # 1225 (sqrt(1 + (100/35)^2) - 1); 13500/1.1296/101.5
    (0.0, 90.0, 2483.184 + 117.745 + 2.745),  # 16 tan^2(22.5 deg)
    (20.0, 0.0, 2483.184 + 117.745 + 0.1225 + 1.5970),  # 16 tan^2(5 deg); 2 (9975/10100)^2 0.060307/0.073667
])
def test_potential_on_the_axis_by_hand(tilt, turn, expected):
    """100 m above the site, tilted about x, or turned about z [deg]."""
    rotation = Rotation.from_euler("x", tilt, degrees=True) * Rotation.from_euler("z", turn, degrees=True)
    assert potential([0.0, 0.0, 100.0], rotation) == pytest.approx(expected, abs=2e-3)


def test_terrain_term_off_the_axis_by_hand():
    """At (100, -50, 80) m: d = 81.5 - [27 (10000 + 3000 + 100)]^(1/3) + 2700^(1/3) = 24.704 m, r^2 = 18900 m^2."""
    r = np.array([[100.0, -50.0, 80.0]])
    expected = 13500.0 / (1.0 + (3600.0 / 18900.0) ** 2) / 24.704316
    assert energy.terrain(LAW, r, np.linalg.norm(r, axis=1))[0] == pytest.approx(expected, rel=1e-7)


def test_kinetic_terms_and_damping_by_hand():
    law = {**LAW, "force_weight": 2.0, "torque_weight": 3.0}
    r, q, v, w = np.array([[0.0, 0.0, 100.0]]), np.array([[0.0, 0.0, 0.0, 1.0]]), np.array([[0.0, 2.0, 0.0]]), STILL + 1.0
    kinetic = energy.lyapunov(law, 500.0, r, v, q, w) - energy.lyapunov(law, 500.0, r, STILL, q, STILL)
    assert kinetic[0] == pytest.approx(2.0 * 0.5 * 500.0 * 4.0 + 3.0 * 0.5 * (120 + 100 + 140 + 2 * (2 - 3 + 1.5)))
    assert energy.dissipated(law, v, w)[0] == 2.0 * 45.0 * 4.0 + 3.0 * 60.0 * 3.0


def test_start_of_the_nominal_landing(reference):
    """U and L of the reference start are numbers of an independent implementation."""
    start = reference.start
    r, q, v, w = (np.array([part]) for part in (start.position, start.attitude, start.velocity, start.rates))
    assert energy.potential(LAW, r, q)[0] == pytest.approx(36240.5615, abs=1e-3)
    assert energy.lyapunov(LAW, 500.0, r, v, q, w)[0] == pytest.approx(36275.5628, abs=1e-3)


BODY = rigid_body.Body(500.0, np.diag([100.0, 100.0, 150.0]), 446300.0, np.array([0.0, 0.0, 9000.0]),
                       np.array([1e-4, 2e-4, -3e-4]))


def flown(state, time, wrench=((0, 0, 0), (0, 0, 0)), dt=1.0):
    given = tuple(np.array(part, float) for part in wrench)
    for _ in range(round(time / dt)):
        state = rigid_body.step(lambda t, x: rigid_body.rate(BODY, t, x, lambda _: given), 0.0, state, dt)
    return state


def test_circular_orbit_is_one_in_the_turning_frame():
    """A craft on a circle of 10 km in I, after a quarter of Kepler's period, seen from the turned site."""
    radius = 10000.0
    speed, quarter = math.sqrt(446300.0 / radius), 0.5 * math.pi * math.sqrt(radius**3 / 446300.0)
    state = flown(np.array([radius, 0, 0, 0, speed, 0, 0, 0, 0, 1, 0, 0, 0]), quarter, dt=quarter / 200)
    np.testing.assert_allclose(state[0:6], [0, radius, 0, -speed, 0, 0], rtol=0, atol=1e-4)
    seen = rigid_body.relative(BODY, quarter, state)
    site = Rotation.from_rotvec(BODY.spin * quarter)
    np.testing.assert_allclose(seen.r, site.as_matrix().T @ [0, radius, 0] - BODY.place, rtol=0, atol=1e-4)
    np.testing.assert_allclose(seen.w, -BODY.spin, rtol=0, atol=1e-12)


def test_a_start_comes_back_and_its_velocity_is_that_of_the_turning_frame():
    start = rigid_body.Relative(np.array([30.0, -20.0, 50.0]), Rotation.from_rotvec([0.3, -0.5, 0.2]).as_quat(),
                                np.array([0.01, 0.02, -0.01]), np.array([0.3, 0.1, -0.2]))
    state = rigid_body.inertial(BODY, start)
    for found, given in zip(rigid_body.relative(BODY, 0.0, state), start):
        np.testing.assert_allclose(found, given, rtol=0, atol=1e-12)
    ahead, behind = (rigid_body.relative(BODY, t, rigid_body.step(
        lambda _, x: rigid_body.rate(BODY, 0.0, x, lambda _: (STILL[0], STILL[0])), 0.0, state, t)).r for t in (1e-2, -1e-2))
    velocity = Rotation.from_quat(start.q).apply(start.alpha)
    np.testing.assert_allclose((ahead - behind) / 2e-2, velocity, rtol=0, atol=1e-6)


def test_free_symmetric_top_precesses():
    """w_x + i w_y turns with ((J3 - J1)/J1) w_z about the axis of symmetry (Euler)."""
    state = np.array([1e9, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0.2, 0.0, 0.4])
    w = flown(state, 10.0, dt=0.05)[10:13]
    angle = (150.0 - 100.0) / 100.0 * 0.4 * 10.0
    np.testing.assert_allclose(w, [0.2 * math.cos(angle), 0.2 * math.sin(angle), 0.4], rtol=0, atol=1e-7)


def test_algebra_of_twistors_is_scipys():
    """b is the modified Rodrigues vector, and r^D, r^B are the position in the two frames."""
    random = np.random.default_rng(3)
    for rotation in Rotation.random(20, random):
        q = rotation.as_quat()
        q = q if q[3] >= 0.0 else -q
        r = random.normal(size=3)
        b = algebra.twistor_of(algebra.dual_of_pose(r, q))
        np.testing.assert_allclose(b[:3], rotation.as_mrp(), rtol=0, atol=1e-14)
        np.testing.assert_allclose(algebra.position(b), r, rtol=0, atol=1e-13)
        np.testing.assert_allclose(algebra.body_position(b), rotation.inv().apply(r), rtol=0, atol=1e-13)
        assert abs(algebra.cosine(b) - rotation.apply([0, 0, 1]) @ r / np.linalg.norm(r)) < 1e-13


def test_rate_of_a_twistor_is_that_of_the_moved_pose():
    r, turn = np.array([3.0, -2.0, 5.0]), Rotation.from_rotvec([0.4, 0.2, -0.3])
    w, alpha, h = np.array([0.3, -0.1, 0.2]), np.array([0.5, 0.4, -0.6]), 1e-5

    def moved(t):
        return algebra.twistor_of(algebra.dual_of_pose(r + t * turn.apply(alpha), (turn * Rotation.from_rotvec(t * w)).as_quat()))
    found = algebra.rate(moved(0.0), np.array([*w, 0.0, *alpha, 0.0]))
    np.testing.assert_allclose(found, (moved(h) - moved(-h)) / (2.0 * h), rtol=0, atol=1e-9)


def test_lines_of_appendix_b_by_hand():
    """w = e1, alpha = e2, eta = e3, zeta = 0, m = 1, p_eps q = 2, p q_eps = 3: V1' = -2 + 3, V2' = -3 + 2."""
    e1, e2, e3 = np.eye(3)
    s = State(3.0, 2.0, 1.0, 1.0, 1.0, np.diag([1.0, 2.0, 3.0]), e1, e2, np.zeros(3), e3)
    assert [*appendix_b.lines_1(s), appendix_b.first_line_1(s)] == pytest.approx([1.0] * 5)
    assert [*appendix_b.lines_2(s), appendix_b.first_line_2(s)] == pytest.approx([-1.0] * 4)
    # zeta = e3 and no eta: only the inertia's terms are left, 3 e1.(e3 x J e1) - 3 e1.J (e1 x e3) = 0 for J diagonal
    turned = s._replace(zeta=e3, eta=np.zeros(3), j=np.array([[1.0, 0.5, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 3.0]]))
    # e3 x J e1 = (-0.5, 1, 0): -1.5; J (e1 x e3) = -J e2 = (-0.5, -2, 0): +1.5
    assert appendix_b.lines_2(turned) == pytest.approx([0.0] * 3)
    assert appendix_b.lines_2(turned, 0.0)[-1] == pytest.approx(-1.5)


def test_limits_by_hand():
    """tan(359.9/4 deg) = 2292; f1's slope at 1 mm and gamma 1/3 is 0.018/0.0009 = 20; the floors' levels."""
    assert identities.bounded_for_every_attitude() == (False, "largest |b| 2292")
    found = identities.terrain_gradient_on_the_axis()
    assert found["gamma 1/3"] == (False, "df1/dx 20 at 1 mm, 200 at 1 um")  # rho^(-1/3)
    levels = motion.floors()
    assert levels["view"][1].startswith("54 J of 36276 J")  # 2 (1 - cos 30 deg)/0.005
    assert levels["terrain, 20 m"] == (False, "3293 J of 36276 J")  # 270000/(1 + 3^4)
