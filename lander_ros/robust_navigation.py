"""Navigation that survives its sensors: the filter of `lander_ros.navigation_filter` with tests, isolation and a status.

Beside `lander_ros.navigation`, with the same mathematics. Each measurement is tested as a whole (`sensor_admission`); while
a sensor is isolated or silent the filter goes on without it, on the inertial unit, and its covariance grows. What then
still counts as good enough to fly on is the status's `valid`: limits on the covariance, not on the time.

Whom a contradiction blames (one failure at a time):
  star tracker against filter         the camera is the referee: which attitude explains the direction of the mark, the
                                      filter's (the gyro is right) or the star tracker's (the gyro has misled the filter)?
                                      A torque that the gyro has felt shortly before speaks against it too: a true one
                                      would not have made the star tracker differ. Meanwhile the camera only judges
  altimeter or camera against filter  the accelerometer, where it feels a force that was not commanded; else the filter's
                                      place, where both contradict it: it begins anew from the two; else that sensor
  a force or torque, all sensors agree   nobody here: the thrusters (`lander_ros.thruster_residuals`)
"""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import field
from flight_math import (
    Vec3,
    diagonal_of,
    dot,
    identity3,
    kernel,
    largest,
    mat3,
    norm,
    rotate_back,
    smallest,
    sqrt,
    stack_array,
    vec3,
)
from lander_ros import navigation_filter
from lander_ros.inertial_trust import (
    InertialTests,
    InertialTrust,
    distrust_accelerometer,
    distrust_gyro,
    plausible_force,
    plausible_gravity,
    plausible_rate,
    review_trust,
    spread_substitutes,
    start_inertial,
)
from lander_ros.navigation import NavigationParameters, NavigationState, attitude, begin, place_at, publish
from lander_ros.navigation_filter import ATTITUDE, GYRO, PARTS, POSITION, VELOCITY
from lander_ros.sensor_admission import (
    ALTIMETER,
    CAMERA,
    SENSORS,
    STAR_TRACKER,
    Admission,
    SensorTests,
    admit_all,
    along,
    count_test,
    expected,
    forgive,
    isolate,
    isolation_due,
    passes,
    readmit_if_due,
    whitened,
)
from lander_ros.thruster_residuals import ThrusterModel, ThrusterWatch, start_torque_watch, watch_force, watch_torque
from msg_schemas import lander

INSANE = 1e8  # [m^2, m^2/s^2, rad^2, ...] no variance of an estimate
OFF_NORM = 1e-3  # [1] by which the norm of a measured unit vector or quaternion may differ from one


class RobustNavigationParameters(NavigationParameters, SensorTests, InertialTests, ThrusterModel):
    gate: float = field(40.0, unit="1", gt=0, doc="of a single scalar; above the gates of whole measurements")
    referee_limit: float = field(15.0, unit="1", gt=0, doc="log likelihood ratio at which the camera's word counts")
    decide_within: int = field(75, ge=1, doc="failed tests of the star tracker in a row that the camera may take to decide")
    position_limit: float = field(2.0, unit="m", gt=0, doc="largest standard deviation of a valid estimate")
    position_relative_limit: float = field(0.02, unit="1", ge=0, doc="and more of it, relative to the distance")
    velocity_limit: float = field(0.1, unit="m/s", gt=0, doc="largest standard deviation of a valid estimate")
    attitude_limit: float = field(0.05, unit="rad", gt=0, doc="largest standard deviation of a valid estimate")
    rate_limit: float = field(0.02, unit="rad/s", gt=0, doc="largest standard deviation of a valid estimate")


class RobustNavigationState(NavigationState, Admission, InertialTrust, ThrusterWatch):
    """What the filter knows, whom it believes; referee: the camera's log likelihood ratio; lost: its place is; how often it
    began anew, wholly or with its place."""

    referee: float
    lost: bool
    restarts: float


@kernel
def navigate(t_ns, p, x, inputs, outputs):
    """One sample of the inertial unit, and what other sensors have new and credible, into the estimate."""
    now = outputs.odometry.header.stamp
    imu_new = same_stamp(inputs.imu.header.stamp, now)
    star = same_stamp(inputs.star_tracker.header.stamp, now)
    ranged = same_stamp(inputs.altimeter.header.stamp, now) and inputs.altimeter.range > 0.0
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
            hear_star_tracker(p, x, correction, attitude(p, t_ns, inputs.star_tracker), direction, seen)
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
def is_unit(length):
    """Whether a norm is that of a unit vector or quaternion."""
    return abs(length - 1.0) <= OFF_NORM


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
def hear_star_tracker(p, x, correction, measured, direction, seen):
    """Test an attitude; take it, or refuse it and find out who is to blame."""
    y = navigation_filter.attitude_residual(x, measured) - vec3(correction[ATTITUDE])
    z = whitened(expected(x, 0.0 * identity3(), identity3(), p.star_tracker_sigma), y)
    good = is_unit(norm(measured)) and passes(p, x, STAR_TRACKER, z, p.star_tracker_gate)
    x.star_squared = dot(z, z)
    count_test(x, STAR_TRACKER, good)
    judged = seen and x.admitted[CAMERA] > 0.5 and is_unit(norm(measured)) and is_unit(norm(direction))
    if good:
        x.referee = 0.0
    elif judged:
        consult_camera(p, x, measured, direction)
    if isolation_due(p, x, STAR_TRACKER):
        if x.gyro_trusted and (x.referee > p.referee_limit or x.surprised_since < p.suspicion_time):
            distrust_gyro(p, x, norm(y))
            forgive(x, STAR_TRACKER)
            forgive(x, CAMERA)
        elif x.referee < -p.referee_limit or not judged or x.in_a_row[STAR_TRACKER] >= p.decide_within:
            isolate(x, STAR_TRACKER)
    if settled(p, x, STAR_TRACKER, good):
        navigation_filter.take_attitude(p, x, correction, measured)


