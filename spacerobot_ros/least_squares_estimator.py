"""Recursive least squares as a component: measured motion and torques in, inertial parameters out.

Source: Aerospace 2023, 10(10), 679, equations (39)-(41); the update is in `spacerobot_ros.recursive_least_squares`.
The torque is the one held over the interval that ends now, the accelerations are those at its end.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.motion_inputs import motion_state, read_motion
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_covariance, resolve_prior, tree_indices

TEN, SEVEN = 0, 1


def covariance_parameters(joints):
    """Parameters of an estimator that keeps a covariance G."""

    class CovarianceParameters(believed_parameters(joints)):
        covariance: Choice("prior_squared", "uniform", "covariance", "given") = field(
            "prior_squared", source="eq. (39)", doc="G0: scale * prior^2, scale for all, eq. (46) over the noise, or "
                                                    "as given")
        covariance_scale: float = field(0.0, unit="1", ge=0, doc="0: 1e6 for prior_squared, 1e4 for uniform")
        covariance_eta: float = field(0.4, unit="1", gt=0, doc="covariance: relative error of the prior")
        torque_noise: float = field(1e-3, unit="N m", gt=0, doc="covariance: standard deviation of a torque reading")
        forgetting: float = field(1.0, unit="1", gt=0.5, le=1, doc="factor on old knowledge each sample; 1: none")
        learn: bool = field(True, doc="false: publish the prior and do nothing else")
        freeze: bool = field(True, doc="rest while the monitor says that an actuator is at its limit")
        covariance_diagonal: Array(10 * (joints + 1)) = field(1.0, unit="SI", doc="diagonal of G0")

    return CovarianceParameters


def least_squares_parameters(joints):
    """Parameters of the least-squares estimator."""

    class LeastSquaresParameters(covariance_parameters(joints)):
        rows: Choice("ten", "seven") = field("ten", doc="with the force rows (their measurement is zero), or without")

    return LeastSquaresParameters


def covariance_state(joints):
    """State of an estimator that keeps a covariance."""
    n, count = joints, 10 * (joints + 1)

    class CovarianceState(motion_state(joints)):
        pi_hat: Array(count)
        before: Array(count)
        g: Array(count, count)
        y: Array(6 + n, count)
        moving: Array(n + 1, 12)
        block: Array(6, 10)
        work: Array(rls.work_rows(6 + n, count), count)
        updates: float
        skipped: float
        frozen: float
        repaired: float
        reinitialised: float

    return CovarianceState


@kernel
def start(p, x):
    tree_indices(p.parent[:], x.tree.view(np.int64))
    for c in range(p.prior.shape[0]):
        x.pi_hat[c] = p.prior[c]
    rls.set_diagonal(p.covariance_diagonal[:], x.g[:])


@kernel
def learn(p, x, regressor_rows, first_row, torque):
    """One update by the rows from first_row on of regressor_rows pi = torque; keep the books on what it reports."""
    status = rls.update(regressor_rows, first_row, torque, p.forgetting, x.pi_hat[:], x.g[:], p.covariance_diagonal[:],
                        x.work[:])
    if status & rls.SKIPPED:
        x.skipped += 1.0
    else:
        x.updates += 1.0
    if status & (rls.ASYMMETRIC | rls.NOT_POSITIVE):
        x.repaired += 1.0
    if status & rls.RESET:
        x.reinitialised += 1.0


@kernel
def publish(p, x, parameters, telemetry):
    """The estimate, and the largest step since the last one."""
    largest = 0.0
    for c in range(x.pi_hat.shape[0]):
        parameters.pi[c] = x.pi_hat[c]
        size = abs(p.prior[c])
        if size > 0.0:
            largest = max(largest, abs(x.pi_hat[c] - x.before[c]) / size)
    telemetry.change = largest
    telemetry.updates = x.updates
    telemetry.skipped = x.skipped
    telemetry.frozen = x.frozen
    telemetry.repaired = x.repaired
    telemetry.reinitialised = x.reinitialised


@kernel
def estimate(t_ns, p, x, odometry, joints, accelerations, torque, monitor, parameters, telemetry):
    """Eq. (39)-(41). A reading that is not finite is skipped and counted."""
    for c in range(x.pi_hat.shape[0]):
        x.before[c] = x.pi_hat[c]
    if not p.learn:
        pass
    elif p.freeze and monitor.freeze > 0.0:
        x.frozen += 1.0
    elif accelerations.known > 0.0:
        read_motion(p, x, odometry, joints, accelerations, torque)
        regressor(
            x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.base_motion[0], x.base_motion[0],
            x.base_motion[1], x.base_motion[2], x.joint_motion[1],
            x.joint_motion[1], x.joint_motion[2], x.y[:], x.moving[:], x.block[:])
        learn(p, x, x.y[:], 3 * p.rows, x.measured[:])
    publish(p, x, parameters, telemetry)


def covariance_estimator(topics: spacerobot.Topics, entries, memory, function, summary) -> type[Component]:
    """An estimator that keeps a covariance, with its parameters, state, kernel and docstring."""

    class CovarianceEstimator(Component):
        __doc__ = summary
        parameters, state = entries, memory
        inputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                  "torque": topics.torque_estimate, "monitor": topics.monitor}
        optional_inputs = ("monitor",)
        tolerates_nonfinite = ("joints",)
        outputs = {"parameters": topics.parameters, "telemetry": topics.estimator}
        rate_hz = 50.0
        start, kernel = start, function

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_covariance(resolve_prior(values, where, folder))

    return CovarianceEstimator


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The least-squares estimator of a robot with these topics."""
    return covariance_estimator(topics, least_squares_parameters(topics.joints), covariance_state(topics.joints), estimate,
                                "Inertial parameters by recursive least squares on the measured motion and torques.")


LeastSquaresEstimator = estimator(spacerobot.MINI)
