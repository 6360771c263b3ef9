"""Navigation that survives its sensors: the filter of `lander_ros.navigation_filter` with tests, isolation and a status.

Beside `lander_ros.navigation`, with the same mathematics. Each measurement is tested as a whole (`sensor_admission`); while
a sensor is isolated or silent the filter goes on without it, on the inertial unit, and its covariance grows. What then
still counts as good enough to fly on is the status's `valid`: limits on the covariance, not on the time. Whom a
contradiction blames stands in `contradictions`.
"""

import math

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import field
from flight_math import (
    Vec3,
    diagonal_of,
    identity3,
    kernel,
    largest,
    mat3,
    norm,
    smallest,
    sqrt,
    stack_array,
    vector_part,
)
from lander_ros import navigation_filter
from lander_ros.contradictions import (
    Contradictions,
    Quarrel,
    find_place,
    hear_altimeter,
    hear_camera,
    hear_star_tracker,
    is_unit,
)
from lander_ros.inertial_trust import (
    InertialTests,
    InertialTrust,
    plausible_force,
    plausible_gravity,
    plausible_rate,
    review_trust,
    spread_substitutes,
    start_inertial,
)
from lander_ros.navigation import NavigationParameters, NavigationState, attitude, begin, publish
from lander_ros.navigation_filter import ATTITUDE, GYRO, PARTS, POSITION, VELOCITY
from lander_ros.sensor_admission import (
    ALTIMETER,
    CAMERA,
    SENSORS,
    STAR_TRACKER,
    Admission,
    SensorTests,
    admit_all,
    forgive,
    repeats,
)
from lander_ros.thruster_residuals import ThrusterModel, ThrusterWatch, start_torque_watch, watch_force, watch_torque
from msg_schemas import lander

INSANE = 1e8  # [m^2, m^2/s^2, rad^2, ...] no variance of an estimate


class RobustNavigationParameters(NavigationParameters, SensorTests, InertialTests, Contradictions, ThrusterModel):
    gate: float = field(40.0, unit="1", gt=0, doc="of a single scalar; above the gates of whole measurements")
    position_limit: float = field(2.0, unit="m", gt=0, doc="largest standard deviation of a valid estimate")
    position_relative_limit: float = field(0.02, unit="1", ge=0, doc="and more of it, relative to the distance")
    velocity_limit: float = field(0.1, unit="m/s", gt=0, doc="largest standard deviation of a valid estimate")
    attitude_limit: float = field(0.05, unit="rad", gt=0, doc="largest standard deviation of a valid estimate")
    rate_limit: float = field(0.02, unit="rad/s", gt=0, doc="largest standard deviation of a valid estimate")


class RobustNavigationState(NavigationState, Admission, InertialTrust, Quarrel, ThrusterWatch):
    """What the filter knows, and whom it believes."""


@kernel
def navigate(t_ns, p, x, inputs, outputs):
    """One sample of the inertial unit, and what other sensors have new and credible, into the estimate."""
    now = outputs.odometry.header.stamp
    imu_new = same_stamp(inputs.imu.header.stamp, now)
    star = same_stamp(inputs.star_tracker.header.stamp, now)
    ranged = same_stamp(inputs.altimeter.header.stamp, now) and 0.0 < inputs.altimeter.range < math.inf
    seen = same_stamp(inputs.camera.header.stamp, now) and any(inputs.camera.vector != 0.0)
    distance, direction = float(inputs.altimeter.range), inputs.camera.vector
    for sensor in range(SENSORS):
        x.since_taken[sensor] += p.period
    if x.begun and not is_sane(x):
        forget(x)
    if x.begun:
        advance(p, x, inputs, imu_new)
        correction = stack_array(PARTS, 3)
        if star:
            repeated = repeats(p, x, STAR_TRACKER, vector_part(inputs.star_tracker.quaternion))
            hear_star_tracker(p, x, correction, attitude(p, t_ns, inputs.star_tracker), repeated, direction, seen)
        if ranged:
            hear_altimeter(p, x, correction, distance)
        if seen:
            hear_camera(p, x, correction, direction)
        if star or ranged or seen:
            navigation_filter.inject(x, correction)
        if x.lost and ranged and seen:
            find_place(p, x, distance, direction)
    elif (imu_new and star and ranged and seen and is_unit(norm(inputs.star_tracker.quaternion))
          and is_unit(norm(direction))):
        x.orientation, x.rate_before = attitude(p, t_ns, inputs.star_tracker), inputs.imu.angular_velocity
        begin(p, x, distance, direction)
        admit_all(x)
        start_inertial(x, inputs.imu)
        start_torque_watch(p, x, inputs.imu.angular_velocity)
    publish(p, x, x.gyro_held, outputs.odometry, outputs.filter)
    report(p, x, outputs.status, outputs.residuals)


@kernel
def is_sane(x):
    """Whether estimate and covariance can be those of anything: a bit that flips in memory may make them otherwise."""
    sane = norm(x.position) < INSANE and norm(x.velocity) < INSANE and is_unit(norm(x.orientation))
    for part in range(PARTS):
        variances = diagonal_of(mat3(x.covariance[part, part]))
        sane = sane and smallest(variances) > 0.0 and largest(variances) < INSANE
    return sane


