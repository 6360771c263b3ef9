"""The navigation filter: accuracy against the required noise, consistency of its covariance and of its innovations."""

import math

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from papers.lander.metrics import estimate_errors, seconds

TIMES = (200.0, 600.0, 1000.0, 1400.0)  # [s] far enough apart for nearly independent errors
SEEDS = range(1, 9)


def test_accuracy(fly):
    """Better than 0.02 m + 0.2 % of the distance, 0.01 m/s, 0.1 deg, 0.005 deg/s, from 60 s after the start on."""
    found, _ = fly("lander_estimated")
    assert found["success"] == 1
    assert found["nav_position_over_limit"] < 1.0
    assert found["nav_velocity_rms_mps"] < 0.01
    assert found["nav_attitude_rms_deg"] < 0.1
    assert found["nav_rate_rms_dps"] < 0.005
    assert found["abort_advised"] == 0


def test_errors_are_as_large_as_the_covariance_says(fly):
    """Normalised squared errors of position, velocity and attitude over eight runs are chi-square distributed."""
    totals, count = {"position": 0.0, "velocity": 0.0, "attitude": 0.0}, 0
    for seed in SEEDS:
        _, recording = fly("lander_estimated", seed=seed)
        scenario = recording.scenario
        truth, estimate = recording["lander/truth/odom"], recording["lander/odom"]
        rows = np.searchsorted(seconds(estimate, scenario), TIMES)
        assert (seconds(truth, scenario)[rows] == seconds(estimate, scenario)[rows]).all()
        errors = estimate_errors(truth[rows], estimate[rows])
        for i, row in enumerate(rows):
            record = estimate[row]
            pose = record["pose"]["covariance"].reshape(6, 6)
            to_site = Rotation.from_quat(record["pose"]["pose"]["orientation"]).as_matrix()
            # the twist's error in B holds the attitude's error too, through the rotation of v
            speed = np.cross(truth[rows[i]]["twist"]["twist"]["linear"], np.eye(3))
            attitude = to_site.T @ pose[3:, 3:] @ to_site
            velocity = record["twist"]["covariance"].reshape(6, 6)[:3, :3] + speed @ attitude @ speed.T
            for name, spread in (("position", pose[:3, :3]), ("velocity", velocity), ("attitude", attitude)):
                error = errors[name][i]
                totals[name] += error @ np.linalg.solve(spread, error)
            count += 3
    low, high = chi2.ppf([0.0005, 0.9995], count)
    for name, total in totals.items():
        assert low < total < high, f"{name}: {total:.1f} is not within {low:.1f} to {high:.1f}"


def test_innovations_are_as_large_as_expected(fly):
    """Means of the normalised squared innovations: one, two and three degrees of freedom; hardly any is refused."""
    _, recording = fly("lander_estimated")
    telemetry = recording["lander/navigation"]
    t = seconds(telemetry, recording.scenario)
    rows = telemetry[(t > 10.0) & (t < 1500.0) & (np.round(t * 10) % 2 == 0)]
    for name, degrees in (("range", 1), ("los", 2), ("star", 3)):
        mean = rows[f"{name}_innovation_squared"].mean()
        assert abs(mean - degrees) < 5.0 * math.sqrt(2.0 * degrees / len(rows)), name
    assert rows["rejected"][-1] < 1e-4 * rows["accepted"][-1]


def test_biases_are_found(fly):
    """Within 3.5 standard deviations of the true ones (the gyro's walks on), and much better known than at first."""
    _, recording = fly("lander_estimated")
    imu = recording.scenario.graph.nodes["imu"].values
    row = recording["lander/navigation"][15000]
    for name, first in (("gyro_bias", 9), ("accelerometer_bias", 12)):
        spread = np.sqrt(row["variances"][first:first + 3])
        walked = imu["gyro_walk_sigma"] * math.sqrt(1500.0 * 50.0) if name == "gyro_bias" else 0.0  # [s], [Hz]
        assert (np.abs(row[name] - imu[name]) < 3.5 * np.hypot(spread, walked)).all(), name
        assert (spread < 0.5 * np.sqrt(recording["lander/navigation"][0]["variances"][first:first + 3])).all(), name
