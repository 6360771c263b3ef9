"""The robust attitude estimator: dead reckoning against its closed form, tests, isolation, re-admission, validity."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cubli_ros import sensor_admission
from cubli_ros.robust_attitude_estimator import RobustEstimatorParameters, RobustEstimatorState
from flight_math import Quaternion, Vec3, plain
from tests.cubli.records import made
from tests.faults_rover.rover_runs import BALANCE, REST, Run

admit_gyro, admit_tracker, average_vertical, has_vertical, tilt_residual = (plain(getattr(sensor_admission, name)) for name in (
    "admit_gyro", "admit_tracker", "average_vertical", "has_vertical", "tilt_residual"))
GYRO = 1e-4  # [rad/s]
PERIOD = 0.01  # [s]


def errors(run):
    """Angles (n,) between estimate and truth [rad]."""
    true, found = (Rotation.from_quat(run[topic]["orientation"]) for topic in ("truth/attitude", "attitude"))
    return (true.inv() * found).magnitude()


@pytest.fixture(scope="module")
def without_tracker():
    return Run("star_tracker.measured", "drop", from_s=40.0)


def test_sixty_seconds_on_the_gyro_alone_are_valid_and_within_the_covariance(without_tracker):
    status, t = without_tracker["estimator_status"], without_tracker.t("estimator_status")
    late = t > 41.0
    assert (status["valid"][t > 0.5] == 1.0).all()
    assert without_tracker.modes() == [(0.0, 0)]
    np.testing.assert_allclose(status["tracker_age"][late], t[late] - 39.75, atol=1e-6)
    assert status["tracker_age"][-1] > 60.0
    assert (errors(without_tracker)[late] < 4.0 * status["sigma"][late]).all()


def test_the_covariance_of_dead_reckoning_grows_as_its_closed_form(without_tracker):
    """P_a - 2 t P_c + t^2 P_b + gyro noise + walk of the bias, as dtheta' = -db; rates of 1e-3 rad/s turn it by little."""
    block = without_tracker["attitude_filter"]["covariance"].reshape(-1, 6, 6)
    t = without_tracker.t("attitude_filter")
    first = np.searchsorted(t, 40.0)
    attitude, cross, bias = (np.trace(block[first, a:a + 3, b:b + 3]) for a, b in ((0, 0), (0, 3), (3, 3)))
    for span in (10.0, 30.0, 60.0):
        n = round(span / PERIOD)
        walk = 3.0 * 1e-14 * PERIOD**2 * sum(k * k for k in range(n))  # of 1e-7 rad/s a sample
        exact = attitude - 2.0 * span * cross + span**2 * bias + 3.0 * GYRO**2 * PERIOD * span + walk
        found = without_tracker["estimator_status"]["sigma"][first + n] ** 2
        np.testing.assert_allclose(found, exact, rtol=0.02)


def records(**values):
    return made(RobustEstimatorParameters, PERIOD, acceleration_limit=0.1, **values), made(
        RobustEstimatorState, gyro_age=-1.0, tracker_age=-1.0, gyro_refused_for=1e9)


def samples(p, x, rows, fresh=True):
    """What is used of gyro samples (n, 3)."""
    used = []
    for row in rows:
        x.gyro_before = admit_gyro(p, x, Vec3(*row), fresh)
        used.append(np.array(x.gyro_before))
    return np.array(used)


def test_a_spike_is_left_out_and_a_step_isolates():
    p, x = records()
    noise = np.random.default_rng(2).normal(0.0, GYRO, (400, 3))
    spike = noise.copy()
    spike[100, 1] += 0.05
    used = samples(p, x, spike)
    np.testing.assert_array_equal(used[100], used[99])
    np.testing.assert_array_equal(used[101:], spike[101:])
    assert x.gyro_rejected == 1 and not x.gyro_lost
    noise[200:, 0] += 0.05
    p, x = records()
    samples(p, x, noise)
    assert x.gyro_lost and x.gyro_isolations == 1 and x.gyro_rejected == 200


