"""Standing, flying, sliding and landing of the physical plant, against Newton and Euler and what they conserve."""

import math

import numpy as np
import pytest

from flight_graph.components.component import kinds_of
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_math import Vec3
from flight_math.values import view
from msg_schemas import cubli
from sim_nodes.cubli.sensors import Imu
from tests.cubli.records import made
from tests.cubli_physical.runs import CENTRE_INERTIA, IDLE, LENGTH, MASS, THETA, WHEEL, normal_of, run

G = 0.002  # [m/s^2]
FLIGHT = {**IDLE, "plant.initial_angles": [0.05, -0.1, 0.08], "plant.initial_rates": [0.25, -0.2, 0.1],
          "plant.initial_wheel_speed": [30.0, -20.0, 10.0], "duration_s": 20}


@pytest.fixture(scope="module")
def flight():
    """Thrown up by its own rotation at the start, with spinning wheels, nothing else acting."""
    return run(settings=FLIGHT)


@pytest.fixture(scope="module")
def paper():
    """Table 2 on the physical plant as the scenario has it: it lifts off, flies, lands."""
    return run()


def test_no_fault_in_the_constants():
    r = 0.5 * LENGTH * np.ones(3)
    steiner = CENTRE_INERTIA * np.eye(3) + MASS * (r @ r * np.eye(3) - np.outer(r, r))
    np.testing.assert_allclose(THETA, steiner)


def test_contact_force_is_newtons(paper):
    """F = m (a - g) with the centre's acceleration from its own velocity, under torque and disturbance."""
    held = run(plant__on_lift_off="hold", plant__rate_hz=1000, controller__rate_hz=1000, plant__tilt=0.2,
               plant__azimuth=0.5, duration_s=8, controller__smoothing=0.01)
    slope = np.diff(held.contact["centre_velocity"], axis=0) * 1000.0
    force = MASS * (slope - np.array([0.0, 0.0, -G]))
    assert np.abs(force - held.contact["force"][1:]).max() < 2e-3 * MASS * G  # at the end of each millisecond
    normal = normal_of(0.2, 0.5)
    along = held.contact["force"] @ normal
    sideways = np.linalg.norm(held.contact["force"] - along[:, None] * normal, axis=1)
    assert np.abs(held.contact["normal_force"] - along / (MASS * G))[1:].max() < 0.03  # extremes of a millisecond
    pressed = (along > 0.2 * MASS * G)[1:]
    np.testing.assert_allclose(held.contact["friction_ratio"][1:][pressed], (sideways / along)[1:][pressed], rtol=0.03)


def test_flight_is_a_parabola_and_keeps_momentum_and_energy(flight):
    assert flight.metrics["lift_off_s"] == 0.0
    assert flight.metrics["flight_time_s"] > 2.0
    air = flight.phase(1.0)
    t, centre = flight.t[air], flight.contact["centre"][air]
    v = flight.contact["centre_velocity"][0]
    expected = flight.contact["centre"][0] + np.outer(t, v) - 0.5 * G * np.outer(t * t, [0.0, 0.0, 1.0])
    assert np.abs(centre - expected).max() < 1e-13
    momentum = flight.spin_momentum()[air]
    assert np.abs(momentum - flight.spin_momentum()[0]).max() < 1e-10 * np.linalg.norm(momentum[0])
    energy = flight.energy()[air]
    assert np.abs(energy - flight.energy()[0]).max() < 1e-10 * flight.energy()[0]
    assert np.abs(flight.omega[air] - flight.omega[0]).max() > 0.04  # the wheels' gyroscopic torque turns it


def test_wheels_cannot_change_the_momentum_of_a_flight(paper):
    """With the law at work in flight the total about the centre changes by the disturbing torque alone."""
    air = np.flatnonzero(paper.phase(1.0))
    momentum, t = paper.spin_momentum()[air], paper.t[air]
    push = paper.attitude[air].apply(np.outer(np.sin(t), np.full(3, 0.02 * CENTRE_INERTIA)))
    impulse = np.vstack([np.zeros(3), np.cumsum(0.5 * (push[1:] + push[:-1]) * np.diff(t)[:, None], axis=0)])
    assert np.abs(momentum - momentum[0] - impulse).max() < 2e-3 * np.abs(impulse).max()
    assert np.abs(paper.truth["torque"][air]).max() > 2.0 * 0.02 * CENTRE_INERTIA


