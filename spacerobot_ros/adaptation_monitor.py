"""Watch over the adaptation: prediction error, excitation, physical consistency of the estimate, saturation.

Excitation is the singular values of all regressors so far (`spacerobot_ros.excitation`), consistency the
pseudo-inertia of
each body. While a torque is at its limit, or the wheels are, ``freeze`` tells the estimators to rest.
"""

import math

import numpy as np

from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from msg_schemas.definitions import TYPESTORE
from spacerobot_ros.excitation import accumulate, singular_values
from spacerobot_ros.motion_inputs import motion_state, read_motion
from spacerobot_ros.natural_adaptation import WORK, smallest_eigenvalues
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior, tree_indices

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
    n, count = joints, 10 * (joints + 1)

    class MonitorState(motion_state(joints)):
        y: Array(6 + n, count)
        moving: Array(n + 1, 12)
        block: Array(6, 10)
        magnitude: Array(count)
        triangle: Array(count, count)
        row: Array(count)
        values: Array(count)
        work: Array(count, count)
        pi_hat: Array(count)
        smallest: Array(n + 1)
        body_work: Array(*WORK)
        first_row: int
        squared: float
        samples: float
        saturated: float
        unread: float

    return MonitorState


@kernel
def start(p, x):
    tree_indices(p.parent[:], x.tree.view(np.int64))
    for c in range(p.prior.shape[0]):
        x.magnitude[c] = abs(p.prior[c]) if p.prior[c] != 0.0 else 1.0


@kernel
def predict(p, x):
    """|tau - Y pi_hat| of the moment and joint rows [N m]; -1 when a reading is not finite."""
    total = 0.0
    for r in range(3, x.y.shape[0]):
        value = x.measured[r]
        for c in range(x.pi_hat.shape[0]):
            value -= x.y[r, c] * x.pi_hat[c]
        total += value * value
    return math.sqrt(total) if math.isfinite(total) else -1.0


@kernel
def report(p, x, health):
    """Excitation and consistency, once a second."""
    singular_values(x.triangle[:], x.values[:], x.work[:])
    smallest_eigenvalues(x.pi_hat[:], x.smallest[:], x.body_work[:])
    excited, rank, impossible = 0.0, 0.0, 0.0
    for c in range(x.values.shape[0]):
        health.singular_values[c] = x.values[c]
        excited += 1.0 if x.values[c] > EXCITED * x.values[0] else 0.0
        rank += 1.0 if x.values[c] > SEEN * x.values[0] else 0.0
    for b in range(x.smallest.shape[0]):
        health.smallest_eigenvalue[b] = x.smallest[b]
        impossible += 0.0 if x.smallest[b] > 0.0 else 1.0
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
def watch(t_ns, p, x, odometry, joints, accelerations, torque, parameters, control, wheels, status, health):
    """Status every sample; health once a second."""
    for c in range(x.pi_hat.shape[0]):
        x.pi_hat[c] = parameters.pi[c] if parameters.header.stamp.sec != 0 else p.prior[c]
    status.saturated = 1.0 if control.clipped > 0.0 or wheels.limited > 0.0 else 0.0
    status.freeze = status.saturated
    x.saturated += status.saturated
    if odometry.header.stamp.sec != 0 and accelerations.known > 0.0:
        read_motion(p, x, odometry, joints, accelerations, torque)
        regressor(
            x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.base_motion[0], x.base_motion[0],
            x.base_motion[1], x.base_motion[2], x.joint_motion[1],
            x.joint_motion[1], x.joint_motion[2], x.y[:], x.moving[:], x.block[:])
        accumulate(x.y[:], x.first_row, x.magnitude[:], x.triangle[:], x.row[:])
        error = predict(p, x)
        if error < 0.0:
            x.unread += 1.0
        else:
            status.prediction_error = error
            x.squared += error * error
            x.samples += 1.0
    status.unread = x.unread
    if t_ns % REPORT_PERIOD_NS == 0:
        report(p, x, health)


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
        """Watches the space robot's adaptation: prediction error, excitation, consistency, saturation."""

        parameters, state = monitor_parameters(topics.joints), monitor_state(topics.joints)
        inputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                  "torque": topics.torque_estimate, "parameters": topics.parameters, "control": topics.control,
                  "wheels": topics.wheel_state}
        optional_inputs = ("parameters", "wheels")
        tolerates_nonfinite = ("joints",)
        outputs = {"status": topics.monitor, "health": topics.health}
        output_rate_hz = {"health": 1.0}
        rate_hz = 50.0
        formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "health", diagnostics),)
        start, kernel = start, watch

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return AdaptationMonitor


AdaptationMonitor = monitor(spacerobot.MINI)
