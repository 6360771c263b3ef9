"""Recursive least squares as a component: measured motion and torques in, inertial parameters out.

Source: Aerospace 2023, 10(8), 679, equations (39)-(41); the update is in `spacerobot_ros.recursive_least_squares`.
The torque is the one held over the interval that ends now, the accelerations are those at its end.
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, State, field
from flight_math import kernel, stack_array
from flight_math.dense import copy
from msg_schemas import spacerobot
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.motion_inputs import measured_motion, measured_torques
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_covariance, resolve_prior

TEN, SEVEN = 0, 1

SUMMARY = """Inertial parameters by recursive least squares on the measured motion and torques.

Promises: ten inertial parameters of each body, SI units, by eq. (39)-(41) at every firing, and how many readings were used,
skipped, or left out while it rested. The estimate need not be a body that can exist.

Bad input: a reading that is not finite is skipped and counted; a covariance that has lost its symmetry or is not positive
is repaired or begun anew, and that is counted. It rests while the monitor says that an actuator is at its limit. Until
accelerations are known it publishes the prior.
"""


def covariance_parameters(joints):
    """Parameters of an estimator that keeps a covariance G."""

    class CovarianceParameters(believed_parameters(joints)):
        covariance: Choice("prior_squared", "uniform", "covariance", "given") = field(
            "prior_squared", source="eq. (39)", doc="G0: scale * prior^2, scale for all, eq. (46) over the noise, or "
                                                    "as given")
        covariance_scale: float = field(0.0, unit="1", ge=0, doc="0: 1e6 for prior_squared, 1e4 for uniform")
        covariance_eta: float = field(0.4, unit="1", gt=0, used_if={"covariance": ["covariance"]},
                                      doc="covariance: relative error of the prior")
        torque_noise: float = field(1e-3, unit="N m", gt=0, used_if={"covariance": ["covariance"]},
                                    doc="covariance: standard deviation of a torque reading")
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


def estimator_state(joints):
    """State of an estimator: the estimate, and what happened since the start."""

    class EstimatorState(State):
        pi_hat: Array(10 * (joints + 1))
        updates: float
        skipped: float
        frozen: float
        repaired: float
        reinitialised: float

    return EstimatorState


def covariance_state(joints):
    """State of an estimator that keeps a covariance."""
    count = 10 * (joints + 1)

    class CovarianceState(estimator_state(joints)):
        g: Array(count, count)

    return CovarianceState


@kernel
def start(p, x):
    x.pi_hat = p.prior
    rls.set_diagonal(p.covariance_diagonal, x.g)


@kernel
def learn(p, x, y, torques):
    """One update by y pi = torques; keep the books on what it reports."""
    status = rls.update(y, torques, p.forgetting, x.pi_hat, x.g, p.covariance_diagonal)
    if status & rls.SKIPPED:
        x.skipped += 1.0
    else:
        x.updates += 1.0
    if status & (rls.ASYMMETRIC | rls.NOT_POSITIVE):
        x.repaired += 1.0
    if status & rls.RESET:
        x.reinitialised += 1.0


@kernel
def publish(p, x, before, outputs):
    """The estimate, and the largest step from the one ``before``."""
    largest = 0.0
    for c in range(len(before)):
        if p.prior[c] != 0.0:
            largest = max(largest, abs(x.pi_hat[c] - before[c]) / abs(p.prior[c]))
    outputs.parameters.pi = x.pi_hat
    telemetry = outputs.telemetry
    telemetry.change = largest
    telemetry.updates = x.updates
    telemetry.skipped = x.skipped
    telemetry.frozen = x.frozen
    telemetry.repaired = x.repaired
    telemetry.reinitialised = x.reinitialised


@kernel
def estimate(t_ns, p, x, inputs, outputs):
    """Eq. (39)-(41). A reading that is not finite is skipped and counted."""
    n, count = len(p.parent), len(x.pi_hat)
    before, y, torques, rotation = stack_array(count), stack_array(6 + n, count), stack_array(6 + n), stack_array(n, 3, 3)
    copy(x.pi_hat, before)
    if not p.learn:
        pass
    elif p.freeze and inputs.monitor.freeze > 0.0:
        x.frozen += 1.0
    elif inputs.accelerations.known > 0.0:
        tree, motion = measured_motion(p, inputs, rotation)
        measured_torques(inputs, torques)
        regressor(tree, motion, y)
        first = 3 if p.rows == SEVEN else 0
        learn(p, x, y[first:], torques[first:])
    publish(p, x, before, outputs)


def covariance_estimator(topics: spacerobot.Topics, entries, memory, function, summary) -> type[Component]:
    """An estimator that keeps a covariance, with its parameters, state, kernel and docstring."""

    class CovarianceEstimator(Component):
        __doc__ = summary
        parameters, state = entries, memory
        inputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                  "torque": topics.torque_estimate, "monitor": topics.monitor}
        optional_inputs = ("monitor",)
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
                                SUMMARY)


LeastSquaresEstimator = estimator(spacerobot.MINI)
