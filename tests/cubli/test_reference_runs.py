"""The law in continuous time against reference numbers.

The numbers come from an independent implementation of Aerospace 2022, 9(11), 728 (stiff solvers for the Earth and
asteroid runs); initial attitude (-0.3, 0.3, 0.3) rad at rest. Asteroid: Table 2, g = 0.002 m/s^2, d = 0.02 sin(t)
rad/s^2 on all axes, 60 s. Earth: Table 1, no disturbance, 6 s. Tolerance 1e-4 relative where nothing else is said.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.cubli.cubli_closed_loop import (
    ASTEROID,
    BACKSTEPPING,
    EARTH,
    PD,
    START,
    TABLE_1,
    TABLE_2,
    run_continuous,
    slowed,
)

pytestmark = pytest.mark.xdist_group("the rover's loop")  # compiled once

PLANAR_LIMIT, CORNER_LIMIT = 0.1189207, 0.1074570  # [rad/s] at g = 0.002


@pytest.fixture(scope="module")
def asteroid():
    return run_continuous(ASTEROID, TABLE_2, 60, 1e-3)


@pytest.fixture(scope="module")
def earth():
    return run_continuous(EARTH, TABLE_1, 6, 1e-5, amplitude=0.0)


def close(value, expected, tolerance=1e-4):
    assert value == pytest.approx(expected, rel=tolerance), (value, expected)


def test_initial_tilt():
    up = np.ones(3) / math.sqrt(3.0)
    tilt = math.acos(up @ Rotation.from_euler("XYZ", START).apply(up))
    assert abs(tilt - 0.4493) < 1e-4


@pytest.mark.parametrize(
    ("metric", "expected"),
    [
        ("xi_u_start", 0.8698966),
        ("xi_u", 0.8698966),
        ("xi_a", 0.8811845),
        ("rate_axis", 0.0986265),
        ("torque", 1.954717e-3),
        ("effort", 1.242176e-5),
        ("effort_20", 8.0197e-6),
    ],
)
def test_asteroid(asteroid, metric, expected):
    close(asteroid[metric], expected)


def test_asteroid_settling_and_contact(asteroid):
    assert abs(asteroid["settling"] - 7.431) <= 0.002
    assert abs(asteroid["rate_norm"] - 0.1397) < 2e-4
    assert abs(asteroid["normal_min"] + 0.809) < 0.002
    assert abs(asteroid["lift_first"] - 1.389) < 0.003
    assert abs(asteroid["lift_last"] - 3.219) < 0.003
    assert abs(asteroid["over_first"] - 0.895) < 0.002
    assert abs(asteroid["over_last"] - 2.364) < 0.002
    close(asteroid["across_time"], 1.59, 0.005)
    close(asteroid["slip_time"], 7.6, 0.01)
    close(asteroid["overshoot"], 1.37, 0.005)
    assert asteroid["bad_samples"] == 0


def test_asteroid_adaptive_gains(asteroid):
    np.testing.assert_allclose(asteroid["v_a"], [0.054736, 0.049177, 0.055817], rtol=1e-4)
    np.testing.assert_allclose(asteroid["v_u"], [0.101801, 0.110062, 0.103419], rtol=1e-4)


def test_asteroid_as_printed():
    """Sign -1 (hanging): the same largest xi_u, at the start."""
    result = run_continuous(ASTEROID, TABLE_2, 60, 1e-3, sign=-1.0)
    close(result["xi_u"], 0.8698966)
    close(result["xi_u_start"], 0.8698966)
    assert result["bad_samples"] == 0


def test_no_jump_claim_holds_per_axis_only(asteroid):
    assert asteroid["rate_axis"] / PLANAR_LIMIT == pytest.approx(0.829, abs=1e-3)
    assert asteroid["rate_norm"] / PLANAR_LIMIT == pytest.approx(1.175, abs=1e-3)
    assert asteroid["rate_across"] / CORNER_LIMIT == pytest.approx(1.20, abs=2e-3)
    assert asteroid["normal_min"] < 0.0


def test_earth(earth):
    close(earth["xi_a"], 0.8295969)
    close(earth["xi_u"], 0.9972863)
    close(earth["rate_axis"], 0.6042225)
    close(earth["torque"], 1.349361)
    close(earth["effort"], 0.8941429)
    assert abs(earth["settling"] - 1.460) <= 0.002
    np.testing.assert_allclose(earth["v_u"], [0.497620, 0.299411, 0.198220], rtol=1e-4)
    close(earth["fastest_loop"], 49087.0, 1e-3)
    assert earth["normal_min"] == pytest.approx(0.156, abs=1e-3)


@pytest.mark.parametrize(
    ("frequency", "xi_a", "settling", "overshoot", "rate_axis", "effort"),
    [
        (0.1, 0.8802, 8.442, 2.05, 0.1031, 1.182e-5),
        (0.5, 0.8807, 7.347, 1.51, 0.1004, 1.169e-5),
        (1.0, 0.8812, 7.431, 1.37, 0.0986, 1.248e-5),
        (2.0, 0.8816, 7.131, 0.85, 0.1005, 1.309e-5),
    ],
)
def test_disturbance_frequency(frequency, xi_a, settling, overshoot, rate_axis, effort):
    result = run_continuous(ASTEROID, TABLE_2, 60, 2e-3, phi=0.0, frequency=frequency)
    close(result["xi_a"], xi_a, 2e-4)
    close(result["settling"], settling, 1e-3)
    assert result["overshoot"] == pytest.approx(overshoot, abs=0.01)
    close(result["rate_axis"], rate_axis, 1e-3)
    close(result["effort"], effort, 2e-3)
    assert result["bad_samples"] == 0


@pytest.mark.parametrize(
    ("kappa", "planar", "corner", "normal", "xi_a", "xi_u", "settling", "effort"),
    [
        (0.85, 0.981, 1.008, -0.289, 0.8823, 0.8715, 9.68, 1.21e-5),
        (0.80, 0.917, 0.945, -0.138, 0.8828, 0.8772, 10.07, 1.22e-5),
        (0.75, 0.854, 0.882, 0.002, 0.8834, 0.8835, 10.41, 1.24e-5),
        (0.70, 0.792, 0.820, 0.129, 0.8840, 0.8903, 10.75, 1.27e-5),
        (0.50, 0.609, 0.569, 0.501, 0.8870, 0.9209, 16.56, 1.56e-5),
    ],
)
def test_slower_funnels_keep_the_rover_down(kappa, planar, corner, normal, xi_a, xi_u, settling, effort):
    """Table 2 in time slowed by kappa; the reference effort is that of 60 / kappa seconds."""
    result = run_continuous(ASTEROID, slowed(TABLE_2, kappa), 60.0 / kappa, 2e-3, phi=0.0)
    assert result["rate_norm"] / PLANAR_LIMIT == pytest.approx(planar, abs=6e-4)
    assert result["rate_across"] / CORNER_LIMIT == pytest.approx(corner, abs=6e-4)
    assert result["normal_min"] == pytest.approx(normal, abs=6e-4)
    close(result["xi_a"], xi_a, 2e-4)
    close(result["xi_u"], xi_u, 2e-4)
    close(result["settling"], settling, 1e-3)
    close(result["effort"], effort, 5e-3)


def with_rows(**rows):
    names = "rho_a0 rho_a_inf l_a lambda_a k_a eta_a rho_u0 rho_u_inf l_u lambda_u k_u eta_u".split()
    gains = TABLE_2.copy()
    for name, value in rows.items():
        gains[names.index(name)] = value
    return gains


CASES = {
    "gains 2": (with_rows(lambda_a=0.029, lambda_u=0.029, eta_a=0.0035, eta_u=0.0035), 0.9188, 0.9331, 9.072, 1.380e-5),
    "gains 3": (with_rows(lambda_a=0.046, lambda_u=0.046, eta_a=0.006, eta_u=0.006), 0.8651, 0.9760, 7.250, 1.292e-5),
    "bounds 2": (with_rows(rho_a0=0.5, rho_a_inf=0.01, rho_u0=0.2, rho_u_inf=0.01), 0.9186, 0.9405, 9.859, 1.789e-5),
    "bounds 3": (with_rows(l_a=-0.35, l_u=-0.35), 0.8908, 0.8977, 6.804, 1.501e-5),
}


@pytest.mark.parametrize("case", CASES)
def test_parameter_cases_of_section_5_3(case):
    gains, xi_a, xi_u, settling, effort = CASES[case]
    result = run_continuous(ASTEROID, gains, 60, 1e-3, phi=0.0)
    close(result["xi_a"], xi_a, 2e-4)
    close(result["xi_u"], xi_u, 2e-4)
    close(result["settling"], settling, 3e-4)
    close(result["effort"], effort, 1e-3)


def test_proportional_derivative_baseline():
    result = run_continuous(ASTEROID, with_rows(lambda_a=1.0, lambda_u=1.0), 60, 1e-3, kind=PD)
    close(result["rate_axis"], 0.162016)
    close(result["effort"], 3.5131e-5)
    close(result["effort_20"], 2.644e-5)
    close(result["rate_norm"], 0.2640, 2e-4)
    close(result["overshoot"], 19.24, 1e-3)
    close(result["tail"], 2.01e-2, 3e-3)
    assert result["settling"] >= 59.0  # never
    assert result["normal_min"] == pytest.approx(-4.66, abs=0.005)


def test_backstepping_baseline():
    result = run_continuous(ASTEROID, with_rows(lambda_a=1.0, lambda_u=2.0), 60, 1e-3, kind=BACKSTEPPING)
    close(result["rate_axis"], 0.2485, 5e-4)
    close(result["effort"], 7.938e-5, 5e-4)
    close(result["effort_20"], 7.342e-5, 5e-4)
    close(result["torque"], 1.550e-2, 1e-3)
    close(result["overshoot"], 2.01, 5e-3)
    close(result["tail"], 5.57e-3, 2e-3)
    assert abs(result["settling"] - 2.671) <= 0.002
    assert result["normal_min"] == pytest.approx(-10.26, abs=0.01)


@pytest.mark.parametrize(
    ("kind", "first", "second", "metric", "expected"),
    [
        (PD, 0.3, 1.0, "effort", 7.16e-6),  # less than APPC
        (PD, 2.0, 3.0, "settling", 4.59),
        (BACKSTEPPING, 4.0, 8.0, "overshoot", 0.195),  # less than APPC
        (BACKSTEPPING, 4.0, 8.0, "tail", 5.9e-4),
    ],
)
def test_ranking_depends_on_the_baselines_gains(kind, first, second, metric, expected):
    result = run_continuous(ASTEROID, with_rows(lambda_a=first, lambda_u=second), 60, 1e-3, kind=kind)
    close(result[metric], expected, 1e-2)