def test_lift_off_is_continuous_and_the_corner_lands(paper):
    first = int(np.flatnonzero(paper.phase(1.0))[0])
    jump = paper.contact["centre"][first] - paper.contact["centre"][first - 1]
    middle = 0.005 * (paper.contact["centre_velocity"][first] + paper.contact["centre_velocity"][first - 1])
    assert np.abs(jump - middle).max() < 1e-6
    assert 0.0 < paper.metrics["lift_off_s"] < 1.5
    assert paper.metrics["outcome"] == "landed"
    last = paper.contact[-1]
    assert last["touching_corner"] == 0.0
    assert -1e-5 < last["corner"][2] <= 0.0
    assert last["touching_speed"] == pytest.approx(-last["corner_velocity"][2], rel=1e-12)
    ended = paper.phase(2.0)
    assert paper.t[ended][0] - paper.metrics["end_s"] < 0.0101
    assert (paper.contact["centre"][ended] == last["centre"]).all()
    assert paper.metrics["xi_u_max"] < 1.0  # judged up to the landing


def test_what_an_accelerometer_feels(paper):
    """The ground's force alone, turned into the body and over the mass: nothing in flight."""
    felt = paper.contact["specific_force"]
    expected = paper.attitude.inv().apply(paper.contact["force"]) / MASS
    np.testing.assert_allclose(felt, expected, atol=1e-15)
    assert (felt[paper.phase(1.0)] == 0.0).all()
    signals = (cubli.TRUTH, cubli.TRUTH_CONTACT, cubli.IMU)
    truth, contact, imu = (view(signal.new()[1][0], kinds_of(signal)) for signal in signals)
    p, x = made(Imu.parameters, accelerometer_sigma=0.0), made(Imu.state)
    truth.gravity = Vec3(0.0, 0.0, -G)
    Imu.kernel(0, p, x, truth, contact, imu)
    np.testing.assert_allclose(imu.linear_acceleration, [0.0, 0.0, G])  # at rest, no contact message
    contact.header.stamp.sec = 1
    contact.specific_force = Vec3(1e-4, 2e-4, 3e-4)
    Imu.kernel(0, p, x, truth, contact, imu)
    np.testing.assert_allclose(imu.linear_acceleration, [1e-4, 2e-4, 3e-4])


def test_flight_over_a_spinning_body_keeps_the_jacobi_integral():
    """v^2/2 + g z - x.Gamma x/2 is constant: the Coriolis acceleration does no work, and Gamma is symmetric."""
    gradient = np.array([[1e-4, 2e-5, -3e-5], [2e-5, -2e-4, 1e-5], [-3e-5, 1e-5, 1.2e-4]])  # [1/s^2]
    spin = np.array([0.01, 0.02, -0.03])  # [rad/s]
    found = run(settings={**FLIGHT, "plant.spin": spin.tolist(), "plant.gravity_gradient": gradient.ravel().tolist()})
    air = found.phase(1.0)
    x, v = found.contact["centre"][air], found.contact["centre_velocity"][air]
    jacobi = 0.5 * (v**2).sum(axis=1) + G * x[:, 2] - 0.5 * np.einsum("ni,ij,nj->n", x, gradient, x)
    assert np.ptp(jacobi) < 1e-11 * abs(jacobi[0])
    slope = (v[2:] - v[:-2]) / 0.02
    expected = np.array([0.0, 0.0, -G]) + x[1:-1] @ gradient - 2.0 * np.cross(spin, v[1:-1])
    assert np.abs(slope - expected).max() < 1e-8


def test_a_rover_left_alone_falls_on_its_next_corner():
    """Energy gives the speed: omega.Theta omega / 2 + m g h is constant until another corner touches."""
    found = run(settings={**IDLE, "plant.on_lift_off": "hold", "duration_s": 60})
    assert (found.metrics["outcome"], found.metrics["lift_off_s"]) == ("fell", None)
    assert found.contact["touching_corner"][-1] != 0.0
    standing = found.phase(0.0)
    wheel = found.truth["wheel_speed"]
    rotation = (0.5 * np.einsum("ni,ij,nj->n", found.omega, THETA, found.omega)
                + WHEEL * ((found.omega + 0.5 * wheel) * wheel).sum(axis=1))
    energy = rotation + MASS * G * found.contact["centre"][:, 2]
    assert np.abs(energy - energy[0])[standing].max() < 1e-10 * energy[0]
    np.testing.assert_allclose(energy, found.energy(), rtol=1e-12)
    corners = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)]) * LENGTH
    heights = found.attitude[-1].apply(corners)[:, 2]
    assert heights[int(found.contact["touching_corner"][-1])] == pytest.approx(0.0, abs=1e-4)
    assert heights.min() > -1e-4


def test_sliding_without_friction_keeps_energy_and_horizontal_momentum():
    found = run(settings={**IDLE, "plant.on_slip": "slide", "plant.friction": 1e-12, "duration_s": 4})
    sliding = found.contact["sliding"] == 1.0
    assert sliding[1:].all()
    assert np.abs(found.contact["centre_velocity"][:, :2]).max() < 1e-12
    assert np.abs(found.energy() - found.energy()[0]).max() < 1e-9 * found.energy()[0]
    assert np.abs(found.contact["corner"][:, 2]).max() < 1e-12
    assert np.abs(found.contact["corner_velocity"][:, 2]).max() < 1e-12


