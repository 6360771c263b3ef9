"""Navigation that survives its sensors: as good as the plain filter without faults; dead reckoning, blame, learning, restarts."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate

STATUS, ODOMETRY = "lander/navigation_status", "lander/odom"
SENSORS = {"star_tracker": "star_tracker.measured", "altimeter": "altimeter.measured", "camera": "camera.measured"}


def test_without_faults_it_is_the_plain_filter_bit_for_bit(broken):
    """Same scenario with `lander_ros/navigation`: its odometry is equal, byte for byte, until the contact."""
    robust = broken()
    data = load("lander_estimated").file.model_dump(by_alias=True, exclude_none=True)
    flown = robust.scenario.file.model_dump(by_alias=True, exclude_none=True)
    for name in ("plant", "imu", "star_tracker", "altimeter", "camera", "gravity"):
        data["components"][name] = flown["components"][name]
    data["components"]["navigation"]["rate_hz"] = 20
    data |= {"duration_s": 200.0, "seed": 1}
    plain = simulate(type(robust.scenario)(data, robust.scenario.origin, robust.scenario.folder))[ODOMETRY]
    rows = robust[ODOMETRY][:len(plain)]
    assert len(plain) == 2000 and rows.tobytes() == plain.tobytes()
    assert robust[STATUS]["star_tracker_rejected"][1999] == robust[STATUS]["imu_rejected"][1999] == 0.0


def test_errors_are_as_large_as_the_covariance_says_while_it_reckons_without_each_sensor(broken):
    """60 s without one sensor: position errors of four runs and three times are chi-square with the covariance."""
    for sensor, place in SENSORS.items():
        total, count = 0.0, 0
        for seed in range(1, 5):
            run = broken(place, "drop", from_s=40, for_s=61, changes={"seed": seed, "duration_s": 101})
            times = run.times(ODOMETRY)
            for time in (60.0, 80.0, 100.0):
                row = np.searchsorted(times, time - 1e-6)
                covariance = run[ODOMETRY]["pose"]["covariance"][row].reshape(6, 6)[:3, :3]
                error = run.errors()[row]
                total, count = total + error @ np.linalg.solve(covariance, error), count + 3
            status = run.at(STATUS, 100.0)
            assert status[f"{sensor}_age"] == pytest.approx(60.2, abs=0.21) and status["valid"] == 1.0
        low, high = chi2.ppf([0.0005, 0.9995], count)
        assert low < total < high, f"{sensor}: {total:.1f} is not within {low:.1f} to {high:.1f}"


def bounds(begin, rate, noise, t):
    """Least and largest variance after t [s] of x' = b + white noise: deviations of x and b at the begin, each (3,), and the
    noise's variance per second; their correlation is whatever it may be."""
    return (rate.min() * t - begin.max()) ** 2 + noise * t, (begin.max() + rate.max() * t) ** 2 + noise * t


def deviations(run, time, part):
    """Standard deviations (3,) of a part of the error state."""
    return np.sqrt(run.at("lander/navigation", time)["variances"][3 * part:3 * part + 3])


def test_sixty_seconds_without_the_star_tracker(broken):
    """Attitude on the gyro alone: its deviation grows with noise and bias of the gyro; the estimate stays valid and good."""
    run = broken("star_tracker.measured", "drop", from_s=40, changes={"duration_s": 101})
    p, step = run.scenario.graph.nodes["navigation"].values, 1.0 / 20.0
    noise = p["gyro_sigma"] ** 2 * step + p["gyro_walk_sigma"] ** 2 / step * 60.0 ** 2 / 3.0
    low, high = bounds(deviations(run, 39.9, 2), deviations(run, 39.9, 3), noise, 60.0)
    assert low < run.at(STATUS, 99.9)["attitude_sigma"] ** 2 < high
    assert (np.diff(run[STATUS]["attitude_sigma"][run.times(STATUS) > 40.5]) > 0.0).all()
    assert (run[STATUS]["valid"][run.times(STATUS) > 20.0] == 1.0).all()
    assert run.landing["nav_attitude_rms_deg"] < 0.02


def test_velocity_without_altimeter_and_camera_grows_as_the_closed_form_says(broken):
    """On the accelerometer alone: its noise and the uncertainty of its bias."""
    run = broken("altimeter.measured", "drop", from_s=40, changes={"duration_s": 101},
                 more=[{"id": "camera", "at": "camera.measured", "type": "drop", "from_s": 40}])
    noise = run.scenario.graph.nodes["navigation"].values["accelerometer_sigma"] ** 2 / 20.0
    low, high = bounds(deviations(run, 39.9, 1), deviations(run, 39.9, 4), noise, 60.0)
    end = run.at(STATUS, 99.9)
    assert low < end["velocity_sigma"] ** 2 < high
    assert (np.diff(run[STATUS]["position_sigma"][run.times(STATUS) > 40.5]) > 0.0).all()
    assert np.linalg.norm(run.errors()[-1]) < 4.0 * end["position_sigma"] * math.sqrt(3.0)


