"""A node that is not of this project, and misbehaves as it is told: python -m tests.ros.foreign_node MODE TOPIC."""

import os
import signal
import sys

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState


class ForeignNode(Node):
    """Answers the attitude of the rover: torque against its rate."""

    def __init__(self, mode, topic):
        super().__init__("stranger")
        self.mode, self.count = mode, 0
        kind = Imu if mode == "type" else JointState
        self.publisher = self.create_publisher(kind, "cubli/wheel_command", 10)
        self.create_subscription(Imu, topic, self.answer, 10)

    def answer(self, attitude):
        self.count += 1
        rate = attitude.angular_velocity
        command = JointState(name=["wheel_x", "wheel_y", "wheel_z"], effort=[-0.01 * w for w in (rate.x, rate.y, rate.z)])
        command.header.stamp, command.header.frame_id = attitude.header.stamp, attitude.header.frame_id
        if self.mode == "many" and self.count == 66:
            os.kill(os.getpid(), signal.SIGKILL)
        if self.mode == "many" and self.count in (10, 20):
            return  # late, twice
        if self.mode == "many" and self.count == 30:
            command.header.stamp.nanosec += 5
        if self.mode == "many" and self.count == 40:
            command.effort[1] = float("nan")
        if self.mode == "many" and self.count == 50:
            command.name[0] = "wheel"
        if self.mode == "clock":  # in realtime: stamps of the wall clock, not of the run
            command.header.stamp = self.get_clock().now().to_msg()
        self.publisher.publish(command)
        if self.mode == "many" and self.count == 60:
            command.effort[0] += 1.0
            self.publisher.publish(command)


if __name__ == "__main__":
    rclpy.init(args=sys.argv)
    rclpy.spin(ForeignNode(*sys.argv[1:3]))
