"""Least squares on the filtered equation of motion as a component: it needs no joint or angular acceleration.

The filtered regressor is in `spacerobot_ros.filtered_regressor`; seven rows (moment and joint torques).
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros.filtered_regressor import NOT_FINITE, READY, filter_step, momentum_regressor
from spacerobot_ros.least_squares_estimator import (
    covariance_estimator,
    covariance_parameters,
    covariance_state,
    learn,
    publish,
)
from spacerobot_ros.motion_inputs import read_motion


def filtered_parameters(joints):
    """Parameters of the filtered estimator."""

    class FilteredParameters(covariance_parameters(joints)):
        bandwidth: float = field(2.0, unit="rad/s", gt=0, doc="of the low-pass filter on both sides of the equation")

    return FilteredParameters


def filtered_state(joints):
    """State of the filtered estimator."""
    n, count = joints, 10 * (joints + 1)

    class FilteredState(covariance_state(joints)):
        phase: int
        first_row: int
        y_momentum: Array(3 + n, count)
        y_rate: Array(3 + n, count)
        y_push: Array(3 + n, count)
        still: Array(n + 1, 12)
        blocks: Array(2, 6, 10)
        zero: Array(3 + n)
        memory: Array(2, 3 + n, count)
        torque: Array(3 + n)
        filtered: Array(3 + n, count)

    return FilteredState


@kernel
def estimate(t_ns, p, x, odometry, joints, accelerations, torque, monitor, parameters, telemetry):
    """One sample through the filter, then eq. (39)-(41) on the filtered pair."""
    for c in range(x.pi_hat.shape[0]):
        x.before[c] = x.pi_hat[c]
    read_motion(p, x, odometry, joints, accelerations, torque)
    momentum_regressor(
        x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.base_motion[0], x.joint_motion[1],
        x.base_motion[2], x.y_momentum[:], x.y_rate[:],
        x.y_push[:], x.moving[:], x.still[:], x.blocks[:], x.zero[:])
    x.phase = filter_step(x.y_momentum[:], x.y_rate[:], x.y_push[:], x.measured[3:], p.bandwidth, p.period, x.phase,
                          x.memory[:],
                          x.torque[:], x.filtered[:])
    if not p.learn:
        pass
    elif x.phase == NOT_FINITE:
        x.skipped += 1.0
    elif p.freeze and monitor.freeze > 0.0:
        x.frozen += 1.0
    elif x.phase == READY:
        learn(p, x, x.filtered[:], x.first_row, x.torque[:])
    publish(p, x, parameters, telemetry)


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The filtered estimator of a robot with these topics."""

    return covariance_estimator(
        topics, filtered_parameters(topics.joints), filtered_state(topics.joints), estimate,
        "Inertial parameters by least squares on the low-passed equation of motion, without accelerations.")


FilteredEstimator = estimator(spacerobot.MINI)