@kernel
def consult_camera(p, x, measured, direction):
    """Add to the referee: how much better a measured attitude explains the direction of the mark than the filter's does."""
    to_mark, _ = navigation_filter.mark_direction(p, x.position)
    by_filter = direction - rotate_back(x.orientation, to_mark)
    by_star_tracker = direction - rotate_back(measured, to_mark)
    gain = dot(by_filter, by_filter) - dot(by_star_tracker, by_star_tracker)
    x.referee += 0.5 * gain / (p.camera_sigma * p.camera_sigma)


@kernel
def hear_altimeter(p, x, correction, measured):
    """Test a distance; take it, or refuse it and find out who is to blame."""
    to_mark, distance = navigation_filter.mark_direction(p, x.position)
    y = measured - distance + dot(to_mark, vec3(correction[POSITION]))
    s = expected(x, along(-to_mark), 0.0 * identity3(), navigation_filter.range_sigma(p, distance))
    z = whitened(s, Vec3(y, 0.0, 0.0))
    good = passes(p, x, ALTIMETER, z, p.altimeter_gate)
    x.range_squared = dot(z, z)
    count_test(x, ALTIMETER, good)
    blame_for_place(p, x, ALTIMETER, CAMERA)
    if settled(p, x, ALTIMETER, good):
        navigation_filter.take_range(p, x, correction, measured)


@kernel
def hear_camera(p, x, correction, measured):
    """Test a direction; take it, or refuse it and find out who is to blame."""
    direction, by_place, by_turn = navigation_filter.direction_seen(p, x)
    y = (measured - direction - by_place @ vec3(correction[POSITION]) - by_turn @ vec3(correction[ATTITUDE]))
    z = whitened(expected(x, by_place, by_turn, p.camera_sigma), y)
    good = is_unit(norm(measured)) and passes(p, x, CAMERA, z, p.camera_gate)
    x.los_squared = dot(z, z)
    count_test(x, CAMERA, good)
    is_referee = x.admitted[STAR_TRACKER] > 0.5 and x.in_a_row[STAR_TRACKER] > 0.0
    if not is_referee:
        blame_for_place(p, x, CAMERA, ALTIMETER)
    if settled(p, x, CAMERA, good) and not is_referee:
        navigation_filter.take_direction(p, x, correction, measured)


@kernel
def blame_for_place(p, x, sensor, other):
    """Find out who is to blame once a sensor of the place has failed often enough."""
    if not isolation_due(p, x, sensor):
        return
    if x.accelerometer_trusted and norm(x.force_residual) > p.force_residual_limit:
        distrust_accelerometer(p, x)
        forgive(x, sensor)
        forgive(x, other)
    elif x.admitted[other] > 0.5 and x.in_a_row[other] > 1.0:
        x.lost = True
    else:
        isolate(x, sensor)


@kernel
def settled(p, x, sensor, good):
    """Let a sensor in again where it is due; whether its measurement is to be taken."""
    readmit_if_due(p, x, sensor)
    take = good and x.admitted[sensor] > 0.5
    if take:
        x.since_taken[sensor] = 0.0
    if not good:
        x.refused[sensor] += 1.0
    return take


@kernel
def find_place(p, x, distance, direction):
    """Take the place from altimeter and camera alone, at an unknown velocity; attitude and biases stay."""
    for part in range(PARTS):
        for whole in (POSITION, VELOCITY):
            x.covariance[part, whole] = 0.0 * identity3()
            x.covariance[whole, part] = 0.0 * identity3()
    x.velocity, x.lost = Vec3(0.0, 0.0, 0.0), False
    x.restarts += 1.0
    place_at(p, x, distance, direction)
    forgive(x, ALTIMETER)
    forgive(x, CAMERA)


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
    """Kalman filter of the lander that tests, isolates and re-admits its sensors, and says how far it is to be believed."""

    parameters, state = RobustNavigationParameters, RobustNavigationState
    inputs = {"imu": lander.IMU, "star_tracker": lander.STAR_TRACKER, "altimeter": lander.ALTIMETER,
              "camera": lander.SITE_LOS, "gravity": lander.GRAVITY, "command": lander.SAFE_COMMAND}
    outputs = {"odometry": lander.ODOMETRY, "filter": lander.NAVIGATION, "status": lander.NAVIGATION_STATUS,
               "residuals": lander.THRUSTER_RESIDUALS}
    rate_hz = 20.0
    kernel = navigate
