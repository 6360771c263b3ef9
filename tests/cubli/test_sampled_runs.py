"""The law sampled and held: reference numbers of an independent implementation, and which control rates hold.

"Holds" means: settled at the end and no sample outside either funnel. Adaptive gains by forward Euler, hard sign unless
said.
"""

import math

import numpy as np
import pytest

from tests.cubli.cubli_closed_loop import (
    ASTEROID,
    EARTH,
    EXPLICIT,
    IMPLICIT,
    LENGTH,
    MASS,
    MATCHED,
    TABLE_1,
    TABLE_2,
    WHEEL_INERTIA,
    run_sampled,
)

pytestmark = pytest.mark.xdist_group("the rover's loop")  # compiled once

FULL_INERTIA = MASS * LENGTH**2 * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3))) - WHEEL_INERTIA * np.eye(3)


def asteroid(rate, **options):
    return run_sampled(ASTEROID, TABLE_2, 60, rate, **({"phi": 0.0} | options))


def earth(rate, **options):
    return run_sampled(EARTH, TABLE_1, 6, rate, **({"phi": 0.0, "amplitude": 0.0} | options))


def settled(result):
    return np.abs(result["y"][:3]).max() < 0.01


def holds(result):
    return bool(settled(result)) and result["bad_samples"] == 0


def test_asteroid_at_100_hz():
    result = asteroid(100, phi=0.01)
    assert result["rate_axis"] == pytest.approx(0.09874, rel=2e-4)
    assert result["effort"] == pytest.approx(1.2461e-5, rel=2e-4)
    assert result["settling"] == pytest.approx(7.43, abs=0.0101)  # on a grid of 0.01 s


def test_asteroid_at_10_khz_is_continuous_to_the_reference_tolerance():
    """Explicit, phi = 0.01, against the continuous reference numbers."""
    result = asteroid(10_000, phi=0.01)
    expected = {
        "xi_u": 0.8698966, "xi_a": 0.8811845, "rate_axis": 0.0986265, "torque": 1.954717e-3, "effort": 1.242176e-5,
        "effort_20": 8.0197e-6,
    }  # fmt: skip
    for name, value in expected.items():
        assert result[name] == pytest.approx(value, rel=1e-4), name
    assert abs(result["rate_norm"] - 0.1397) < 2e-4
    assert abs(result["settling"] - 7.431) < 0.002
    assert abs(result["normal_min"] + 0.809) < 0.002
    assert abs(result["lift_first"] - 1.389) < 0.003
    assert abs(result["lift_last"] - 3.219) < 0.003
    np.testing.assert_allclose(result["v_a"], [0.054736, 0.049177, 0.055817], rtol=1e-4)
    np.testing.assert_allclose(result["v_u"], [0.101801, 0.110062, 0.103419], rtol=1e-4)


def test_earth_at_100_khz_is_continuous_to_2e_3():
    result = earth(100_000, phi=0.01)
    expected = {"xi_a": 0.8295969, "xi_u": 0.9972863, "rate_axis": 0.6042225, "torque": 1.349361, "effort": 0.8941429}
    for name, value in expected.items():
        assert result[name] == pytest.approx(value, rel=2e-3), name
    assert abs(result["settling"] - 1.460) < 0.002
    np.testing.assert_allclose(result["v_u"], [0.497620, 0.299411, 0.198220], rtol=2e-3)


@pytest.mark.parametrize("form", [EXPLICIT, IMPLICIT])
@pytest.mark.parametrize("rate", [20, 100, 1000])
def test_every_law_holds_on_the_asteroid(rate, form):
    for sign in (1.0, -1.0) if form == EXPLICIT else (1.0,):
        assert holds(asteroid(rate, form=form, sign=sign))


@pytest.mark.parametrize(
    ("rate", "sign", "expected"),
    [(1000, 1.0, False), (10_000, 1.0, False), (11_000, 1.0, False), (12_500, 1.0, True), (20_000, 1.0, True),
     (8_000, -1.0, False), (10_000, -1.0, True)],
)  # fmt: skip
def test_earth_explicit_needs_a_fast_loop(rate, sign, expected):
    assert holds(earth(rate, sign=sign)) is expected


@pytest.mark.parametrize(("rate", "xi_u"), [(50, None), (60, 0.980), (100, 0.957), (200, 0.954), (1000, 0.950)])
def test_earth_explicit_with_gravity_feed_forward(rate, xi_u):
    result = earth(rate, feed_forward=1.0)
    assert holds(result) is (xi_u is not None)
    if xi_u is not None:
        assert result["xi_u"] == pytest.approx(xi_u, abs=6e-4)


@pytest.mark.parametrize(
    ("rate", "xi_u"),
    [(50, 4.5), (100, 2.5), (200, 1.70), (500, 1.27), (1000, 1.13), (2000, 1.06), (5000, 1.023), (10_000, 1.010)],
)
def test_earth_implicit_stays_up_but_leaves_the_funnel(rate, xi_u):
    result = earth(rate, form=IMPLICIT)
    assert settled(result)
    assert result["xi_u"] == pytest.approx(xi_u, rel=5e-3)


@pytest.mark.parametrize(
    ("rate", "xi_u"), [(50, 1.05), (60, 1.009), (70, None), (100, 0.946), (200, 0.942), (500, 0.947), (1000, 0.948)]
)
def test_earth_implicit_with_gravity_feed_forward(rate, xi_u):
    result = earth(rate, form=IMPLICIT, feed_forward=1.0)
    assert settled(result)
    assert holds(result) is (rate >= 70)
    if xi_u is not None:
        assert result["xi_u"] == pytest.approx(xi_u, rel=1e-2)


