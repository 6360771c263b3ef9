"""Watch over the actuators: torques that are not what was commanded, and torques that do not move what they should.

Errors: the torque measured over the last interval less the one that was commanded for it; with reaction wheels the base's
command is compared with tau + w x h. Residuals: the equation of motion through a low-pass on both sides
(`spacerobot_ros.filtered_regressor`), tau_f - W pi_hat, one number for each axis of the base and each joint. It needs no
acceleration, and what is left is what nobody commanded: friction, a brake, a stop, a push; the residual of generalised
momenta by which robot arms tell collisions (De Luca et al. 2006). They begin anew after a rate was in doubt, or the
estimate was not there.

Both are low-passed alike: a drive that fails shows in the error alone, friction in the residual alone, and a torque sensor
that errs in both at once.
"""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, State, field
from flight_math import cross, exp, kernel, stack_array, vec3
from msg_schemas import spacerobot
from spacerobot_ros.filtered_regressor import NOT_FINITE, READY, Rows, filter_step, momentum_regressor
from spacerobot_ros.motion_inputs import believed, measured_motion, measured_torques
from spacerobot_ros.robot_parameters import believed_parameters, resolve_prior


def monitor_parameters(joints):
    """Parameters of the monitor."""

    class ActuatorMonitorParameters(believed_parameters(joints)):
        bandwidth: float = field(2.0, unit="rad/s", gt=0, doc="of the low-pass on errors and residuals")

    return ActuatorMonitorParameters


def monitor_state(joints):
    """State of the monitor: commands of the interval that ends next, torque errors, the filter of the residuals."""
    n, count = joints, 10 * (joints + 1)

    class ActuatorMonitorState(State):
        samples: float
        commanded: Array(3 + n)
        error: Array(3 + n)
        phase: int
        memory: Array(2, 3 + n, count)
        filtered_torque: Array(3 + n)
        filtered: Array(3 + n, count)

    return ActuatorMonitorState


@kernel
def torque_errors(p, x, inputs, torques):
    """Low-passed difference of the measured ``torques`` (6+n,) and the ones commanded for the last interval."""
    share, n = 1.0 - exp(-p.bandwidth * p.period), len(p.parent)
    given, base = stack_array(3 + n), inputs.base_command.wrench.torque
    given[0:3] = vec3(torques[3:6]) + cross(inputs.odometry.twist.twist.angular, inputs.wheels.momentum)
    for i in range(n):
        given[3 + i] = torques[6 + i]
    for k in range(3 + n):
        difference = given[k] - x.commanded[k]
        if x.samples > 0.0 and abs(difference) < 1e9:
            x.error[k] += share * (difference - x.error[k])
    x.samples += 1.0
    x.commanded[0:3] = base
    for i in range(n):
        x.commanded[3 + i] = inputs.joint_command.effort[i]


@kernel
def residuals(p, x, pi_hat, found):
    """Fill ``found`` (3+n,) with tau_f - W pi_hat."""
    for r in range(len(found)):
        found[r] = x.filtered_torque[r]
        for c in range(len(pi_hat)):
            found[r] -= x.filtered[r, c] * pi_hat[c]


@kernel
def watch(t_ns, p, x, inputs, outputs):
    """One sample."""
    n, count, status = len(p.parent), len(p.prior), outputs.status
    pi_hat, torques, rotation, found = stack_array(count), stack_array(6 + n), stack_array(n, 3, 3), stack_array(3 + n)
    rows = Rows(stack_array(3 + n, count), stack_array(3 + n, count), stack_array(3 + n, count))
    believed(p, inputs.parameters, pi_hat)
    tree, motion = measured_motion(p, inputs, rotation)
    measured_torques(inputs, torques)
    if not same_stamp(inputs.odometry.header.stamp, status.header.stamp):
        x.samples, x.phase = 0.0, NOT_FINITE
        status.known = 0.0
        return
    torque_errors(p, x, inputs, torques)
    momentum_regressor(tree, motion.w, motion.thd, motion.a_r, rows)
    if inputs.estimate.doubted > 0.0:
        x.phase = NOT_FINITE
    else:
        x.phase = filter_step(p, x, x.phase, rows, torques[3:])
    status.known = 1.0 if x.phase == READY else 0.0
    if x.phase == READY:
        residuals(p, x, pi_hat, found)
    status.base_error, status.drive_error = vec3(x.error[0:3]), x.error[3:]
    status.base_residual, status.joint_residual = vec3(found[0:3]), found[3:]


def monitor(topics: spacerobot.Topics) -> type[Component]:
    """The monitor of a robot with these topics."""

    class ActuatorMonitor(Component):
        """Watches the space robot's drives and wheels: torque errors, and residuals of the equation of motion.

        Promises: for each axis of the base and each joint the low-passed difference [N m] of measured and commanded
        torque, and the residual [N m] of the equation of motion: friction, a brake, a stop or a push, which nobody
        commanded.

        Bad input: without a new estimate it says that nothing is known (`known` 0) and begins anew. A rate that the
        estimator doubts restarts the residuals. A difference that is not finite or beyond 1e9 N m is left out.
        """

        parameters, state = monitor_parameters(topics.joints), monitor_state(topics.joints)
        inputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                  "torque": topics.torque_estimate, "parameters": topics.parameters,
                  "base_command": topics.safe_base_command, "joint_command": topics.safe_joint_command,
                  "wheels": topics.wheel_momentum, "estimate": topics.state_status}
        optional_inputs = ("parameters", "wheels", "estimate")
        outputs = {"status": topics.actuator_status}
        rate_hz = 50.0
        kernel = watch

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_prior(values, where, folder)

    return ActuatorMonitor


ActuatorMonitor = monitor(spacerobot.MINI)
