"""Sites on a sphere against closed forms, and what a scenario refuses."""

import math

import numpy as np
import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from sim_nodes.gravity.bodies import PointMass
from sim_nodes.gravity.site import site

RADIUS = 245.0  # [m]
SPIN = 2.0 * math.pi / (4.296 * 3600.0)  # [rad/s]
GM = 6.674e-11 * 1190.0 * 4.0 / 3.0 * math.pi * RADIUS**3  # [m^3/s^2]


@pytest.fixture
def sphere():
    return PointMass(GM, RADIUS)


def test_sphere_pole_and_equator(sphere):
    """1190 kg/m^3: 8.151e-5 m/s^2 at the pole, 4.044e-5 less at the equator."""
    assert site(sphere, SPIN, math.pi / 2, 0.0).size == pytest.approx(8.151e-5, rel=1e-4)
    assert SPIN**2 * RADIUS == pytest.approx(4.044e-5, rel=1e-3)
    assert site(sphere, SPIN, 0.0, 1.0).size == pytest.approx(4.107e-5, rel=1e-3)


@pytest.mark.parametrize("latitude", [0.6, -0.6, 1.2])
def test_slope_gradient_and_spin_on_a_sphere(sphere, latitude):
    place = site(sphere, SPIN, latitude, 0.7)
    attraction, centrifugal = GM / RADIUS**2, SPIN**2 * RADIUS * math.cos(latitude)
    down = attraction - centrifugal * math.cos(latitude)
    outward = centrifugal * abs(math.sin(latitude))  # towards the equator
    assert place.size == pytest.approx(math.hypot(down, outward), rel=1e-12)
    assert place.tilt == pytest.approx(math.atan2(outward, down), rel=1e-9)
    assert place.azimuth == pytest.approx(-math.copysign(math.pi / 2, latitude), abs=1e-9)  # downhill: to the equator
    lean = latitude + math.copysign(place.tilt, latitude)  # up is steeper than the radius
    np.testing.assert_allclose(place.spin, SPIN * np.array([0.0, math.cos(lean), math.sin(lean)]), atol=1e-15)
    assert np.trace(place.gradient) == pytest.approx(2.0 * SPIN**2, rel=1e-9)
    np.testing.assert_allclose(place.to_site @ place.gravity, [0.0, 0.0, -place.size], atol=1e-18)
    np.testing.assert_allclose(place.to_site @ place.to_site.T, np.eye(3), atol=1e-14)


def test_a_body_that_spins_too_fast_holds_nothing(sphere):
    with pytest.raises(FlightError, match="nothing holds a rover down"):
        site(sphere, 1.5e-3, 0.0, 0.0)


def test_a_site_off_the_body_is_refused(sphere):
    with pytest.raises(FlightError, match=r"latitude: 1.7 rad is off the body; allowed: -pi/2 to pi/2"):
        site(sphere, SPIN, 1.7, 0.0)
    with pytest.raises(FlightError, match=r"plant.parameters.latitude: 1.7 is not allowed .* <= 1.5708"):
        load("cubli_bennu", {"plant.latitude": 1.7})


def test_a_scenario_hands_the_site_to_plant_and_controller():
    scenario = load("cubli_bennu", {"plant.latitude": 1.5708})
    plant, controller = (scenario.graph.nodes[name].values for name in ("plant", "controller"))
    assert plant["gravity"] == controller["gravity"] == pytest.approx(7.76e-5, rel=1e-3)
    assert controller["reference_rate"] == pytest.approx(math.sqrt(2.71 * plant["gravity"]), rel=1e-15)
    assert np.linalg.norm(plant["spin"]) == pytest.approx(SPIN, rel=1e-12)
    again = load("cubli_bennu", {"plant.latitude": 1.5708})
    assert again.graph.nodes["plant"].values == plant


def test_gravity_of_the_paper_and_of_a_point_mass():
    values = load("cubli_physical", {"plant.gravity_model": "paper", "plant.tilt": 0.1}).graph.nodes["plant"].values
    assert (values["gravity"], values["tilt"]) == (0.002, 0.0)
    values = load("cubli_physical", {"plant.gravity_model": "point_mass", "plant.latitude": 1.5708, "plant.gm": GM,
                                     "plant.body_radius": RADIUS}).graph.nodes["plant"].values
    assert values["gravity"] == pytest.approx(8.151e-5, rel=1e-4)


@pytest.mark.parametrize("value", [0.0, -0.1])
def test_no_friction_is_refused(value):
    with pytest.raises(FlightError, match=rf"plant.parameters.friction: {value} is not allowed .* > 0"):
        load("cubli_bennu", {"plant.friction": value})
