"""The adaptive controller as a component: reference, state and parameter estimate in, torques of base and joints out.

Source: Aerospace 2023, 10(10), 679, equations (31)-(33), (38); the law is in `spacerobot_ros.adaptive_law`.
The estimate may be the one of this sample or, with a delay of one in the graph, of the sample before. Until a first one
is there, and without an estimator, the controller uses its own prior.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros.adaptive_law import adaptive_control, control_work_size
from spacerobot_ros.kinematics import attitude_difference, joint_rotations, rotation_vector
from spacerobot_ros.reaction_wheels import wheel_demand
from spacerobot_ros.robot_parameters import NO_LIMIT, believed_parameters, resolve_prior, tree_indices


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


def controller_state(joints):
    """State of the controller: scratch arrays only, the law has no memory."""
    n = joints

    class ControllerState(State):
        tree: Array(n)
        pi_hat: Array(10 * (n + 1))
        damping: Array(3 + n)
        q: Array(4)
        q_d: Array(4)
        difference: Array(4)
        base_motion: Array(4, 3)
        wheels: Vec3
        demand: Vec3
        joint_motion: Array(5, n)
        u: Array(3 + n)
        sigma: Array(3 + n)
        base_signals: Array(4, 3)
        joint_signals: Array(3, n)
        rotation: Array(n, 3, 3)
        work: Array(control_work_size(n))

    return ControllerState


@kernel
def start(p, x):
    tree_indices(p.parent[:], x.tree.view(np.int64))
    for k in range(p.damping.shape[0]):
        x.damping[k] = p.damping_scale * p.damping[k]


@kernel
def read_inputs(p, x, reference, odometry, joints, accelerations, parameters, wheels):
    """Messages into the law's arrays; quaternions scalar first."""
    x.q[0] = odometry.pose.pose.orientation[3]
    x.q_d[0] = reference.attitude[3]
    for k in range(3):
        x.q[1 + k] = odometry.pose.pose.orientation[k]
        x.q_d[1 + k] = reference.attitude[k]
        x.base_motion[0, k] = odometry.twist.twist.angular[k]
        x.base_motion[1, k] = reference.rates[k]
        x.base_motion[2, k] = reference.angular_acceleration[k]
        x.base_motion[3, k] = accelerations.translation[k]
        x.wheels[k] = wheels.momentum[k]
    for i in range(p.parent.shape[0]):
        x.joint_motion[0, i] = joints.position[i]
        x.joint_motion[1, i] = joints.velocity[i]
        x.joint_motion[2, i] = reference.joints[i]
        x.joint_motion[3, i] = reference.joint_rates[i]
        x.joint_motion[4, i] = reference.joint_accelerations[i]
    for c in range(p.prior.shape[0]):
        x.pi_hat[c] = parameters.pi[c] if parameters.header.stamp.sec != 0 else p.prior[c]


@kernel
def control(t_ns, p, x, reference, odometry, joints, accelerations, parameters, wheels, joint_command, base_command,
            telemetry):
    """Eq. (38). Zero torque until reference and state are there."""
    n = p.parent.shape[0]
    if odometry.header.stamp.sec == 0 or joints.header.stamp.sec == 0 or reference.header.stamp.sec == 0:
        return
    read_inputs(p, x, reference, odometry, joints, accelerations, parameters, wheels)
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.joint_motion[0], x.rotation[:])
    telemetry.clipped = float(adaptive_control(
        p.form, p.base_acceleration, x.tree.view(np.int64), x.rotation[:], p.offset[:], p.axis[:], x.pi_hat[:],
        x.q[:], x.base_motion[0],
        x.joint_motion[0], x.joint_motion[1], x.q_d[:], x.base_motion[1], x.base_motion[2], x.joint_motion[2],
        x.joint_motion[3], x.joint_motion[4], x.base_motion[3], p.gain[:], x.damping[:],
        p.torque_limit[:], x.u[:], x.sigma[:], x.base_signals[:], x.joint_signals[:], x.work[:]))
    for k in range(3):
        x.demand[k] = x.u[k]
    if p.wheel_feed_forward:
        wheel_demand(x.u[0:3], x.base_motion[0], x.wheels[:], x.demand[:])
    for k in range(3):
        base_command.wrench.torque[k] = x.demand[k]
    for i in range(n):
        joint_command.effort[i] = x.u[3 + i]
        telemetry.joint_error[i] = x.joint_motion[2, i] - x.joint_motion[0, i]
        for k in range(3):
            telemetry.joint_signals[k * n + i] = x.joint_signals[k, i]
    attitude_difference(x.q[:], x.q_d[:], x.difference[:])
    rotation_vector(x.difference[:], x.demand[:])
    for k in range(3):
        telemetry.attitude_error[k] = x.demand[k]
        for m in range(4):
            telemetry.base_signals[3 * m + k] = x.base_signals[m, k]
    for k in range(3 + n):
        telemetry.sigma[k] = x.sigma[k]
        telemetry.torque[k] = x.u[k]


def controller(topics: spacerobot.Topics) -> type[Component]:
    """The adaptive controller of a robot with these topics."""

    class AdaptiveController(Component):
        """Adaptive control of base attitude and joints on the estimated inertial parameters (Slotine and Li)."""

        parameters, state = controller_parameters(topics.joints), controller_state(topics.joints)
        inputs = {"reference": topics.reference, "odometry": topics.odometry, "joints": topics.joint_estimate,
                  "accelerations": topics.accelerations, "parameters": topics.parameters, "wheels": topics.wheel_state}
        optional_inputs = ("accelerations", "parameters", "wheels")
        tolerates_nonfinite = ("joints",)
        outputs = {"joint_command": topics.joint_command, "base_command": topics.base_command,
                   "control": topics.control}
        rate_hz = 50.0
        start, kernel = start, control

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return AdaptiveController


AdaptiveController = controller(spacerobot.MINI)
