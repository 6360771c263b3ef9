"""APPC on the physical plant: reference numbers of an independent implementation, contact watched and not simulated.

Table 2, g = 0.002 m/s^2, a disturbing torque of m l^2 / 6 times 0.02 sin t, initial attitude (-0.3, 0.3, 0.3) rad at
rest, J_w = 1e-3 kg m^2. Tolerance 2 % where nothing else is said.
"""

import math

import pytest

from tests.cubli_physical.runs import FULL, LENGTH, MASS, SCALAR, run

HELD = {"plant.on_lift_off": "hold"}
PERPENDICULAR = [11.0 / 12.0 * MASS * LENGTH**2 * (i == j) for i in range(3) for j in range(3)]
FAST = {"plant.rate_hz": 1000, "controller.rate_hz": 1000}


def found(**settings):
    return run(settings={**HELD, **settings}).metrics


def close(value, expected, tolerance=0.02):
    assert value == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("settings", [{}, {"controller.inertia": FULL, "controller.smoothing": 0.01}])
def test_full_inertia(settings):
    result = found(**settings)
    close(result["xi_a_max"], 0.879, 2e-3)
    close(result["xi_u_max"], 0.870, 1e-3)
    close(result["settling_time_s"], 7.40, 5e-3)
    close(result["effort"], 1.138e-4, 0.01)
    close(result["torque_peak"], 8.2e-3)
    close(result["wheel_speed_max"], 7.6)
    assert result["overshoot_percent"] == pytest.approx(1.47, abs=0.1)
    assert result["normal_force_min"] == pytest.approx(-1.0, abs=0.05)
    assert result["rate_norm_max"] / result["limit_eq9"] == pytest.approx(1.2, abs=0.05)
    assert result["friction_ratio_max"] is None  # contact is lost


def test_the_sampled_law_with_feed_forward():
    result = found(**{"controller.law": "implicit", "controller.feed_forward": 1.0})
    close(result["settling_time_s"], 7.40, 5e-3)
    close(result["effort"], 1.09e-4, 0.01)
    assert max(result["xi_a_max"], result["xi_u_max"]) < 1.0


def test_the_papers_inertia_diverges_at_100_hz():
    result = run(settings={**HELD, "controller.inertia": SCALAR})
    outside = abs(result.funnel["rate_xi"]).max(axis=1) >= 1.0
    assert result.t[outside][0] == pytest.approx(0.44, abs=0.011)
    assert result.metrics["settling_time_s"] is None


@pytest.mark.parametrize("rate", [1000, 10000])
def test_the_papers_inertia_holds_when_it_is_fast(rate):
    result = found(**{"controller.inertia": SCALAR, "plant.rate_hz": rate, "controller.rate_hz": rate,
                      "record": {"max_rate_hz": 1000}})
    close(result["xi_u_max"], 0.978, 2e-3)
    close(result["settling_time_s"], 9.03, 5e-3)
    assert result["overshoot_percent"] == pytest.approx(7.8, abs=0.1)


@pytest.mark.parametrize("settings", [
    {"controller.inertia": PERPENDICULAR}, {"controller.inertia": SCALAR, "controller.lambda_u": 5.5 * 0.041,
                                            "controller.k_u": 5.5 * 0.01}])
def test_the_inertia_across_the_diagonal(settings):
    result = found(**settings)
    close(result["settling_time_s"], 6.64, 5e-3)
    close(result["effort"], 1.22e-4)
    close(result["torque_peak"], 1.08e-2)
    assert result["overshoot_percent"] == pytest.approx(0.55, abs=0.05)
    assert max(result["xi_a_max"], result["xi_u_max"]) < 1.0


def test_phased_disturbance():
    """Full inertia, the axes 120 degrees apart."""
    phase = [0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0]
    result = found(**{"plant.disturbance_phase": phase})
    close(result["settling_time_s"], 6.64, 0.01)
    assert result["normal_force_min"] == pytest.approx(-1.06, abs=0.03)


EARTH = {
    "plant.gravity": 9.8, "controller.gravity": 9.8, "plant.disturbance_amplitude": 0.0, "plant.torque_limit": 100.0,
    "controller.torque_limit": 100.0, "plant.speed_limit": 1e6, "controller.rho_a0": 0.5, "controller.l_a": -2.0,
    "controller.lambda_a": 0.55, "controller.eta_a": 0.0053, "controller.rho_u0": 0.9, "controller.rho_u_inf": 0.08,
    "controller.l_u": -2.0, "controller.lambda_u": 0.55, "controller.eta_u": 0.0053, "duration_s": 6, **FAST}


def test_earth_explicit_needs_the_full_inertia():
    result = found(**EARTH)
    close(result["xi_u_max"], 0.992, 3e-3)
    close(result["torque_peak"], 2.45)
    close(result["wheel_speed_max"], 665.0)  # rad/s; the wheels' limit is 628
    broken = found(**{**EARTH, "controller.inertia": SCALAR})
    assert broken["settling_time_s"] is None


def test_earth_sampled():
    result = found(**{**EARTH, "controller.law": "implicit", "controller.feed_forward": 1.0})
    close(result["torque_peak"], 1.44)
    close(result["wheel_speed_max"], 509.0)
    close(result["xi_u_max"], 1.011, 5e-3)


@pytest.mark.parametrize(("torque", "angle", "recovers"), [(0.2, 0.04, True), (0.2, 0.05, False), (1.5, 0.3, True)])
def test_earth_recovers_from_as_far_as_the_wheels_reach(torque, angle, recovers):
    settings = {**EARTH, "controller.law": "implicit", "controller.feed_forward": 1.0, "plant.torque_limit": torque,
                "controller.torque_limit": torque, "plant.speed_limit": 628.0,
                "plant.initial_angles": [-angle, angle, angle]}
    assert (found(**settings)["settling_time_s"] is not None) is recovers


@pytest.mark.parametrize(("latitude", "gravity", "settling"), [(1.5708, 7.76e-5, 347.0), (0.7854, 6.79e-5, 372.0),
                                                               (0.0, 2.975e-5, 561.0)])
def test_bennu_keeps_its_corner_on_the_ground(latitude, gravity, settling):
    """Nothing flies or slips at the pole, on the slope of 45 degrees, on the equator; time goes with 1/sqrt(g)."""
    result = run("cubli_bennu", {"plant.latitude": latitude}).metrics
    close(result["limit_3d"] ** 2, 2.0 * gravity / (math.sqrt(3.0) * LENGTH), 0.1)
    assert (result["lift_off_s"], result["slip_first_s"], result["end_s"]) == (None, None, None)
    assert result["normal_force_min"] > 0.9
    assert result["friction_ratio_max"] < 0.4
    assert max(result["xi_a_max"], result["xi_u_max"]) < 0.5
    assert result["settling_time_s"] * math.sqrt(gravity) == pytest.approx(3.06, rel=0.02)
