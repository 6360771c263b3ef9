"""Whom a contradiction between a sensor and the navigation filter blames; one failure at a time.

  star tracker against filter         the camera is the referee: which attitude explains the direction of the mark, the
                                      filter's (the gyro is right) or the star tracker's (the gyro has misled the filter)?
                                      A torque that the gyro has felt shortly before speaks against it too: a true one
                                      would not have made the star tracker differ. Meanwhile the camera only judges
  altimeter or camera against filter  the accelerometer, where it feels a force that was not commanded; else the filter's
                                      place, where both contradict it: it begins anew from the two; else that sensor
  a force or torque, all sensors agree   nobody here: the thrusters (`lander_ros.thruster_residuals`)

p: `Contradictions` with the parameters of filter, `sensor_admission` and `inertial_trust`; x: `Quarrel` likewise.
"""

from flight_graph.components.records import Parameters, State, field
from flight_math import Vec3, dot, identity3, kernel, norm, rotate_back, same, vec3
from lander_ros import navigation_filter
from lander_ros.inertial_trust import distrust_accelerometer, distrust_gyro
from lander_ros.navigation import place_at
from lander_ros.navigation_filter import ATTITUDE, PARTS, POSITION, VELOCITY
from lander_ros.sensor_admission import (
    ALTIMETER,
    CAMERA,
    STAR_TRACKER,
    along,
    count_test,
    expected,
    forgive,
    isolate,
    isolation_due,
    leans,
    passes,
    readmit_if_due,
    repeats,
    whitened,
)

OFF_NORM = 1e-3  # [1] by which the norm of a measured unit vector or quaternion may differ from one


class Contradictions(Parameters):
    referee_limit: float = field(15.0, unit="1", gt=0, doc="log likelihood ratio at which the camera's word counts")
    decide_within: int = field(75, ge=1, doc="failed tests of the star tracker in a row that the camera may take to decide")
    drift_velocity_sigma: float = field(0.02, unit="m/s", gt=0, doc="what a sensor that drifts does before it is isolated")


class Quarrel(State):
    """The camera's log likelihood ratio as a referee; whether the filter's place is lost; how often it began anew, wholly
    or with its place."""

    referee: float
    lost: bool
    restarts: float


@kernel
def is_unit(length):
    """Whether a norm is that of a unit vector or quaternion."""
    return abs(length - 1.0) <= OFF_NORM


@kernel
def hear_star_tracker(p, x, correction, measured, repeated, direction, seen):
    """Test an attitude; take it, or refuse it and find out who is to blame."""
    y = navigation_filter.attitude_residual(x, measured) - vec3(correction[ATTITUDE])
    z = whitened(expected(x, 0.0 * identity3(), identity3(), p.star_tracker_sigma), y)
    known = is_unit(norm(measured)) and not repeated
    good = known and passes(p, x, STAR_TRACKER, z, p.star_tracker_gate)
    x.star_squared = dot(z, z)
    count_test(x, STAR_TRACKER, good)
    judged = known and seen and x.admitted[CAMERA] > 0.5 and is_unit(norm(direction))
    if good:
        x.referee = 0.0
    elif judged:
        consult_camera(p, x, measured, direction)
    if isolation_due(p, x, STAR_TRACKER):
        if known and x.gyro_trusted and (x.referee > p.referee_limit or x.surprised_since < p.suspicion_time):
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
    good = not repeats(p, x, ALTIMETER, same(measured)) and passes(p, x, ALTIMETER, z, p.altimeter_gate)
    x.range_squared = dot(z, z)
    count_test(x, ALTIMETER, good)
    blame_for_place(p, x, ALTIMETER, CAMERA, p.altimeter_gate)
    if settled(p, x, ALTIMETER, good):
        navigation_filter.take_range(p, x, correction, measured)


@kernel
def hear_camera(p, x, correction, measured):
    """Test a direction; take it, or refuse it and find out who is to blame."""
    direction, by_place, by_turn = navigation_filter.direction_seen(p, x)
    y = (measured - direction - by_place @ vec3(correction[POSITION]) - by_turn @ vec3(correction[ATTITUDE]))
    z = whitened(expected(x, by_place, by_turn, p.camera_sigma), y)
    known = is_unit(norm(measured)) and not repeats(p, x, CAMERA, measured)
    good = known and passes(p, x, CAMERA, z, p.camera_gate)
    x.los_squared = dot(z, z)
    count_test(x, CAMERA, good)
    is_referee = x.admitted[STAR_TRACKER] > 0.5 and x.in_a_row[STAR_TRACKER] > 0.0
    if not is_referee:
        blame_for_place(p, x, CAMERA, ALTIMETER, p.camera_gate)
    if settled(p, x, CAMERA, good) and not is_referee:
        navigation_filter.take_direction(p, x, correction, measured)


@kernel
def blame_for_place(p, x, sensor, other, gate):
    """Find out who is to blame once a sensor of the place has failed often enough.

    One that has drifted was believed for a while: the covariance allows for what that has done to the velocity.
    """
    if not isolation_due(p, x, sensor):
        return
    if x.accelerometer_trusted and norm(x.force_residual) > p.force_residual_limit:
        distrust_accelerometer(p, x)
        forgive(x, sensor)
        forgive(x, other)
    elif x.admitted[other] > 0.5 and x.in_a_row[other] > 1.0:
        x.lost = True
    else:
        if leans(p, x, sensor, gate):
            navigation_filter.add_variance(x.covariance, VELOCITY, p.drift_velocity_sigma)
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
