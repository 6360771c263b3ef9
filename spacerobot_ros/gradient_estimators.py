"""Lyapunov's law and natural adaptation as components: the control law's errors in, inertial parameters out.

Source: Aerospace 2023, 10(8), 679, equations (43)-(45); `spacerobot_ros.lyapunov_law`, and for natural adaptation
(Lee, Kwon, Park 2018) `spacerobot_ros.natural_adaptation`. They run behind the controller in a sample, on its sigma and its
reference signals, so their estimate reaches the controller with a delay of one sample. No torque is measured: while an
actuator is at its limit, sigma says nothing about the parameters and the estimate rests.
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, field
from flight_math import kernel, stack_array, vec3
from flight_math.dense import copy
from msg_schemas import spacerobot
from spacerobot_ros.kinematics import Motion, posed
from spacerobot_ros.least_squares_estimator import estimator_state, publish
from spacerobot_ros.lyapunov_law import adaptation_gain, lyapunov_update
from spacerobot_ros.natural_adaptation import natural_update
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior


def lyapunov_parameters(joints):
    """Parameters of Lyapunov's law."""

    class LyapunovParameters(believed_parameters(joints)):
        adaptation: Choice("uniform", "prior_squared") = field("prior_squared", source="eq. (45)",
                                                               doc="Gamma: scale for all, or scale * prior^2")
        adaptation_scale: float = field(0.0, unit="1", ge=0, doc="0: 0.3 for uniform, 5 for prior_squared")
        learn: bool = field(True, doc="false: publish the prior and do nothing else")
        freeze: bool = field(True, doc="rest while an actuator is at its limit")
        adaptation_diagonal: Array(10 * (joints + 1)) = field(1.0, unit="SI", doc="diagonal of Gamma = K_pi^-1")

    return LyapunovParameters


def natural_parameters(joints):
    """Parameters of natural adaptation."""

    class NaturalParameters(believed_parameters(joints)):
        prior_projected: bool = field(True, doc="make every body of the prior possible (natural adaptation needs it)")
        adaptation_gain: float = field(3.0, unit="1", ge=0, doc="g of P+ = C exp(g T C^T L C) C^T")
        largest_exponent: float = field(2.0, unit="1", gt=0, doc="clip of the exponent's eigenvalues")
        learn: bool = field(True, doc="false: publish the prior and do nothing else")
        freeze: bool = field(True, doc="rest while an actuator is at its limit")

    return NaturalParameters


@kernel
def start(p, x):
    x.pi_hat = p.prior


@kernel
def ready(p, x, inputs):
    """Whether to adapt now."""
    if inputs.control.header.stamp.sec == 0 or not p.learn:
        return False
    if p.freeze and (inputs.control.clipped > 0.0 or inputs.monitor.freeze > 0.0):
        x.frozen += 1.0
        return False
    return True


@kernel
def reference_regressor(p, inputs, y, sigma):
    """Fill ``y`` (6+n, 10(n+1)) at the control law's reference motion, and ``sigma`` (3+n,)."""
    n, control = len(p.parent), inputs.control
    base, joints, rotation = stack_array(4, 3), stack_array(3, n), stack_array(n, 3, 3)
    for k in range(12):
        base[k // 3, k % 3] = control.base_signals[k]
    for k in range(3):
        for i in range(n):
            joints[k, i] = control.joint_signals[k * n + i]
    for k in range(3 + n):
        sigma[k] = control.sigma[k]
    motion = Motion(vec3(base[0]), vec3(base[1]), vec3(base[2]), vec3(base[3]), joints[0], joints[1], joints[2])
    regressor(posed(p, inputs.joints.position, rotation), motion, y)


@kernel
def adapt_lyapunov(t_ns, p, x, inputs, outputs):
    """Eq. (45)."""
    n, count = len(p.parent), len(x.pi_hat)
    before, y, sigma = stack_array(count), stack_array(6 + n, count), stack_array(3 + n)
    copy(x.pi_hat, before)
    if ready(p, x, inputs):
        reference_regressor(p, inputs, y, sigma)
        if lyapunov_update(y[3:], sigma, p.adaptation_diagonal, p.period, x.pi_hat):
            x.updates += 1.0
        else:
            x.skipped += 1.0
    publish(p, x, before, outputs)


@kernel
def adapt_natural(t_ns, p, x, inputs, outputs):
    """One step of natural adaptation; a body that could not be moved counts as skipped."""
    n, count = len(p.parent), len(x.pi_hat)
    before, y, sigma = stack_array(count), stack_array(6 + n, count), stack_array(3 + n)
    copy(x.pi_hat, before)
    if ready(p, x, inputs):
        reference_regressor(p, inputs, y, sigma)
        if natural_update(y[3:], sigma, p.adaptation_gain, p.period, p.largest_exponent, x.pi_hat) > 0:
            x.skipped += 1.0
        else:
            x.updates += 1.0
    publish(p, x, before, outputs)


def estimators(topics: spacerobot.Topics) -> tuple[type[Component], type[Component]]:
    """Lyapunov's law and natural adaptation for a robot with these topics."""
    reads = {"joints": topics.joint_estimate, "control": topics.control, "monitor": topics.monitor}
    writes = {"parameters": topics.parameters, "telemetry": topics.estimator}

    class LyapunovEstimator(Component):
        """Inertial parameters by Lyapunov's law: no torque is measured.

        Promises: ten inertial parameters of each body, SI units, by eq. (45) at every firing. It needs no torque
        sensor. The estimate need not be a body that can exist.

        Bad input: an update that would not be finite is skipped and counted. It rests, and counts that, while an
        actuator is at its limit or the monitor says so; until the controller has spoken it publishes the prior.
        """

        parameters, state = lyapunov_parameters(topics.joints), estimator_state(topics.joints)
        inputs, outputs = reads, writes
        optional_inputs = ("monitor",)
        rate_hz = 50.0
        start, kernel = start, adapt_lyapunov

        @classmethod
        def resolve(cls, values, where, folder=None):
            values = resolve_prior(values, where, folder)
            diagonal = adaptation_gain(values["prior"], values["adaptation"], values["adaptation_scale"] or None)
            return {**values, "adaptation_diagonal": diagonal.tolist()}

    class NaturalEstimator(Component):
        """Inertial parameters by natural adaptation: every estimate is a body that can exist.

        Promises: ten inertial parameters of each body, SI units, at every firing; each body of each estimate can exist
        (its pseudo-inertia is positive definite). It needs no torque sensor.

        Bad input: a body that could not be moved counts as skipped. It rests, and counts that, while an actuator is at
        its limit or the monitor says so; until the controller has spoken it publishes the prior.
        """

        parameters, state = natural_parameters(topics.joints), estimator_state(topics.joints)
        inputs, outputs = reads, writes
        optional_inputs = ("monitor",)
        rate_hz = 50.0
        start, kernel = start, adapt_natural

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return LyapunovEstimator, NaturalEstimator


LyapunovEstimator, NaturalEstimator = estimators(spacerobot.MINI)
