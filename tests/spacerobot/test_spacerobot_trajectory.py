"""Desired motions: each one's rates and accelerations against numerical derivatives of its attitude and angles."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spacerobot_ros.inertial_parameters import ModelError
from spacerobot_ros.trajectory import (
    check_range,
    harmonic_reference,
    hold_within,
    quintic,
    slew_reference,
    step_reference,
)  # fmt: skip
from tests.spacerobot.spacerobot_loop import ROBOT, STEP


class Parameters(NamedTuple):
    """The trajectory generator's parameters that the motions read."""

    target: np.ndarray
    begin: np.ndarray = np.zeros(7)
    duration: float = 20.0
    amplitude: np.ndarray = np.zeros(7)
    cycle: np.ndarray = np.ones(7)
    phase: np.ndarray = np.zeros(7)
    lower: np.ndarray = ROBOT.lower
    upper: np.ndarray = ROBOT.upper


def evaluated(reference, *arguments):
    """q (scalar first), w, wdot, theta, thd, thdd of a motion."""
    joints = np.full((3, 4), np.nan)
    q, w, wdot = (np.array(part.parts()) for part in reference(*arguments, joints))
    return np.roll(q, 1), w, wdot, *joints


def check_derivatives(at, t):
    """``at(t)`` returns q, w, wdot, theta, thd, thdd; central differences of 1e-5 s."""
    h = 1e-5  # [s]
    q, w, wdot, _, thd, thdd = at(t)
    ahead, behind = at(t + h), at(t - h)
    turn = [Rotation.from_quat(x[0], scalar_first=True) for x in (behind, ahead)]
    np.testing.assert_allclose((turn[0].inv() * turn[1]).as_rotvec() / (2 * h), w, atol=1e-8)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), wdot, atol=1e-8)
    np.testing.assert_allclose((ahead[3] - behind[3]) / (2 * h), thd, atol=1e-8)
    np.testing.assert_allclose((ahead[4] - behind[4]) / (2 * h), thdd, atol=1e-8)
    assert abs(np.linalg.norm(q) - 1.0) < 1e-14


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), t=st.floats(0.0, 100.0))
def test_harmonics(seed, t):
    rng = np.random.default_rng(seed)
    mean, phase = rng.uniform(-1, 1, 7), rng.uniform(0, 6, 7)
    amplitude, period = rng.uniform(0, 0.5, 7), rng.uniform(5, 30, 7)

    def at(time):
        return evaluated(harmonic_reference, Parameters(mean, amplitude=amplitude, cycle=period, phase=phase), time)

    check_derivatives(at, t)
    value = mean + amplitude * np.sin(2 * np.pi * t / period + phase)
    np.testing.assert_allclose(at(t)[3], value[3:], atol=1e-12)
    expected = Rotation.from_euler("ZYX", value[2::-1])
    assert (expected.inv() * Rotation.from_quat(at(t)[0], scalar_first=True)).magnitude() < 1e-12


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), t=st.floats(0.01, 19.9))
def test_slew(seed, t):
    rng = np.random.default_rng(seed)
    begin, target = (np.concatenate([rng.uniform(-1, 1, 3), angles]) for angles in rng.uniform(-2, 2, (2, 4)))
    start, end = (Rotation.from_euler("ZYX", channels[2::-1]) for channels in (begin, target))

    def at(time):
        return evaluated(slew_reference, Parameters(target, begin), time)

    check_derivatives(at, t)
    for time, attitude in ((-1.0, start), (25.0, end)):
        assert (attitude.inv() * Rotation.from_quat(at(time)[0], scalar_first=True)).magnitude() < 1e-12
    half = (start.inv() * end).as_rotvec() / 2
    assert ((start * Rotation.from_rotvec(half)).inv() * Rotation.from_quat(at(10.0)[0], scalar_first=True)).magnitude() < 1e-12
    np.testing.assert_allclose(at(25.0)[3], target[3:], atol=1e-15)
    np.testing.assert_array_equal(at(-1.0)[3], begin[3:])
    assert not at(25.0)[1].any() and not at(25.0)[5].any()


def test_quintic_is_the_polynomial():
    for x in np.linspace(0, 1, 21):
        profile = quintic(x * 4.0, 4.0)
        polynomial = np.poly1d([6, -15, 10, 0, 0, 0])
        expected = [polynomial(x), polynomial.deriv()(x) / 4, polynomial.deriv(2)(x) / 16]
        np.testing.assert_allclose(profile, expected, atol=1e-14)


def test_step():
    out = evaluated(step_reference, Parameters(STEP[0]))
    half = np.radians(5.0)
    np.testing.assert_allclose(out[0], [np.cos(half), np.sin(half), 0, 0], atol=1e-15)
    np.testing.assert_allclose(np.degrees(out[3]), [90, 55, 55, 10])
    assert not out[1].any() and not out[4].any()


def test_a_joint_commanded_past_its_stop():
    joints = np.array([[0.0, 3.5, -4.0, 1.0], [1.0, 1, 1, 1], [1.0, 1, 1, 1]])
    assert hold_within(Parameters(STEP[0]), joints) == 2
    np.testing.assert_allclose(joints[0], [0.0, np.pi, -np.pi, 1.0])
    np.testing.assert_array_equal(joints[1], [1, 0, 0, 1])
    with pytest.raises(ModelError, match=r"joint 'joint_2' is commanded to \[-10, 60\] deg, past its stop"):
        check_range(ROBOT, np.radians([0, -10, 0, 0]), np.radians([0, 60, 0, 0]))
    with pytest.raises(ModelError, match="not a finite number"):
        check_range(ROBOT, np.full(4, np.nan), np.zeros(4))
    check_range(ROBOT, np.radians([90, 25, 25, -25]), np.radians([90, 65, 65, 25]))
