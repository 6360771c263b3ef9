"""A proportional-derivative law of the Cubli rover as a plain rclpy node: nothing in it is of this project."""

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

INERTIA, KP, KD = 0.08 / 6, 1.0, 1.0  # [kg m^2], [1/s^2], [1/s]


class PdNode(Node):
    def __init__(self):
        super().__init__("pd_node")
        self.publisher = self.create_publisher(JointState, "cubli/wheel_command", 10)
        self.create_subscription(Imu, "cubli/attitude", self.answer, 10)

    def answer(self, attitude):
        q, rate = attitude.orientation, attitude.angular_velocity
        errors = [2.0 * (part if q.w >= 0.0 else -part) for part in (q.x, q.y, q.z)]  # [rad], small angles
        torques = [-INERTIA * (KP * e + KD * w) for e, w in zip(errors, (rate.x, rate.y, rate.z))]
        command = JointState(name=["wheel_x", "wheel_y", "wheel_z"], effort=torques)
        command.header.stamp = attitude.header.stamp  # the stamp of what it answers
        command.header.frame_id = attitude.header.frame_id
        self.publisher.publish(command)


rclpy.init()
rclpy.spin(PdNode())
