"""Least squares on the filtered equation of motion as a component: it needs no joint or angular acceleration.

The filtered regressor is in `spacerobot_ros.filtered_regressor`; seven rows (moment and joint torques).
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Array, field
from flight_math import kernel, stack_array
from flight_math.dense import copy
from msg_schemas import spacerobot
from spacerobot_ros.filtered_regressor import NOT_FINITE, READY, Rows, filter_step, momentum_regressor
from spacerobot_ros.least_squares_estimator import (
    covariance_estimator,
    covariance_parameters,
    covariance_state,
    learn,
    publish,
)
from spacerobot_ros.motion_inputs import measured_motion, measured_torques

SUMMARY = """Inertial parameters by least squares on the low-passed equation of motion, without accelerations.

Promises: ten inertial parameters of each body, SI units, at every firing, from rates and torques that went through the same
low-pass, and how many readings were used, skipped, or left out while it rested.

Bad input: a reading that is not finite is skipped and counted, and the filter begins anew; a covariance that has lost its
symmetry or is not positive is repaired or begun anew, and that is counted. It rests while the monitor says that an actuator
is at its limit.
"""


def filtered_parameters(joints):
    """Parameters of the filtered estimator."""

    class FilteredParameters(covariance_parameters(joints)):
        bandwidth: float = field(2.0, unit="rad/s", gt=0, doc="of the low-pass filter on both sides of the equation")

    return FilteredParameters


def filtered_state(joints):
    """State of the filtered estimator: the filter of `spacerobot_ros.filtered_regressor` with it."""
    n, count = joints, 10 * (joints + 1)

    class FilteredState(covariance_state(joints)):
        phase: int
        memory: Array(2, 3 + n, count)
        filtered_torque: Array(3 + n)
        filtered: Array(3 + n, count)

    return FilteredState


@kernel
def estimate(t_ns, p, x, inputs, outputs):
    """One sample through the filter, then eq. (39)-(41) on the filtered pair."""
    n, count = len(p.parent), len(x.pi_hat)
    before, torques, rotation = stack_array(count), stack_array(6 + n), stack_array(n, 3, 3)
    rows = Rows(stack_array(3 + n, count), stack_array(3 + n, count), stack_array(3 + n, count))
    copy(x.pi_hat, before)
    tree, motion = measured_motion(p, inputs, rotation)
    measured_torques(inputs, torques)
    momentum_regressor(tree, motion.w, motion.thd, motion.a_r, rows)
    x.phase = filter_step(p, x, x.phase, rows, torques[3:])
    if not p.learn:
        pass
    elif x.phase == NOT_FINITE:
        x.skipped += 1.0
    elif p.freeze and inputs.monitor.freeze > 0.0:
        x.frozen += 1.0
    elif x.phase == READY:
        learn(p, x, x.filtered, x.filtered_torque)
    publish(p, x, before, outputs)


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The filtered estimator of a robot with these topics."""

    return covariance_estimator(
        topics, filtered_parameters(topics.joints), filtered_state(topics.joints), estimate,
        SUMMARY)


FilteredEstimator = estimator(spacerobot.MINI)
