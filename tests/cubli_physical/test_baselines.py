"""PD and backstepping through their scenarios, against reference numbers, and in place of APPC by an override."""

import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from papers.appc import metrics


def result(scenario, settings=None):
    loaded = load(scenario, settings or {})
    return metrics.compute(loaded, CompiledRun(loaded).run())


@pytest.fixture(scope="module")
def pd():
    return result("cubli_asteroid_pd")


@pytest.fixture(scope="module")
def backstepping():
    return result("cubli_asteroid_backstepping")


def test_pd(pd):
    """kp = kd = 1 on the asteroid, 60 s: max |omega_i|, effort, |omega|; the rest of the comparison to its digits."""
    assert pd["rate_axis_max"] == pytest.approx(0.162016, rel=1e-4)
    assert pd["effort"] == pytest.approx(3.5131e-5, rel=1e-4)
    assert pd["rate_norm_max"] == pytest.approx(0.2640, rel=2e-4)
    assert pd["effort_20s"] == pytest.approx(2.644e-5, rel=2e-4)
    assert pd["overshoot_percent"] == pytest.approx(19.24, rel=1e-3)
    assert pd["tail_rad"] == pytest.approx(2.01e-2, rel=5e-3)
    assert pd["normal_force_min"] == pytest.approx(-4.66, abs=0.01)
    assert pd["torque_peak"] == pytest.approx(4.00e-3, rel=1e-3)
    assert pd["settling_time_s"] is None
    assert (pd["xi_a_max"], pd["xi_u_max"]) == (None, None)


def test_backstepping(backstepping):
    assert backstepping["settling_time_s"] == pytest.approx(2.671, abs=0.002)
    assert backstepping["effort"] == pytest.approx(7.938e-5, rel=5e-4)
    assert backstepping["effort_20s"] == pytest.approx(7.342e-5, rel=5e-4)
    assert backstepping["rate_axis_max"] == pytest.approx(0.2485, rel=5e-4)
    assert backstepping["overshoot_percent"] == pytest.approx(2.01, abs=0.01)
    assert backstepping["tail_rad"] == pytest.approx(5.57e-3, rel=2e-3)
    assert backstepping["normal_force_min"] == pytest.approx(-10.26, abs=0.01)
    assert backstepping["torque_peak"] == pytest.approx(1.550e-2, rel=1e-3)


def test_the_ranking_depends_on_the_gains(pd):
    """kp = 0.3, kd = 1 spends 7.16e-6 and keeps |omega| below the limit of eq. (9): the opposite of kp = kd = 1."""
    gentle = result("cubli_asteroid_pd", {"controller.kp": 0.3})
    assert gentle["effort"] == pytest.approx(7.16e-6, rel=1e-3)
    assert gentle["rate_norm_max"] / gentle["limit_eq9"] == pytest.approx(0.763, abs=1e-3)
    assert pd["rate_norm_max"] / pd["limit_eq9"] == pytest.approx(2.220, abs=1e-3)


def test_another_controller_by_an_override(pd):
    """The file's parameters for APPC go, those the new component shares stay, and what is set is kept."""
    loaded = load("cubli_asteroid_paper", {"controller.use": "cubli_ros/pd_controller", "controller.kd": 1.0})
    values = loaded.graph.nodes["controller"].values
    assert values["feed_forward"] == 0.0  # of the file, and shared
    assert metrics.compute(loaded, CompiledRun(loaded).run()) == pd


def test_earth_by_an_override_keeps_the_rovers_model():
    scenario = load("cubli_earth", {"controller.use": "cubli_ros/backstepping_controller"})
    values = scenario.graph.nodes["controller"].values
    assert (values["gravity"], values["torque_limit"]) == (9.8, 10.0)


@pytest.mark.parametrize(("settings", "sentence"), [
    ({"controller.use": "cubli_ros/pd_controler"},
     "--set controller.use: cubli_ros: no executable called 'pd_controler'; did you mean 'pd_controller'"),
    ({"controller.use": "pd"}, "'pd' names no component; write package/executable"),
    ({"controller.use": "cubli_ros/pd_controller", "controller.lambda_a": 0.1}, "no parameter called 'lambda_a'"),
    ({"controller.use": "cubli_ros/jump_monitor"}, "unconnected|publishes 'cubli/wheel_command'"),
    ({"controller.use": "cubli_ros/pd_controller", "controller.kp": -1.0}, "kp: -1.0 is not allowed .* >= 0"),
    ({"controller.use": "cubli_ros/pd_controller", "controller.gravity_sign": 0}, "allowed: 1 or -1")])
def test_overrides_that_cannot_be(settings, sentence):
    with pytest.raises(FlightError, match=sentence):
        load("cubli_asteroid_paper", settings)


def test_parameters_that_follow_from_another_component():
    settings = {"controller.gravity": "= 2 * plant.gravity",
                "controller.rho_a0": "= [0.4, plant.length * 2, sqrt(0.25)]",
                "controller.reference": "= plant.initial_angles"}
    values = load("cubli_asteroid_paper", settings).graph.nodes["controller"].values
    assert values["gravity"] == 0.004
    assert values["rho_a0"] == [0.4, 0.4, 0.5]
    assert values["reference"] == [-0.3, 0.3, 0.3]


@pytest.mark.parametrize(("settings", "sentence"), [
    ({"controller.gravity": "= plnt.gravity"}, "parameters.gravity: no component called 'plnt'; did you mean"),
    ({"controller.gravity": "= plant.gravty"}, "plant: no parameter called 'gravty'; did you mean 'gravity'"),
    ({"controller.gravity": "= 1 +"}, "'= 1 \\+' is no expression"),
    ({"controller.gravity": "= open('x')"}, "no function called 'open'"),
    ({"controller.gravity": "= (1).real"}, "'1 .real' is not allowed in an expression"),
    ({"controller.gravity": "= 1 / 0"}, "has no value: division by zero"),
    ({"controller.gravity": "= -plant.gravity"}, "gravity: -0.002 is not allowed"),
    ({"controller.gravity": "= plant.gravity", "plant.gravity": "= controller.gravity"}, "in a circle")])
def test_expressions_that_cannot_be(settings, sentence):
    with pytest.raises(FlightError, match=sentence):
        load("cubli_asteroid_paper", settings)
