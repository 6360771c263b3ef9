"""What every parameter estimator reads: the measured motion and torques."""

from flight_math import kernel
from spacerobot_ros.kinematics import actual_motion, posed


@kernel
def measured_motion(p, inputs, rotation):
    """Tree and motion as measured; fills ``rotation`` (n, 3, 3), which the tree keeps."""
    tree = posed(p, inputs.joints.position, rotation)
    motion = actual_motion(inputs.odometry.twist.twist.angular, inputs.accelerations.angular,
                           inputs.accelerations.translation, inputs.joints.velocity, inputs.accelerations.joints)
    return tree, motion


@kernel
def measured_torques(inputs, torques):
    """Fill ``torques`` (6+n,): zero force [N], moment on the base and joint torques [N m]."""
    torques[3:6] = inputs.torque.wrench.torque
    for i in range(len(torques) - 6):
        torques[6 + i] = inputs.joints.effort[i]


@kernel
def believed(p, parameters, pi_hat):
    """Fill ``pi_hat`` with the estimate, or with the prior until there is one."""
    for c in range(len(pi_hat)):
        pi_hat[c] = parameters.pi[c] if parameters.header.stamp.sec != 0 else p.prior[c]