@pytest.mark.parametrize(
    ("rate", "feed_forward", "xi_u"), [(50, 0.0, 5.9), (100, 0.0, 2.9), (50, 1.0, 1.08), (100, 1.0, 0.965)]
)
def test_earth_cap_matched_to_the_period(rate, feed_forward, xi_u):
    result = earth(rate, form=MATCHED, feed_forward=feed_forward)
    assert settled(result)
    assert result["xi_u"] == pytest.approx(xi_u, rel=5e-3)


KICK = {"kick_time": 20.0}


@pytest.mark.parametrize("size", [0.01, 0.05, 0.2])
def test_kick_out_of_the_funnel(size):
    """A rate step of (1, -1, 1) size [rad/s] at 20 s: the printed law tumbles, the implicit one is back soon."""
    kick = (size, -size, size)
    assert not settled(asteroid(100, form=EXPLICIT, kick=kick, **KICK))
    for form in (MATCHED, IMPLICIT):
        result = asteroid(100, form=form, kick=kick, **KICK)
        assert settled(result)
        assert 1 <= result["bad_samples"] <= 2
    assert result["torque"] == pytest.approx({0.01: 0.0097, 0.05: 0.065, 0.2: 0.275}[size], rel=1e-2)


def test_kick_with_limited_torque_and_frozen_adaptation():
    result = asteroid(100, form=IMPLICIT, kick=(0.2, -0.2, 0.2), torque_limit=0.02, **KICK)
    assert settled(result)
    assert result["overshoot"] == pytest.approx(4.7, rel=2e-2)


def test_start_outside_the_funnel():
    """Without widening rho_a the implicit law demands 17.5 N m; with it, 2.7e-3 N m and 0.162 rad/s."""
    alone = asteroid(100, form=IMPLICIT, start=(-0.5, 0.5, 0.5))
    assert alone["torque"] == pytest.approx(17.5, rel=5e-3)
    assert alone["rate_axis"] == pytest.approx(13.0, rel=2e-2)
    widened = asteroid(100, form=IMPLICIT, start=(-0.5, 0.5, 0.5), rearm=1)
    assert settled(widened)
    assert widened["torque"] == pytest.approx(2.7e-3, rel=2e-2)
    assert widened["rate_axis"] == pytest.approx(0.162, rel=5e-3)


def wheeled(rate, **options):
    return asteroid(rate, physical=1, torque_limit=0.02, speed_limit=628.0, **options)


def test_physical_rover_needs_its_full_inertia():
    assert not settled(wheeled(100))
    slow = wheeled(1000)
    assert holds(slow)
    assert slow["xi_u"] == pytest.approx(0.978, abs=6e-4)
    assert slow["settling"] == pytest.approx(9.03, abs=0.01)
    assert slow["overshoot"] == pytest.approx(7.8, rel=1e-2)
    full = wheeled(100, model=FULL_INERTIA)
    assert holds(full)
    assert full["xi_a"] == pytest.approx(0.879, abs=6e-4)
    assert full["xi_u"] == pytest.approx(0.870, abs=6e-4)
    assert full["settling"] == pytest.approx(7.40, abs=0.0101)
    assert full["overshoot"] == pytest.approx(1.47, abs=0.01)
    assert full["effort"] == pytest.approx(1.138e-4, rel=1e-3)
    assert full["torque"] == pytest.approx(8.2e-3, rel=5e-3)
    assert full["wheel_speed"] == pytest.approx(7.6, rel=1e-2)
    implicit = wheeled(100, model=FULL_INERTIA, form=IMPLICIT, feed_forward=1.0)
    assert holds(implicit)
    assert implicit["effort"] == pytest.approx(1.09e-4, rel=2e-3)
    assert implicit["settling"] == pytest.approx(7.40, abs=0.0101)


def test_physical_rover_with_phased_disturbance():
    result = wheeled(100, model=FULL_INERTIA, phase=(0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0))
    assert holds(result)
    assert result["settling"] == pytest.approx(6.64, abs=0.0101)
    assert result["normal_min"] == pytest.approx(-1.06, abs=5e-3)


def test_physical_rover_on_earth():
    implicit = earth(1000, physical=1, model=FULL_INERTIA, form=IMPLICIT, feed_forward=1.0)
    assert settled(implicit)
    assert implicit["torque"] == pytest.approx(1.44, rel=3e-3)
    assert implicit["wheel_speed"] == pytest.approx(509.0, rel=2e-3)
    assert implicit["xi_u"] == pytest.approx(1.011, abs=6e-4)
    assert implicit["bad_samples"] == 45
    explicit = earth(1000, physical=1, model=FULL_INERTIA)
    assert holds(explicit)
    assert explicit["xi_u"] == pytest.approx(0.992, abs=6e-4)
    assert explicit["torque"] == pytest.approx(2.45, rel=3e-3)
    assert explicit["wheel_speed"] == pytest.approx(665.0, rel=1e-3)


@pytest.mark.parametrize(("torque", "recovers", "falls"), [(0.2, 0.04, 0.05), (0.5, 0.10, 0.12), (1.0, 0.20, 0.25)])
def test_recoverable_attitude_on_earth(torque, recovers, falls):
    options = {"physical": 1, "model": FULL_INERTIA, "form": IMPLICIT, "feed_forward": 1.0}
    for a, expected in ((recovers, True), (falls, False)):
        result = earth(1000, torque_limit=torque, speed_limit=628.0, start=(-a, a, a), **options)
        assert settled(result) == expected