def test_sliding_with_friction_obeys_newton_and_loses_what_friction_takes():
    found = run(settings={**IDLE, "plant.on_slip": "slide", "plant.friction": 0.2, "plant.rate_hz": 1000.0,
                          "controller.rate_hz": 1000.0, "plant.tilt": 0.1, "plant.azimuth": 2.0, "duration_s": 5})
    sliding = found.contact["sliding"] == 1.0
    assert sliding[2:].all()
    normal, force = normal_of(0.1, 2.0), found.contact["force"]
    along = force @ normal
    assert along.min() > 0.0
    sideways = force - along[:, None] * normal
    speed = found.contact["corner_velocity"]
    np.testing.assert_allclose(np.linalg.norm(sideways, axis=1)[2:], 0.2 * along[2:], rtol=1e-9)
    size = np.linalg.norm(sideways, axis=1) * np.linalg.norm(speed, axis=1)
    assert ((sideways * speed).sum(axis=1)[5:] < -0.9999 * size[5:]).all()
    assert np.abs(speed @ normal).max() < 1e-12
    slope = np.diff(found.contact["centre_velocity"], axis=0) * 1000.0
    middle = 0.5 * (force[1:] + force[:-1]) / MASS + np.array([0.0, 0.0, -G])
    assert np.abs(slope - middle)[2:].max() < 2e-3 * G
    power = (force * speed).sum(axis=1)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) / 1000.0)])
    lost = found.energy() - found.energy()[0]
    assert lost[-1] < -1e-5 * found.energy()[0]
    assert np.abs(lost - work).max() < 0.01 * abs(lost[-1])


@pytest.mark.parametrize("azimuth", [0.0, 2.2])
def test_balance_on_a_slope_needs_the_slopes_friction(azimuth):
    """At rest under gravity alone: N = m g cos(tilt), friction ratio tan(tilt), and no torque."""
    settings = {**IDLE, "plant.initial_angles": 0.0, "plant.tilt": 0.3, "plant.azimuth": azimuth, "duration_s": 2}
    found = run(settings={**settings, "plant.friction": 0.32})
    np.testing.assert_allclose(found.contact["normal_force"], math.cos(0.3), rtol=1e-9)
    np.testing.assert_allclose(found.contact["friction_ratio"], math.tan(0.3), rtol=1e-9)
    assert found.metrics["slip_first_s"] is None
    slips = run(settings={**settings, "plant.friction": 0.3, "plant.on_slip": "slide"})
    assert slips.metrics["slip_first_s"] == 0.0
    down = normal_of(0.3, azimuth)[:2]
    assert slips.contact["corner"][-1][:2] @ down > 0.0


def test_a_slide_ends_where_friction_suffices():
    """Pushed from rest by a short disturbance on flat ground: it slides, stops, and stands where it stopped."""
    found = run(plant__on_slip="slide", plant__friction=0.35, plant__disturbance_amplitude=0.0, duration_s=60,
                controller__lambda_a=0.02, controller__rho_u0=0.3, controller__rho_a_inf=0.05, controller__l_a=-0.1,
                controller__l_u=-0.1, controller__rho_u_inf=0.05)
    sliding = found.contact["sliding"] == 1.0
    assert sliding.any()
    assert (found.metrics["end_s"], found.phase(1.0).any()) == (None, False)
    assert not sliding[-100:].any()
    assert np.abs(found.contact["corner_velocity"][-100:]).max() == pytest.approx(0.0, abs=1e-15)
    assert np.linalg.norm(found.contact["corner"][-1]) > 1e-4


@pytest.mark.parametrize(("settings", "sentence"), [
    ({"plant.initial_angles": [0.5, -0.5, -0.5]}, r"initial_angles: .* puts corner \d of the cube .* into the ground"),
    ({"plant.tilt": 0.4, "plant.azimuth": -1.5}, "lean the cube less"),
    ({"plant.wheel_inertia": 0.02}, r"wheel_inertia: 0.02 kg m\^2 is not allowed; allowed: less than the cube's own"),
    ({"plant.friction": 0.0}, "plant.parameters.friction: 0.0 is not allowed"),
    ({"plant.gravity": 0.0}, "plant.parameters.gravity: 0.0 is not allowed"),
    ({"plant.tilt": 1.6}, "plant.parameters.tilt: 1.6 is not allowed"),
    ({"plant.on_slip": "jump"}, "'jump' is not allowed; allowed: one of hold, slide")])
def test_refused(settings, sentence):
    with pytest.raises(FlightError, match=sentence):
        load("cubli_physical", settings)