def test_an_axis_that_repeats_itself_isolates_and_comes_back():
    p, x = records()
    noise = np.random.default_rng(3).normal(0.0, GYRO, (500, 3))
    noise[100:200, 2] = noise[100, 2]
    samples(p, x, noise[:200])
    assert x.gyro_lost and x.gyro_isolations == 1
    samples(p, x, noise[200:299])
    assert x.gyro_lost
    samples(p, x, noise[299:])
    assert not x.gyro_lost and x.gyro_isolations == 1
    assert abs(np.array(x.bias)).max() < 6.0 * GYRO  # the offset that was learned is noise


def test_silence_isolates_the_gyro_after_its_limit():
    p, x = records(gyro_limit=5)
    samples(p, x, np.random.default_rng(4).normal(0.0, GYRO, (10, 3)))
    samples(p, x, np.zeros((4, 3)), fresh=False)
    assert not x.gyro_lost
    samples(p, x, np.zeros((1, 3)), fresh=False)
    assert x.gyro_lost
    np.testing.assert_allclose(x.gyro_age, 0.05)


def filter_at_rest(p, x):
    x.quaternion, x.begun = Quaternion(0.0, 0.0, 0.0, 1.0), True
    for i in range(3):
        row = [0.0] * 9
        row[4 * i] = 1.0
    identity = np.eye(3)
    x.attitude_covariance = type(x.attitude_covariance)(*(identity * 4e-10).ravel())
    x.bias_covariance = type(x.bias_covariance)(*(identity * 1e-12).ravel())


def measurement(rng, turn=(0.0, 0.0, 0.0), sigma=5e-5):
    return Quaternion(*(Rotation.from_rotvec(turn) * Rotation.from_rotvec(rng.normal(0.0, sigma, 3))).as_quat())


def test_the_tracker_is_isolated_after_three_and_admitted_after_eight():
    p, x = records()
    filter_at_rest(p, x)
    rng = np.random.default_rng(5)
    assert admit_tracker(p, x, measurement(rng))
    wrong = [admit_tracker(p, x, measurement(rng, (0.01, 0.0, 0.0))) for _ in range(6)]
    assert not any(wrong) and x.tracker_lost and x.tracker_isolations == 1 and x.tracker_rejected == 6
    right = [admit_tracker(p, x, measurement(rng)) for _ in range(9)]
    assert right == [False] * 7 + [True] * 2 and not x.tracker_lost


def test_the_referee_takes_the_side_of_gravity():
    """An estimate that is 0.1 rad off, a tracker that is right, and an accelerometer."""
    p, x = records(vertical_time=1.0)
    filter_at_rest(p, x)
    rng = np.random.default_rng(6)
    off = Rotation.from_rotvec([0.1, 0.0, 0.0])
    x.quaternion = Quaternion(*off.as_quat())
    up = np.full(3, 0.002 / math.sqrt(3.0))  # [m/s^2] specific force of a rover at rest, upright
    for _ in range(150):
        average_vertical(p, x, Vec3(*up))
    assert has_vertical(p, x)
    direction = off.apply(up) / np.linalg.norm(up) - np.full(3, 1.0 / math.sqrt(3.0))
    np.testing.assert_allclose(tilt_residual(p, x), np.linalg.norm(direction), rtol=1e-12)
    taken = [admit_tracker(p, x, measurement(rng)) for _ in range(8)]
    assert x.reopened == 1 and any(taken) and not x.tracker_lost
    assert Rotation.from_quat(list(x.quaternion)).magnitude() < 5e-4


def test_the_referee_keeps_an_estimate_that_agrees_with_gravity():
    p, x = records(vertical_time=1.0)
    filter_at_rest(p, x)
    rng = np.random.default_rng(7)
    for _ in range(150):
        average_vertical(p, x, Vec3(*[0.002 / math.sqrt(3.0)] * 3))
    for _ in range(100):
        admit_tracker(p, x, measurement(rng, (0.1, -0.05, 0.0)))
    assert x.reopened == 0 and x.tracker_lost


