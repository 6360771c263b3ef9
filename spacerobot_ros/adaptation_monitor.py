"""Watch over the adaptation: prediction error, excitation, physical consistency of the estimate, saturation.

Excitation is the singular values of all regressors so far (`spacerobot_ros.excitation`), consistency the
pseudo-inertia of each body. While a torque is at its limit, or the wheels are, ``freeze`` tells the estimators to rest.
"""

import math

from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, State, field
from flight_math import kernel, stack_array
from msg_schemas import spacerobot
from msg_schemas.definitions import TYPESTORE
from spacerobot_ros.excitation import accumulate, singular_values
from spacerobot_ros.motion_inputs import believed, measured_motion, measured_torques
from spacerobot_ros.natural_adaptation import smallest_eigenvalues
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior

OK, WARNING, ERROR = 0, 1, 2
REPORT_PERIOD_NS = 1_000_000_000  # [ns] 1 Hz
EXCITED = 1e-3  # [-] part of the largest singular value
SEEN = 1e-9  # [-] likewise: above rounding, below the weakest direction met


def monitor_parameters(joints):
    """Parameters of the monitor."""

    class MonitorParameters(believed_parameters(joints)):
        warn_prediction: float = field(0.05, unit="N m", gt=0, doc="warn when the prediction error is above this")

    return MonitorParameters


def monitor_state(joints):
    """State of the monitor: the triangular factor of all regressors, and what happened since the last report."""
    count = 10 * (joints + 1)

    class MonitorState(State):
        triangle: Array(count, count)
        squared: float
        samples: float
        saturated: float
        unread: float

    return MonitorState


@kernel
def mismatch(y, pi_hat, torques):
    """|tau - Y pi_hat| of the moment and joint rows [N m]; -1 when a reading is not finite."""
    total = 0.0
    for r in range(len(y)):
        value = torques[r]
        for c in range(len(pi_hat)):
            value -= y[r, c] * pi_hat[c]
        total += value * value
    return math.sqrt(total) if math.isfinite(total) else -1.0


@kernel
def observe(p, x, inputs, pi_hat, status):
    """One sample: its regressor into the excitation, its prediction error into the books."""
    n, count = len(p.parent), len(pi_hat)
    y, torques, rotation, scale = stack_array(6 + n, count), stack_array(6 + n), stack_array(n, 3, 3), stack_array(count)
    for c in range(count):
        scale[c] = abs(p.prior[c]) if p.prior[c] != 0.0 else 1.0
    tree, motion = measured_motion(p, inputs, rotation)
    measured_torques(inputs, torques)
    regressor(tree, motion, y)
    accumulate(y, scale, x.triangle)
    error = mismatch(y[3:], pi_hat, torques[3:])
    if error < 0.0:
        x.unread += 1.0
    else:
        status.prediction_error = error
        x.squared += error * error
        x.samples += 1.0


@kernel
def report(p, x, pi_hat, health):
    """Excitation and consistency, once a second."""
    values, smallest = stack_array(len(pi_hat)), stack_array(len(pi_hat) // 10)
    singular_values(x.triangle, values)
    smallest_eigenvalues(pi_hat, smallest)
    excited, rank, impossible = 0.0, 0.0, 0.0
    for value in values:
        excited += value > EXCITED * values[0]
        rank += value > SEEN * values[0]
    for value in smallest:
        impossible += not value > 0.0
    health.singular_values, health.smallest_eigenvalue = values, smallest
    health.excited, health.rank, health.impossible = excited, rank, impossible
    health.prediction_error = math.sqrt(x.squared / max(x.samples, 1.0))
    health.saturated, health.unread = x.saturated, x.unread
    health.level = OK
    if impossible > 0.0 or health.prediction_error > p.warn_prediction or x.unread > 0.0:
        health.level = WARNING
    if x.saturated > 0.5 * max(x.samples, 1.0):
        health.level = ERROR
    x.squared, x.samples, x.saturated = 0.0, 0.0, 0.0


@kernel
def watch(t_ns, p, x, inputs, outputs):
    """Status every sample; health once a second."""
    status, pi_hat = outputs.status, stack_array(len(p.prior))
    believed(p, inputs.parameters, pi_hat)
    status.saturated = 1.0 if inputs.control.clipped > 0.0 or inputs.wheels.limited > 0.0 else 0.0
    status.freeze = status.saturated
    x.saturated += status.saturated
    if inputs.odometry.header.stamp.sec != 0 and inputs.accelerations.known > 0.0:
        observe(p, x, inputs, pi_hat, status)
    status.unread = x.unread
    if t_ns % REPORT_PERIOD_NS == 0:
        report(p, x, pi_hat, outputs.health)


def diagnostics(record):
    """The health report as a DiagnosticArray."""
    types = TYPESTORE.types
    level = int(record.level)
    names = ("excited", "rank", "impossible", "prediction_error", "saturated", "unread")
    values = [types["diagnostic_msgs/msg/KeyValue"](name, f"{float(getattr(record, name)):.6g}") for name in names]
    text = "adaptation is healthy"
    if record.impossible > 0.0:
        text = f"the estimate of {int(record.impossible)} bodies cannot exist (pseudo-inertia not positive)"
    elif record.unread > 0.0:
        text = f"{int(record.unread)} torque readings were not finite and were skipped"
    elif level == WARNING:
        text = "the estimate predicts the torques badly"
    if level == ERROR:
        text = "actuators are at their limits; adaptation rests"
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    return types["diagnostic_msgs/msg/DiagnosticArray"](types["std_msgs/msg/Header"](time, ""), [
        types["diagnostic_msgs/msg/DiagnosticStatus"](level, "adaptation_monitor", text, "spacerobot", values)])


def monitor(topics: spacerobot.Topics) -> type[Component]:
    """The monitor of a robot with these topics."""

    class AdaptationMonitor(Component):
        """Watches the space robot's adaptation: prediction error, excitation, consistency, saturation.

        Promises: at every firing the torque that the estimate mispredicts [N m] and whether learning should rest; once
        a second how many directions of the parameters have been excited, and whether each body of the estimate can
        exist. Also on /diagnostics.

        Bad input: a torque reading that is not finite is left out and counted (`unread`). Before a first estimate of
        the motion nothing is judged. Without an estimate of the parameters the prior is judged.
        """

        parameters, state = monitor_parameters(topics.joints), monitor_state(topics.joints)
        inputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                  "torque": topics.torque_estimate, "parameters": topics.parameters, "control": topics.control,
                  "wheels": topics.wheel_momentum}
        optional_inputs = ("parameters", "wheels")
        outputs = {"status": topics.monitor, "health": topics.health}
        output_rate_hz = {"health": 1.0}
        rate_hz = 50.0
        formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "health", diagnostics),)
        kernel = watch

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return AdaptationMonitor


AdaptationMonitor = monitor(spacerobot.MINI)