@pytest.mark.parametrize(("sensor", "kind", "keys"), [
    ("star_tracker", "freeze", {}),
    ("altimeter", "freeze", {}),
    ("camera", "freeze", {}),
])
def test_the_sensor_that_lies_is_isolated_and_no_other(broken, sensor, kind, keys):
    run = broken(SENSORS[sensor], kind, from_s=60, changes={"duration_s": 90}, **keys)
    end = run.at(STATUS, 89.0)
    admitted = {name: end[f"{name}_admitted"] for name in SENSORS}
    assert admitted == {name: float(name != sensor) for name in SENSORS}
    assert end["gyro_trusted"] == end["accelerometer_trusted"] == end["valid"] == 1.0


def test_a_sensor_is_let_in_again_after_its_fault(broken):
    run = broken("altimeter.measured.range", "bias", value=2.0, from_s=60, for_s=10, changes={"duration_s": 90})
    assert run.at(STATUS, 65.0)["altimeter_admitted"] == 0.0
    end = run.at(STATUS, 89.0)
    assert end["altimeter_admitted"] == 1.0 and end["isolations"] == end["readmissions"] == 1.0
    assert 70.0 + 9 * 0.2 <= _first(run, STATUS, "readmissions") <= 73.0
    assert np.abs(run.errors()[-1]).max() < 0.2


def _first(run, topic, name):
    """When a number first exceeds 0 [s]."""
    return run.times(topic)[np.argmax(run[topic][name] > 0.0)]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_offset_of_the_gyro_is_blamed_on_it_and_learnt(broken, axis):
    """5 mrad/s on any axis: the star tracker stays; the bias that is learnt is the old one and the offset; trust returns."""
    offset = 5e-3
    run = broken(f"imu.imu.angular_velocity[{axis}]", "bias", value=offset, from_s=60, changes={"duration_s": 95})
    assert run.at(STATUS, 64.0)["gyro_trusted"] == 0.0 and run.at(STATUS, 94.0)["gyro_trusted"] == 1.0
    assert run[STATUS]["star_tracker_admitted"][run.times(STATUS) > 20.0].min() == 1.0
    true = np.array(run.scenario.graph.nodes["imu"].values["gyro_bias"])
    true[axis] += offset
    found = run.at("lander/navigation", 94.0)
    spread = np.sqrt(found["variances"][9:12])
    assert (np.abs(found["gyro_bias"] - true) < 4.0 * spread).all() and spread.max() < 1e-3  # [rad/s]
    assert run.landing["nav_attitude_rms_deg"] < 0.2


def test_an_offset_of_the_accelerometer_is_told_from_a_leak_that_feels_the_same(broken):
    """5 N: as a lie of the accelerometer the altimeter contradicts it, as a leak it does not."""
    lie = broken("imu.imu.linear_acceleration[2]", "bias", value=0.01, from_s=60, changes={"duration_s": 85})
    leak = broken("plant.parameters.force_leak[2]", "stuck", value=5.0, from_s=60, changes={"duration_s": 85})
    for run in (lie, leak):
        assert run.at("lander/thruster_residuals", 64.0)["force"][2] == pytest.approx(5.0 * (1.0 - math.exp(-4.0)), abs=0.3)
    assert lie.at(STATUS, 84.0)["accelerometer_trusted"] == 0.0 and lie.at(STATUS, 84.0)["altimeter_admitted"] == 1.0
    assert leak.at(STATUS, 84.0)["accelerometer_trusted"] == 1.0
    assert np.abs(lie.errors()[-1]).max() < 1.0 and np.abs(leak.errors()[-1]).max() < 0.2  # [m]


def test_the_residual_of_torque_is_the_leak_as_a_first_order_lag(broken):
    run = broken("plant.parameters.torque_leak[1]", "stuck", value=0.3, from_s=60, changes={"duration_s": 70})
    for elapsed in (0.5, 1.0, 2.0, 5.0):
        found = run.at("lander/thruster_residuals", 60.0 + elapsed)["torque"]
        wanted = 0.3 * (1.0 - math.exp(-elapsed))
        assert found[1] == pytest.approx(wanted, abs=0.02) and abs(found[0]) < 0.02 and abs(found[2]) < 0.02


def test_an_upset_of_the_place_is_repaired_from_altimeter_and_camera(broken):
    run = broken("navigation.state.position[2]", "bit_flip", bit=54, from_s=60, changes={"duration_s": 80})
    assert run.at(STATUS, 79.0)["restarts"] == 1.0 and run.at(STATUS, 79.0)["isolations"] == 0.0
    assert np.abs(run.errors()[-1]).max() < 0.3


def test_an_upset_of_the_covariance_makes_it_begin_anew(broken):
    run = broken("navigation.state.covariance[0][0][0][0]", "bit_flip", bit=63, from_s=60, changes={"duration_s": 80})
    assert run.at(STATUS, 79.0)["restarts"] == 1.0 and run.at(STATUS, 79.0)["valid"] == 1.0
    assert np.abs(run.errors()[-1]).max() < 0.3


def test_gravity_that_jumps_is_not_taken(broken):
    run = broken("gravity.gravity.accel.linear[2]", "scale", value=0.5, from_s=60, changes={"duration_s": 80})
    assert run.at(STATUS, 61.0)["gravity_trusted"] == 0.0
    assert np.abs(run.errors()[-1]).max() < 0.2 and run.at(STATUS, 79.0)["isolations"] == 0.0


