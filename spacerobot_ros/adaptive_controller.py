"""The adaptive controller as a component: reference, state and parameter estimate in, torques of base and joints out.

Source: Aerospace 2023, 10(8), 679, equations (31)-(33), (38); the law is in `spacerobot_ros.adaptive_law`.
The estimate may be the one of this sample or, with a delay of one in the graph, of the sample before. Until a first one
is there, and without an estimator, the controller uses its own prior.
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, field
from flight_math import conjugate, kernel, rotation_vector, stack_array, vec3
from msg_schemas import spacerobot
from spacerobot_ros.adaptive_law import (
    PREDICTED,
    Present,
    control_torque,
    predicted_acceleration,
    reference_motion,
    with_acceleration,
)
from spacerobot_ros.kinematics import posed
from spacerobot_ros.motion_inputs import believed
from spacerobot_ros.reaction_wheels import wheel_demand
from spacerobot_ros.robot_parameters import NO_LIMIT, believed_parameters, resolve_prior


def controller_parameters(joints):
    """Parameters of the controller of a robot with this many joints."""

    class ControllerParameters(believed_parameters(joints)):
        form: Choice("slotine_li", "printed", "actual", "desired_feedforward") = field(
            "slotine_li", source="eq. (38)", doc="velocities in Y: as proven, as printed, all actual; or "
                                                 "desired motion fed forward with sigma = e + Lambda e_dot")
        base_acceleration: Choice("predicted", "measured") = field(
            "predicted", doc="a_r of the base: from the estimated force rows, or the accelerometer's last sample")
        gain: Array(3 + joints) = field(1.0, unit="1/s", gt=0, source="eq. (32)", doc="Lambda")
        damping: Array(3 + joints) = field([8.0, 8.0, 4.0, 1.5, 4.0, 1.5, 0.3] if joints == 4 else 1.0,
                                           unit="N m s/rad", gt=0, source="eq. (38)", doc="diagonal of K_D")
        damping_scale: float = field(1.0, unit="1", gt=0, doc="factor on K_D")
        torque_limit: Array(3 + joints) = field(NO_LIMIT, unit="N m", gt=0, doc="what the actuators can give")
        wheel_feed_forward: bool = field(False, doc="add the wheels' gyroscopic torque w x h to the base command")

    return ControllerParameters


@kernel
def signals_of(motion, telemetry):
    """The signals of the regressor for the estimators that need them: base (4, 3) and joints (3, n), row by row."""
    n = len(motion.thd)
    base, joints = stack_array(12), stack_array(3 * n)
    base[0:3], base[3:6], base[6:9], base[9:12] = motion.w, motion.w_r, motion.al_r, motion.a_r
    for i in range(n):
        joints[i], joints[n + i], joints[2 * n + i] = motion.thd[i], motion.thd_r[i], motion.thdd_r[i]
    telemetry.base_signals, telemetry.joint_signals = base, joints


@kernel
def control(t_ns, p, x, inputs, outputs):
    """Eq. (38). Zero torque until reference and state are there."""
    reference, odometry, joints, telemetry = inputs.reference, inputs.odometry, inputs.joints, outputs.control
    if odometry.header.stamp.sec == 0 or joints.header.stamp.sec == 0 or reference.header.stamp.sec == 0:
        return
    n = len(p.parent)
    pi_hat, rotation, signals = stack_array(10 * (n + 1)), stack_array(n, 3, 3), stack_array(3, n)
    sigma, u = stack_array(3 + n), stack_array(3 + n)
    believed(p, inputs.parameters, pi_hat)
    present = Present(odometry.pose.pose.orientation, odometry.twist.twist.angular, joints.position, joints.velocity)
    tree = posed(p, joints.position, rotation)
    motion = reference_motion(p, present, reference, sigma, signals)
    a_r = inputs.accelerations.translation
    if p.base_acceleration == PREDICTED:
        a_r = predicted_acceleration(tree, pi_hat, motion)
    motion = with_acceleration(motion, a_r)
    telemetry.clipped = control_torque(p, tree, pi_hat, motion, sigma, u)
    demand = vec3(u[0:3])
    if p.wheel_feed_forward:
        demand = wheel_demand(demand, present.rates, inputs.wheels.momentum)
    outputs.base_command.wrench.torque, outputs.joint_command.effort = demand, u[3:]
    signals_of(motion, telemetry)
    telemetry.attitude_error = rotation_vector(conjugate(present.attitude) * reference.attitude)
    telemetry.joint_error = reference.joints - joints.position
    telemetry.sigma, telemetry.torque = sigma, u


def controller(topics: spacerobot.Topics) -> type[Component]:
    """The adaptive controller of a robot with these topics."""

    class AdaptiveController(Component):
        """Adaptive control of base attitude and joints on the estimated inertial parameters (Slotine and Li).

        Promises: torques on the base (base axes) and of the joints [N m] by eq. (38), none beyond `torque_limit`, on
        the newest estimate of the inertial parameters. How far the tracking error comes down depends on who estimates
        them: docs/spacerobot.md.

        Bad input: zero torque until reference, odometry and joints have come. Without an estimate of the parameters it
        uses its own prior. Clipped axes are counted. It does not look at ages: the mode manager does.
        """

        parameters = controller_parameters(topics.joints)
        inputs = {"reference": topics.reference, "odometry": topics.odometry, "joints": topics.joint_estimate,
                  "accelerations": topics.accelerations, "parameters": topics.parameters, "wheels": topics.wheel_momentum}
        optional_inputs = ("accelerations", "parameters", "wheels")
        outputs = {"joint_command": topics.joint_command, "base_command": topics.base_command,
                   "control": topics.control}
        rate_hz = 50.0
        kernel = control

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return AdaptiveController


AdaptiveController = controller(spacerobot.MINI)
