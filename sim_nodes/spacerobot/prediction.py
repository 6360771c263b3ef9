"""How wrong the estimated parameters are, as only the truth can tell: the torque they mispredict at the true motion."""

import math

from flight_graph.components.component import Component
from flight_math import kernel, stack_array
from msg_schemas import spacerobot
from spacerobot_ros.dynamics import inverse_dynamics
from spacerobot_ros.kinematics import actual_motion, posed
from spacerobot_ros.motion_inputs import believed
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior


@kernel
def relative_error(difference, true):
    """Root mean square of the differences, each over the true parameter; those that are zero are left out."""
    total = 0.0
    for c in range(len(true)):
        if true[c] != 0.0:
            total += difference[c] / true[c] * (difference[c] / true[c])
    return math.sqrt(total / len(true))


@kernel
def mispredict(t_ns, p, x, truth, true_parameters, parameters, found):
    """|Y (pi_hat - pi)| of the moment and joint rows. Without an estimate, the prior is judged."""
    n, true = len(p.parent), true_parameters.pi
    difference, wrench = stack_array(len(true)), stack_array(6 + n)
    believed(p, parameters, difference)
    for c in range(len(true)):
        difference[c] -= true[c]
    tree = posed(p, truth.joints, stack_array(n, 3, 3))
    motion = actual_motion(truth.rates, truth.angular_acceleration, truth.acceleration, truth.joint_rates,
                           truth.joint_accelerations)
    inverse_dynamics(tree, difference, motion, wrench)
    total = 0.0
    for k in range(3, 6 + n):
        total += wrench[k] * wrench[k]
    found.parameter_error, found.prediction_error = relative_error(difference, true), math.sqrt(total)


def prediction(topics: spacerobot.Topics) -> type[Component]:
    """The judge of the estimates of a robot with these topics."""

    class SpaceRobotPrediction(Component):
        """Torque that the estimated parameters mispredict at the true motion (knows the truth).

        Promises: at every firing the relative error [1] of the estimated parameters, and the torque [N m] that they
        mispredict at the true motion.

        Bad input: without an estimate the prior is judged.
        """

        parameters = believed_parameters(topics.joints)
        inputs = {"truth": topics.truth, "true_parameters": topics.true_parameters, "parameters": topics.parameters}
        optional_inputs = ("parameters",)
        outputs = {"found": topics.true_prediction}
        rate_hz = 50.0
        kernel = mispredict

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return SpaceRobotPrediction


SpaceRobotPrediction = prediction(spacerobot.MINI)
