"""How wrong the estimated parameters are, as only the truth can tell: the torque they mispredict at the true motion."""

import math

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, State
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros.dynamics import inverse_dynamics
from spacerobot_ros.kinematics import joint_rotations
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior, tree_indices


def prediction_state(joints):
    """State of the component: scratch arrays."""
    n = joints

    class PredictionState(State):
        tree: Array(n)
        difference: Array(10 * (n + 1))
        rotation: Array(n, 3, 3)
        base_motion: Array(3, 3)
        joint_motion: Array(3, n)
        wrench: Array(6 + n)
        moving: Array(n + 1, 12)
        load: Array(n + 1, 6)

    return PredictionState


@kernel
def start(p, x):
    tree_indices(p.parent[:], x.tree.view(np.int64))


@kernel
def mispredict(t_ns, p, x, truth, true_parameters, parameters, found):
    """|Y (pi_hat - pi)| of the moment and joint rows. Without an estimate, the prior is judged."""
    n = p.parent.shape[0]
    count = p.prior.shape[0]
    total = 0.0
    for c in range(count):
        true = true_parameters.pi[c]
        believed = parameters.pi[c] if parameters.header.stamp.sec != 0 else p.prior[c]
        x.difference[c] = believed - true
        if true != 0.0:
            total += x.difference[c] / true * (x.difference[c] / true)
    found.parameter_error = math.sqrt(total / count)
    for k in range(3):
        x.base_motion[0, k] = truth.rates[k]
        x.base_motion[1, k] = truth.angular_acceleration[k]
        x.base_motion[2, k] = truth.acceleration[k]
    for i in range(n):
        x.joint_motion[0, i] = truth.joints[i]
        x.joint_motion[1, i] = truth.joint_rates[i]
        x.joint_motion[2, i] = truth.joint_accelerations[i]
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.joint_motion[0], x.rotation[:])
    inverse_dynamics(
        x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.difference[:], x.base_motion[0],
        x.base_motion[0], x.base_motion[1], x.base_motion[2],
        x.joint_motion[1], x.joint_motion[1], x.joint_motion[2], x.wrench[:], x.moving[:], x.load[:])
    total = 0.0
    for k in range(3, 6 + n):
        total += x.wrench[k] * x.wrench[k]
    found.prediction_error = math.sqrt(total)


def prediction(topics: spacerobot.Topics) -> type[Component]:
    """The judge of the estimates of a robot with these topics."""

    class SpaceRobotPrediction(Component):
        """Torque that the estimated parameters mispredict at the true motion (knows the truth)."""

        parameters, state = believed_parameters(topics.joints), prediction_state(topics.joints)
        inputs = {"truth": topics.truth, "true_parameters": topics.true_parameters, "parameters": topics.parameters}
        optional_inputs = ("parameters",)
        outputs = {"found": topics.true_prediction}
        rate_hz = 50.0
        start, kernel = start, mispredict

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return SpaceRobotPrediction


SpaceRobotPrediction = prediction(spacerobot.MINI)
