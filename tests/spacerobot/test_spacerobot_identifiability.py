"""Identifiability: ranks of random and harmonic motion, the parameters visible on their own, and the combinations."""

import numpy as np
import pytest

from flight_graph.errors import FlightError
from spacerobot_ros.identifiability import Samples, identify, momentum_free_acceleration, stack_regressors
from spacerobot_ros.trajectory import harmonic_reference
from tests.spacerobot.spacerobot_loop import HARMONIC, ROBOT

ROWS = {"7": slice(3, None), "10": slice(None), "4": slice(6, None)}


def random_motion(states=400):
    rng = np.random.default_rng(0)
    theta = rng.uniform(-np.pi, np.pi, (states, 4))
    thd, thdd = rng.standard_normal((2, states, 4))
    w, alpha = rng.standard_normal((2, states, 3))
    return Samples(theta, w, thd, alpha, thdd)


def harmonic_motion():
    samples = []
    for t in np.arange(0.0, 60.0 + 1e-9, 0.1):
        joints = np.zeros((3, 4))
        _, w, alpha = harmonic_reference(HARMONIC, t, joints)
        samples.append((w.parts(), alpha.parts(), *joints))
    w, alpha, theta, thd, thdd = (np.array(column) for column in zip(*samples, strict=True))
    return Samples(theta, w, thd, alpha, thdd)


def analyse(motion, rows, cut=1e-10):
    a = momentum_free_acceleration(ROBOT, motion)
    stack = stack_regressors(ROBOT, motion, a, ROWS[rows])
    return stack, identify(stack, ROBOT.parameter_names, ROBOT.pi, cut)


@pytest.mark.parametrize("rows, rank", [("7", 37), ("10", 38), ("4", 28)])
def test_rank_of_random_motion(rows, rank):
    _, result = analyse(random_motion(), rows)
    assert result.rank == rank
    assert result.singular_values[rank - 1] > 1e6 * result.singular_values[rank]


@pytest.mark.parametrize("rows, rank, above", [("7", 27, (19, 12)), ("10", 28, (20, 11)), ("4", 21, (13, 9))])
def test_rank_of_the_harmonic_motion(rows, rank, above):
    _, result = analyse(harmonic_motion(), rows)
    assert result.rank == rank
    relative = result.singular_values / result.singular_values[0]
    assert (int(np.sum(relative > 1e-3)), int(np.sum(relative > 1e-2))) == above


def test_singular_values_of_the_harmonic_motion():
    _, result = analyse(harmonic_motion(), "7")
    expected = [1, 0.281, 0.153, 0.126, 0.0982, 0.0752, 0.0450, 0.0374, 0.0233, 0.0127]
    np.testing.assert_allclose(result.singular_values[:10] / result.singular_values[0], expected, rtol=0.005)
    assert result.singular_values[26] / result.singular_values[0] == pytest.approx(1.7e-6, rel=0.05)


def test_parameters_visible_on_their_own():
    _, result = analyse(random_motion(), "10")
    expected = (
        "B0.Ixy B0.Iyz B0.hy B1.Ixy B1.Ixz B1.Iyz B1.hx B2.Ixy B2.Iyz B2.hy B3.Ixz B3.Iyz B4.Ixy B4.Ixz B4.Iyz B4.Izz "
        "B4.hx B4.hy"
    )
    assert " ".join(np.array(result.names)[result.individual]) == expected


def test_seven_rows_lose_the_base_mass():
    _, seven = analyse(random_motion(), "7")
    assert seven.null_component[9] == pytest.approx(1.0, abs=1e-9)


def test_harmonic_motion_hides_two_base_inertias():
    _, result = analyse(harmonic_motion(), "7")
    assert result.null_component[3] == pytest.approx(1.0, abs=1e-6)
    assert result.null_component[5] == pytest.approx(1.0, abs=1e-6)


def test_combinations_are_all_that_the_motion_shows():
    """What no combination sees does not change the wrench, and the combinations rebuild the wrench."""
    stack, result = analyse(random_motion(), "10")
    assert result.combinations.shape == (38, 50)
    np.testing.assert_allclose(result.combinations[np.arange(38), result.independent], 1.0, atol=1e-12)
    np.testing.assert_allclose(
        stack[:, result.independent] @ (result.combinations @ ROBOT.pi), stack @ ROBOT.pi, atol=1e-7
    )
    hidden = np.linalg.svd(result.combinations)[2][38:]
    assert np.abs(stack @ hidden.T).max() < 1e-7 * np.abs(stack).max()
    sentences = result.sentences()
    assert len(sentences) == 38 and "B4.hx" in sentences


def test_what_cannot_be_analysed():
    with pytest.raises(FlightError, match="50 columns are needed"):
        identify(np.zeros((10, 40)), ROBOT.parameter_names, ROBOT.pi)
    with pytest.raises(FlightError, match="not finite"):
        identify(np.full((10, 50), np.nan), ROBOT.parameter_names, ROBOT.pi)
    assert identify(np.zeros((10, 50)), ROBOT.parameter_names, ROBOT.pi).rank == 0