@kernel
def forget(x):
    """Begin anew with the next sample in which all sensors have something to say."""
    x.begun, x.lost, x.referee = False, False, 0.0
    x.restarts += 1.0
    x.gyro_bias, x.accelerometer_bias = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    x.position, x.velocity, x.force_residual = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for i in range(PARTS):
        for j in range(PARTS):
            x.covariance[i, j] = 0.0 * identity3()
    for sensor in range(SENSORS):
        forgive(x, sensor)


@kernel
def advance(p, x, inputs, imu_new):
    """Carry estimate, covariance and residuals over a period, on what is believed of the inertial unit."""
    rate = plausible_rate(p, x, inputs.imu, imu_new)
    force = plausible_force(p, x, inputs.imu, imu_new, inputs.command)
    if x.force_since == 0.0:
        watch_force(p, x, inputs.imu.linear_acceleration - x.accelerometer_bias, inputs.command)
    if x.gyro_since == 0.0 and x.gyro_trusted:
        watch_torque(p, x, rate - x.gyro_bias, inputs.command)
        if norm(x.torque_residual) > p.torque_surprise:
            x.surprised_since = 0.0
    else:
        start_torque_watch(p, x, rate - x.gyro_bias)
    navigation_filter.predict(p, x, force, rate, plausible_gravity(p, x, inputs.gravity.accel.linear))
    spread_substitutes(p, x)
    review_trust(p, x)


@kernel
def deviation(x, part):
    """The largest standard deviation of an axis of a part of the error state."""
    return sqrt(largest(diagonal_of(mat3(x.covariance[part, part]))))


@kernel
def report(p, x, status, residuals):
    """The status, and what is felt of the thrusters."""
    status.imu_age = max(x.gyro_since, x.force_since)
    status.star_tracker_age, status.altimeter_age = x.since_taken[STAR_TRACKER], x.since_taken[ALTIMETER]
    status.camera_age = x.since_taken[CAMERA]
    status.star_tracker_admitted, status.altimeter_admitted = x.admitted[STAR_TRACKER], x.admitted[ALTIMETER]
    status.camera_admitted = x.admitted[CAMERA]
    status.gyro_trusted = 1.0 if x.gyro_trusted else 0.0
    status.accelerometer_trusted = 1.0 if x.accelerometer_trusted else 0.0
    status.star_tracker_rejected, status.altimeter_rejected = x.refused[STAR_TRACKER], x.refused[ALTIMETER]
    status.camera_rejected, status.imu_rejected = x.refused[CAMERA], x.samples_refused
    status.gravity_trusted = 1.0 if x.gravity_since == 0.0 else 0.0
    status.restarts = x.restarts
    status.isolations, status.readmissions, status.referee = x.isolations, x.readmissions, x.referee
    residuals.force, residuals.torque = x.force_residual, x.torque_residual
    residuals.force_size, residuals.torque_size = norm(x.force_residual), norm(x.torque_residual)
    if not (x.begun and is_sane(x)):
        status.valid = 0.0
        return
    status.position_sigma, status.velocity_sigma = deviation(x, POSITION), deviation(x, VELOCITY)
    status.attitude_sigma, status.rate_sigma = deviation(x, ATTITUDE), deviation(x, GYRO)
    reach = p.position_limit + p.position_relative_limit * norm(x.position)
    is_valid = (status.position_sigma <= reach and status.velocity_sigma <= p.velocity_limit
                and status.attitude_sigma <= p.attitude_limit and status.rate_sigma <= p.rate_limit)
    status.valid = 1.0 if is_valid else 0.0


class RobustNavigation(Component):
    """Kalman filter of the lander that tests, isolates and re-admits its sensors, and says how far it is to be believed.

    Promises: what navigation promises, and `status.valid`, the flag to obey: while it is 1 the filter's own standard
    deviations are within `position_limit`, `velocity_limit`, `attitude_limit` and `rate_limit`. Residuals of force [N]
    and torque [N m] tell of thrusters.

    Bad input: each measurement is tested as a whole; a sensor that fails too often in a row is isolated, and comes back
    when it agrees again. Inertial samples that cannot be are replaced by the last good one, or by what was commanded,
    with more noise. A contradiction is decided by the sensor that two others side against. An estimate that no filter
    can have (an upset) begins anew.
    """

    parameters, state = RobustNavigationParameters, RobustNavigationState
    inputs = {"imu": lander.IMU, "star_tracker": lander.STAR_TRACKER, "altimeter": lander.ALTIMETER,
              "camera": lander.SITE_LOS, "gravity": lander.GRAVITY, "command": lander.SAFE_COMMAND}
    outputs = {"odometry": lander.ODOMETRY, "filter": lander.NAVIGATION, "status": lander.NAVIGATION_STATUS,
               "residuals": lander.THRUSTER_RESIDUALS}
    rate_hz = 20.0
    kernel = navigate
