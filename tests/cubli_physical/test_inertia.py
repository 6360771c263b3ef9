"""An inertia of the user's own in both plants: what a free body keeps, and what is refused."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from tests.cubli.test_dynamics import ARM, MASS, WHEEL, paper, physical
from tests.cubli_physical.runs import run
from tests.cubli_physical.test_contact import FLIGHT

BODY = np.array([[0.012, 0.001, -0.0008], [0.001, 0.016, 0.0012], [-0.0008, 0.0012, 0.02]])  # [kg m^2]
AS_LIST = BODY.tolist()


def relative(after, before):
    return np.linalg.norm(np.subtract(after, before)) / np.linalg.norm(before)


def test_the_papers_plant_tumbles_freely():
    """Without gravity, torque and disturbance J omega in the balance frame and the energy stay; omega does not."""
    state = np.array([0.1, -0.2, 0.3, 0.4, -0.3, 0.2])

    def kept(y):
        return Rotation.from_euler("XYZ", y[:3]).apply(BODY @ y[3:]), 0.5 * y[3:] @ BODY @ y[3:]

    after = paper(state, 0.0, 3.0, 3000, gravity=(0.0, 0.0, 0.0), body_inertia=BODY)
    assert relative(kept(after)[0], kept(state)[0]) < 1e-11 and math.isclose(kept(after)[1], kept(state)[1], rel_tol=1e-11)
    assert relative(after[3:], state[3:]) > 0.1


def test_the_physical_plant_on_its_corner():
    """Without gravity the force on the corner has no moment about it: with J moved there, momentum stays, torque or not."""
    theta = BODY + MASS * (ARM @ ARM * np.eye(3) - np.outer(ARM, ARM))
    state = np.concatenate([Rotation.from_euler("XYZ", [0.1, -0.2, 0.3]).as_quat(), [0.4, -0.3, 0.2], [30.0, -10.0, 5.0]])

    def momentum(y):
        return Rotation.from_quat(y[:4]).apply(theta @ y[4:7] + WHEEL * y[7:])

    after = physical(state, 0.0, 3.0, 3000, (1e-3, -2e-3, 5e-4), body_inertia=BODY)
    assert relative(momentum(after), momentum(state)) < 1e-11 and relative(after[4:7], state[4:7]) > 0.1


def test_the_physical_plant_in_flight():
    """Thrown up with spinning wheels: momentum about the centre and energy stay."""
    flown = run(settings={**FLIGHT, "plant.body_inertia": AS_LIST})
    air = flown.phase(1.0)
    assert air.sum() > 100
    omega, wheel, speed = flown.omega[air], flown.truth["wheel_speed"][air], flown.contact["centre_velocity"][air]
    momentum = flown.attitude[air].apply(omega @ BODY + WHEEL * wheel)
    energy = (0.5 * (omega @ BODY) * omega + WHEEL * (omega + 0.5 * wheel) * wheel + 0.5 * MASS * speed**2).sum(axis=1)
    energy += MASS * 0.002 * flown.contact["centre"][air, 2]
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * np.linalg.norm(momentum[0])
    assert np.abs(energy - energy[0]).max() < 1e-10 * energy[0]


@pytest.mark.parametrize(("name", "inertia", "sentence"), [
    ("cubli_physical", [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], "plant.body_inertia: .* is not symmetric"),
    ("cubli_asteroid", [[1, 0, 0], [0, 1, 0], [0, 0, 3]], "no body has the principal moments 1, 1, 3 kg m.2"),
    ("cubli_asteroid", [[1, 2, 0], [2, 1, 0], [0, 0, 1]], "its principal moments are -1, 1, 3 kg m.2; allowed: greater than 0"),
    ("cubli_physical", [[0.0009, 0, 0], [0, 0.001, 0], [0, 0, 0.0012]], "greater than the 0.001 kg m.2 of a wheel"),
    ("cubli_physical", [[math.inf, 0, 0], [0, 1, 0], [0, 0, 1]], "body_inertia")])
def test_refused(name, inertia, sentence):
    with pytest.raises(FlightError, match=sentence):
        load(name, {"plant.body_inertia": inertia})
