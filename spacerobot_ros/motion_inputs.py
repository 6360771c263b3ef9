"""What every parameter estimator reads: the measured motion and torques, and whether adaptation is to rest."""

from flight_graph.components.records import Array, State
from flight_graph.kernel import kernel
from spacerobot_ros.kinematics import joint_rotations


def motion_state(joints: int) -> type[State]:
    """State of a component that reads the motion: the tree's indices and the motion's arrays."""
    n = joints

    class MotionState(State):
        tree: Array(n)
        base_motion: Array(3, 3)
        joint_motion: Array(3, n)
        rotation: Array(n, 3, 3)
        measured: Array(6 + n)

    return MotionState


@kernel
def read_motion(p, x, odometry, joints, accelerations, torque):
    """Fill base_motion [w; w_dot; a], joint_motion [theta; theta_dot; theta_ddot], measured [0; torques] and the
    joints' rotations."""
    n = p.parent.shape[0]
    for k in range(3):
        x.base_motion[0, k] = odometry.twist.twist.angular[k]
        x.base_motion[1, k] = accelerations.angular[k]
        x.base_motion[2, k] = accelerations.translation[k]
        x.measured[k] = 0.0
        x.measured[3 + k] = torque.wrench.torque[k]
    for i in range(n):
        x.joint_motion[0, i] = joints.position[i]
        x.joint_motion[1, i] = joints.velocity[i]
        x.joint_motion[2, i] = accelerations.joints[i]
        x.measured[6 + i] = joints.effort[i]
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.joint_motion[0], x.rotation[:])
