"""Which sensors the navigation filter listens to: tests of whole measurements, isolation, re-admission.

A measurement of residual y and expected covariance S = H P H^T + sigma^2 is tested before anything of it is used:

  jump     z = L^-1 y with S = L L^T;  z.z is chi-square of as many degrees of freedom as the measurement has
  drift    m <- (1 - k) m + k z, of those that pass the first test;  a healthy sensor's z are white, so m.m (2 - k)/k is
           chi-square too: what stays within the noise sample by sample, but leans to one side, is seen here

  repeat   a measurement that equals the last one bit for bit is none: noise does not repeat

A sensor that fails `isolate_after` tests in a row is isolated; isolated, it is still tested, and `readmit_after` passes in
a row let it in again. While nobody corrects the filter its P grows, and S with it, so that an honest sensor comes back.

p: `SensorTests`, x: `Admission`; sensor: STAR_TRACKER, ALTIMETER or CAMERA.
"""

import math

from flight_graph.components.records import Array, Parameters, State, field
from flight_math import Mat3, Vec3, dot, identity3, kernel, mat3, transpose, vec3
from lander_ros.navigation_filter import ATTITUDE, POSITION

STAR_TRACKER, ALTIMETER, CAMERA = range(3)
SENSORS = 3
CHI_SQUARE = "chi-square, one in 1.74 million"


class SensorTests(Parameters):
    star_tracker_gate: float = field(31.81, unit="1", gt=0, source=CHI_SQUARE, doc="of both tests, three degrees")
    altimeter_gate: float = field(25.0, unit="1", gt=0, source=CHI_SQUARE, doc="of both tests, one degree of freedom")
    camera_gate: float = field(28.74, unit="1", gt=0, source=CHI_SQUARE, doc="of both tests, two degrees")
    drift_weight: float = field(0.1, unit="1", gt=0, le=1, doc="k, of the newest measurement in the test of drift")
    repeats_are_faults: bool = field(True, doc="test of repeats, of the inertial unit too; false: no noise")
    isolate_after: int = field(5, ge=1, doc="failed tests in a row")
    readmit_after: int = field(10, ge=1, doc="passed tests in a row")


class Admission(State):
    """Of each sensor: let in (1) or isolated (0), tests in a row that speak for a change, m of the test of drift, the last
    measurement, the time since one was taken [s], measurements refused; how often one was isolated and let in again."""

    admitted: Array(SENSORS)
    in_a_row: Array(SENSORS)
    leaning: Array(SENSORS, 3)
    last: Array(SENSORS, 3)
    since_taken: Array(SENSORS)
    refused: Array(SENSORS)
    isolations: float
    readmissions: float


@kernel
def admit_all(x):
    """At the begin every sensor is let in."""
    for sensor in range(SENSORS):
        x.admitted[sensor] = 1.0


@kernel
def expected(x, by_place, by_turn, sigma):
    """S of a residual by_place dr + by_turn dtheta + noise of sigma on each axis."""
    place, turn = mat3(x.covariance[POSITION, POSITION]), mat3(x.covariance[ATTITUDE, ATTITUDE])
    mixed = by_place @ mat3(x.covariance[POSITION, ATTITUDE]) @ transpose(by_turn)
    return (by_place @ place @ transpose(by_place) + by_turn @ turn @ transpose(by_turn) + mixed + transpose(mixed)
            + sigma * sigma * identity3())


@kernel
def whitened(s, y):
    """L^-1 y, with S = L L^T by Cholesky."""
    a = math.sqrt(s[0, 0])
    b, d = s[1, 0] / a, s[2, 0] / a
    c = math.sqrt(s[1, 1] - b * b)
    e = (s[2, 1] - d * b) / c
    f = math.sqrt(s[2, 2] - d * d - e * e)
    first = y.x / a
    second = (y.y - b * first) / c
    return Vec3(first, second, (y.z - d * first - e * second) / f)


@kernel
def passes(p, x, sensor, z, gate):
    """Whether a whitened residual passes both tests."""
    if not dot(z, z) <= gate:
        return False
    lean = vec3(x.leaning[sensor]) + p.drift_weight * (z - vec3(x.leaning[sensor]))
    x.leaning[sensor] = lean
    return not leans(p, x, sensor, gate)


@kernel
def repeats(p, x, sensor, measured):
    """Whether a measurement, three numbers of it, is the last one again."""
    again = p.repeats_are_faults and all(measured == vec3(x.last[sensor]))
    x.last[sensor] = measured
    return again


@kernel
def leans(p, x, sensor, gate):
    """Whether the test of drift fails: what was taken of the sensor until now leant to one side."""
    lean = vec3(x.leaning[sensor])
    return dot(lean, lean) > gate * p.drift_weight / (2.0 - p.drift_weight)


@kernel
def count_test(x, sensor, passed):
    """Count a test that speaks for a change of the sensor's state; start anew after one that does not."""
    speaks_for_change = passed != (x.admitted[sensor] > 0.5)
    x.in_a_row[sensor] = x.in_a_row[sensor] + 1.0 if speaks_for_change else 0.0


@kernel
def isolation_due(p, x, sensor):
    """Whether a sensor that is let in has failed often enough."""
    return x.admitted[sensor] > 0.5 and x.in_a_row[sensor] >= p.isolate_after


@kernel
def isolate(x, sensor):
    """Shut a sensor out."""
    x.admitted[sensor], x.in_a_row[sensor] = 0.0, 0.0
    x.isolations += 1.0


@kernel
def readmit_if_due(p, x, sensor):
    """Let an isolated sensor in again that has passed often enough."""
    if x.admitted[sensor] < 0.5 and x.in_a_row[sensor] >= p.readmit_after:
        x.admitted[sensor], x.in_a_row[sensor] = 1.0, 0.0
        x.readmissions += 1.0


@kernel
def forgive(x, sensor):
    """Forget what spoke against a sensor: another one was to blame."""
    x.in_a_row[sensor] = 0.0
    x.leaning[sensor] = Vec3(0.0, 0.0, 0.0)


@kernel
def along(direction):
    """Rows of a scalar measurement along a direction, as the first of three; the others measure nothing."""
    return Mat3(direction.x, direction.y, direction.z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
