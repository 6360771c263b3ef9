"""The tests of measurements against linear algebra by NumPy and chi-square by SciPy; isolation and re-admission by counting."""

import numpy as np
import pytest
from scipy.stats import chi2

from flight_math import Mat3, Vec3, uncompiled, view
from lander_ros.navigation_filter import ATTITUDE, PARTS, POSITION
from lander_ros.robust_navigation import RobustNavigationParameters, RobustNavigationState
from lander_ros.sensor_admission import (
    ALTIMETER,
    CAMERA,
    STAR_TRACKER,
    admit_all,
    count_test,
    expected,
    isolate,
    isolation_due,
    passes,
    readmit_if_due,
    repeats,
    whitened,
)

passes = uncompiled(passes)  # some thousand calls from Python


@pytest.fixture
def p():
    return view(RobustNavigationParameters.record()[0], RobustNavigationParameters.kinds)


@pytest.fixture
def x():
    state = view(RobustNavigationState.record()[0], RobustNavigationState.kinds)
    admit_all(state)
    return state


def test_gates_have_the_probability_that_they_say(p):
    for gate, degrees in ((p.altimeter_gate, 1), (p.camera_gate, 2), (p.star_tracker_gate, 3)):
        assert chi2.sf(gate, degrees) == pytest.approx(1.0 / 1.744e6, rel=0.01)


def test_a_residual_is_whitened_by_its_covariance(x):
    random = np.random.default_rng(5)
    root = random.normal(size=(15, 15))
    blocks = (root @ root.T).reshape(PARTS, 3, PARTS, 3).swapaxes(1, 2)
    x.covariance[:] = blocks
    place, turn, y = (random.normal(size=shape) for shape in ((3, 3), (3, 3), 3))
    s = expected(x, Mat3(*place.ravel()), Mat3(*turn.ravel()), 0.7)
    rows = np.hstack([place, turn])
    both = [3 * POSITION + i for i in range(3)] + [3 * ATTITUDE + i for i in range(3)]
    reference = rows @ (root @ root.T)[np.ix_(both, both)] @ rows.T + 0.49 * np.eye(3)
    np.testing.assert_allclose(np.reshape(s.parts(), (3, 3)), reference, rtol=1e-12)
    z = np.array([*whitened(s, Vec3(*y))])
    np.testing.assert_allclose(z, np.linalg.solve(np.linalg.cholesky(reference), y), rtol=1e-10)


def test_white_noise_passes_and_a_lean_of_two_sigma_does_not(p, x):
    random = np.random.default_rng(2)
    assert all(passes(p, x, STAR_TRACKER, Vec3(*random.normal(size=3)), p.star_tracker_gate) for _ in range(1000))
    leaning = [passes(p, x, STAR_TRACKER, Vec3(*random.normal(size=3) + [2.0, 0.0, 0.0]), p.star_tracker_gate)
               for _ in range(60)]
    assert not any(leaning[30:])  # the mean of ten samples has a deviation of 0.23: 2 is 8.7 of them, the gate 5.7


def test_the_mean_of_the_drift_test_has_the_variance_that_its_gate_assumes(p, x):
    random = np.random.default_rng(3)
    means = []
    for _ in range(3000):
        passes(p, x, CAMERA, Vec3(*random.normal(size=3)), 1e9)
        means.append(np.array(x.leaning[CAMERA]))
    assert np.var(means[100:]) == pytest.approx(p.drift_weight / (2.0 - p.drift_weight), rel=0.1)


def test_a_single_wrong_measurement_does_not_lean_the_mean(p, x):
    assert not passes(p, x, ALTIMETER, Vec3(1000.0, 0.0, 0.0), p.altimeter_gate)
    assert passes(p, x, ALTIMETER, Vec3(0.5, 0.0, 0.0), p.altimeter_gate)


def test_isolation_after_five_in_a_row_and_readmission_after_ten(p, x):
    def meet(results):
        for result in results:
            count_test(x, ALTIMETER, result)
            if isolation_due(p, x, ALTIMETER):
                isolate(x, ALTIMETER)
            readmit_if_due(p, x, ALTIMETER)

    meet([False] * 4 + [True] + [False] * 4)
    assert x.admitted[ALTIMETER] == 1.0
    meet([False])
    assert x.admitted[ALTIMETER] == 0.0 and x.isolations == 1.0
    meet([True] * 9 + [False] + [True] * 9)
    assert x.admitted[ALTIMETER] == 0.0
    meet([True])
    assert x.admitted[ALTIMETER] == 1.0 and x.readmissions == 1.0
    assert x.admitted[CAMERA] == x.admitted[STAR_TRACKER] == 1.0


def test_a_measurement_that_comes_again_bit_for_bit_is_none(p, x):
    first, other = Vec3(0.1, 0.2, 0.3), Vec3(0.1, 0.2, np.nextafter(0.3, 1.0))
    assert [repeats(p, x, CAMERA, one) for one in (first, first, other, first)] == [False, True, False, False]
    assert not repeats(p, x, ALTIMETER, first)