@pytest.mark.parametrize("value, error", [(2e-4, 5e-3), (1e-3, 5e-3), (3e-3, 1e-2)])
def test_a_gyro_bias_is_found_and_learned(value, error):
    run = Run("imu.imu.angular_velocity[0]", "bias", {}, 60.0, from_s=20.0, value=value)
    assert run["estimator_status"]["reopened"][-1] >= 1.0 and run["estimator_status"]["tracker_admitted"][-1] == 1.0
    np.testing.assert_allclose(run["attitude_filter"]["bias"][-1], [2e-4 + value, 2e-4, 2e-4], atol=5e-5)
    assert run.metrics["attitude_error_max"] < error and errors(run)[-1] < 3e-4
    assert run.metrics["end"] == "balanced" and run.metrics["fault_isolated"]


def test_without_gyro_the_tracker_carries_attitude_and_rate():
    run = Run("imu.imu", "drop", {}, 60.0, from_s=20.0)
    status, t = run["estimator_status"], run.t("estimator_status")
    assert (status["gyro_admitted"][t > 20.1] == 0.0).all() and (status["valid"][t > 1.0] == 1.0).all()
    rates = run["attitude"]["angular_velocity"][t > 22.0] - run["truth"]["rates"][t > 22.0]
    assert np.abs(rates).max() < 2e-3 and errors(run)[t > 22.0].max() < 1e-3


def test_without_both_the_estimate_ends_and_the_rover_is_let_go(tmp_path):
    """The tracker is silent from 15 s on, the inertial unit from 20 s: no rate is known, so rest without torque."""
    tracker = {"id": "tracker", "at": "star_tracker.measured", "type": "drop", "from_s": 15.0}
    run = Run("imu.imu", "drop", {"estimator.coast_time": 2.0}, 100.0, [tracker], tmp_path, from_s=20.0)
    status, t = run["estimator_status"], run.t("estimator_status")
    np.testing.assert_allclose(t[(status["valid"] == 0.0) & (t > 1.0)][0], 22.0, atol=0.03)
    assert [mode for _, mode in run.modes()] == [BALANCE, REST]
    np.testing.assert_allclose(run.modes()[1][0], 22.0, atol=0.03)
    assert not run["safe_command"]["effort"][run.t("safe_command") > 22.1].any()
    assert run.metrics["is_safe"] and run.metrics["touching_speed"] < 0.015


def test_a_tracker_that_comes_back_is_admitted_again():
    run = Run("star_tracker.measured.quaternion[0]", "bias", {}, 60.0, from_s=20.0, for_s=15.0, value=3e-3)
    status, t = run["estimator_status"], run.t("estimator_status")
    lost = t[status["tracker_admitted"] == 0.0]
    assert 20.0 < lost[lost > 1.0][0] < 21.0 and 35.0 < lost[-1] < 37.5
    assert status["tracker_isolations"][-1] == 1.0 and run.metrics["attitude_error_max"] < 1e-3


@pytest.mark.parametrize("cell, bit", [("quaternion[1]", 62), ("attitude_covariance[0][0]", 63), ("cross_covariance[0][1]", 62),
                                       ("bias_covariance[1][1]", 62), ("bias[0]", 55), ("gyro_before[0]", 62)])
def test_an_impossible_memory_is_noticed_and_begun_anew(cell, bit):
    run = Run(f"estimator.state.{cell}", "bit_flip", {}, 40.0, from_s=17.1, bit=bit)
    status, t = run["estimator_status"], run.t("estimator_status")
    assert status["restarts"][-1] == 1.0 and run.metrics["fault_detected_by"] == "filter_upset"
    gone = t[(status["valid"] == 0.0) & (t > 1.0)]
    assert 17.09 < gone[0] < 17.12 and len(gone) <= 26  # until the next measurement, 0.25 s
    assert errors(run)[t > 17.5].max() < 3e-4 and run.metrics["end"] == "balanced"


def test_an_upset_copy_of_the_last_sample_is_not_used():
    run = Run("estimator.state.gyro_before[0]", "bit_flip", {}, 40.0, from_s=17.0, bit=55)
    assert run["estimator_status"]["gyro_isolations"][-1] == 0.0 and run.metrics["attitude_error_max"] < 5e-4
