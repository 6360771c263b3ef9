"""Lyapunov's law and natural adaptation as components: the control law's errors in, inertial parameters out.

Source: Aerospace 2023, 10(10), 679, equations (43)-(45); `spacerobot_ros.lyapunov_law`, and for natural adaptation
(Lee,
Kwon, Park 2018) `spacerobot_ros.natural_adaptation`. They run behind the controller in a sample, on its sigma and its
reference signals, so their estimate reaches the controller with a delay of one sample. No torque is measured: while an
actuator is at its limit, sigma says nothing about the parameters and the estimate rests.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, State, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros.kinematics import joint_rotations
from spacerobot_ros.least_squares_estimator import publish
from spacerobot_ros.lyapunov_law import adaptation_gain, lyapunov_update
from spacerobot_ros.natural_adaptation import WORK, natural_update
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior, tree_indices


def gradient_state(joints):
    """State of both estimators."""
    n, count = joints, 10 * (joints + 1)

    class GradientState(State):
        tree: Array(n)
        pi_hat: Array(count)
        before: Array(count)
        theta: Array(n)
        sigma: Array(3 + n)
        base_signals: Array(4, 3)
        joint_signals: Array(3, n)
        rotation: Array(n, 3, 3)
        y: Array(6 + n, count)
        moving: Array(n + 1, 12)
        block: Array(6, 10)
        work: Array(*WORK)
        first_row: int
        updates: float
        skipped: float
        frozen: float
        repaired: float
        reinitialised: float

    return GradientState


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
    tree_indices(p.parent[:], x.tree.view(np.int64))
    x.first_row = 3
    for c in range(p.prior.shape[0]):
        x.pi_hat[c] = p.prior[c]


@kernel
def ready(p, x, joints, control, monitor):
    """Whether to adapt now; fills sigma and Y of the reference motion."""
    for c in range(x.pi_hat.shape[0]):
        x.before[c] = x.pi_hat[c]
    if control.header.stamp.sec == 0 or not p.learn:
        return False
    if p.freeze and (control.clipped > 0.0 or monitor.freeze > 0.0):
        x.frozen += 1.0
        return False
    n = p.parent.shape[0]
    for i in range(n):
        x.theta[i] = joints.position[i]
        for k in range(3):
            x.joint_signals[k, i] = control.joint_signals[k * n + i]
    for k in range(3):
        for m in range(4):
            x.base_signals[m, k] = control.base_signals[3 * m + k]
    for k in range(3 + n):
        x.sigma[k] = control.sigma[k]
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.theta[:], x.rotation[:])
    regressor(
        x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.base_signals[0], x.base_signals[1],
        x.base_signals[2],
        x.base_signals[3], x.joint_signals[0], x.joint_signals[1], x.joint_signals[2], x.y[:], x.moving[:], x.block[:])
    return True


@kernel
def adapt_lyapunov(t_ns, p, x, joints, control, monitor, parameters, telemetry):
    """Eq. (45)."""
    if ready(p, x, joints, control, monitor):
        if lyapunov_update(x.y[:], x.first_row, x.sigma[:], p.adaptation_diagonal[:], p.period, x.pi_hat[:]):
            x.updates += 1.0
        else:
            x.skipped += 1.0
    publish(p, x, parameters, telemetry)


@kernel
def adapt_natural(t_ns, p, x, joints, control, monitor, parameters, telemetry):
    """One step of natural adaptation; a body that could not be moved counts as skipped."""
    if ready(p, x, joints, control, monitor):
        left = natural_update(x.y[:], x.first_row, x.sigma[:], p.adaptation_gain, p.period, p.largest_exponent,
                              x.pi_hat[:],
                              x.work[:])
        if left > 0:
            x.skipped += 1.0
        else:
            x.updates += 1.0
    publish(p, x, parameters, telemetry)


def estimators(topics: spacerobot.Topics) -> tuple[type[Component], type[Component]]:
    """Lyapunov's law and natural adaptation for a robot with these topics."""
    reads = {"joints": topics.joint_estimate, "control": topics.control, "monitor": topics.monitor}
    writes = {"parameters": topics.parameters, "telemetry": topics.estimator}

    class LyapunovEstimator(Component):
        """Inertial parameters by Lyapunov's law: no torque is measured."""

        parameters, state = lyapunov_parameters(topics.joints), gradient_state(topics.joints)
        inputs, outputs = reads, writes
        optional_inputs = ("monitor",)
        tolerates_nonfinite = ("joints",)
        rate_hz = 50.0
        start, kernel = start, adapt_lyapunov

        @classmethod
        def resolve(cls, values, where, folder=None):
            values = resolve_prior(values, where, folder)
            diagonal = adaptation_gain(values["prior"], values["adaptation"], values["adaptation_scale"] or None)
            return {**values, "adaptation_diagonal": diagonal.tolist()}

    class NaturalEstimator(Component):
        """Inertial parameters by natural adaptation: every estimate is a body that can exist."""

        parameters, state = natural_parameters(topics.joints), gradient_state(topics.joints)
        inputs, outputs = reads, writes
        optional_inputs = ("monitor",)
        tolerates_nonfinite = ("joints",)
        rate_hz = 50.0
        start, kernel = start, adapt_natural

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return LyapunovEstimator, NaturalEstimator


LyapunovEstimator, NaturalEstimator = estimators(spacerobot.MINI)
