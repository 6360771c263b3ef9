"""Consistency of the attitude filter: are its errors as large as its covariance says?

For a consistent filter the normalised estimation error squared (NEES) e^T P^-1 e of the six-dimensional error
(attitude, gyro bias) is chi-square with 6 degrees of freedom, and the normalised innovation squared (NIS) of a star
tracker measurement with 3, white in time (Bar-Shalom, Li, Kirubarajan, "Estimation with applications to tracking and
navigation", 2001, section 5.4).
"""

import numpy as np

from flight_graph.engines.kept import Kept
from flight_graph.graphs.metric_entry import number
from flight_math import kernel, vec3
from sim_nodes.sensors.inertial import WALK_DRAW
from sim_nodes.sensors.white_noise import white_noise

TIMES = (1, 2, 5, 10, 20, 40, 59)  # [s] at which NEES is taken
METRICS = (
    *(number(f"nees_{at}s", "1", f"normalised estimation error squared at {at} s; chi-square with 6 degrees of freedom",
             "the run is shorter") for at in TIMES),
    number("nis_mean", "1", "mean normalised innovation squared of the star tracker, of mean 3", "nothing was measured"),
    number("nis_count", "1", "measurements of the star tracker that were judged"),
    number("innovations_rejected", "1", "measurements that the filter took for outliers"),
    number("attitude_error_rms_rad", "rad", "estimate against truth, from 10 s on", "the run is shorter"),
)


def filter_consistency(scenario, signals, seconds) -> dict:
    """NEES at some times, mean NIS and its count; {} for runs without the filter or a bag that is thinned.

    seconds(records, scenario): time of each record (n,) [s].
    """
    if "cubli/attitude_filter" not in signals or "cubli/imu" not in signals:
        return {}
    inside, truth, imu = (signals[f"cubli/{name}"] for name in ("attitude_filter", "truth/attitude", "imu"))
    if not len(inside) == len(truth) == len(imu):
        return {}
    nees = estimation_error_squared(inside, truth, signals["cubli/attitude"], true_bias(scenario, imu))
    t = seconds(inside, scenario)
    found = {f"nees_{at}s": float(nees[np.searchsorted(t, at)]) if at <= t[-1] else None for at in TIMES}
    measured = np.flatnonzero(np.diff(inside["accepted"] + inside["rejected"]) > 0) + 1
    nis = inside["innovation_squared"][measured]
    found["nis_mean"] = float(nis.mean()) if len(nis) else None
    found["nis_count"] = float(len(nis))
    found["innovations_rejected"] = float(inside["rejected"][-1])
    error, _ = attitude_and_bias_error(truth, signals["cubli/attitude"], inside, true_bias(scenario, imu))
    found["attitude_error_rms_rad"] = float(np.sqrt((error[t >= 10.0] ** 2).mean())) if t[-1] > 10.0 else None
    return found


def estimation_error_squared(inside, truth, estimate, bias) -> np.ndarray:
    """NEES (n,) from filter telemetry, true and estimated attitude (n,) records and the true bias (n, 3) [rad/s]."""
    attitude, bias_error = attitude_and_bias_error(truth, estimate, inside, bias)
    error = np.concatenate([attitude, bias_error], axis=1)
    covariance = inside["covariance"].reshape(-1, 6, 6)
    good = np.trace(covariance, axis1=1, axis2=2) > 0.0
    nees = np.full(len(error), np.nan)
    solved = np.linalg.solve(covariance[good], error[good][:, :, None])[:, :, 0]
    nees[good] = (error[good] * solved).sum(axis=1)
    return nees


def attitude_and_bias_error(truth, estimate, inside, bias) -> tuple:
    """Body-frame rotation vector (n, 3) [rad] from estimated to true attitude, and bias error (n, 3) [rad/s]."""
    q, p = truth["orientation"], estimate["orientation"]
    vector = p[:, 3:] * q[:, :3] - q[:, 3:] * p[:, :3] - np.cross(p[:, :3], q[:, :3])
    scalar = (p * q).sum(axis=1, keepdims=True)
    return 2.0 * np.where(scalar < 0.0, -vector, vector), bias - inside["bias"]


def true_bias(scenario, imu) -> np.ndarray:
    """The gyro's bias (n, 3) [rad/s] at each sample: its walk is a function of the noise stream and is drawn again."""
    values = next(node.values for node, _, signal in scenario.graph.outputs() if signal.topic == "cubli/imu")
    stamp = imu["header"]["stamp"]
    t_ns = stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - scenario.epoch_ns
    out = np.zeros((len(imu), 3))
    key = int(values["seed"])
    given = np.array([[key >> 32, key & 0xFFFFFFFF, values["gyro_walk_sigma"], *values["gyro_bias"]]], float)
    WALK(given, t_ns[:, None].astype(float), out)
    return out


@kernel
def _walk(given, t_ns, out):
    """Bias at each sample into out (n, 3), from its value at the start; it walks after the sample, as in
    `sim_nodes.sensors.inertial.gyro`. given (1, 6): key of the noise in two halves (a double has no 64 bits), sigma,
    the bias at the start; t_ns: (n, 1), exact below 2^53.
    """
    key = int(given[0, 0]) * 4294967296 + int(given[0, 1])
    now = vec3(given[0, 3:6])
    for n in range(len(t_ns)):
        out[n] = now
        now += white_noise(key, int(t_ns[n, 0]), WALK_DRAW, given[0, 2])


WALK = Kept(f"{__name__}:WALK", _walk, 3)
