"""A plant of one's own as a plain rclpy node: a free body with three reaction wheels. Nothing in it is of this project.

It answers each command by where it stands at that moment, and then moves on for a period under it.
"""

from math import cos, sin, sqrt

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

INERTIA, PERIOD = 0.08 / 6, 0.01  # [kg m^2] about every axis, [s]


class PlantNode(Node):
    def __init__(self):
        super().__init__("plant_node")
        self.attitude, self.rates = [0.1, -0.05, 0.08, sqrt(1 - 0.0189)], [0.0, 0.0, 0.0]  # quaternion x, y, z, w; [rad/s]
        self.publisher = self.create_publisher(Imu, "cubli/attitude", 10)
        self.create_subscription(JointState, "cubli/wheel_command", self.answer, 10)

    def answer(self, command):
        state = Imu()
        state.header.stamp, state.header.frame_id = command.header.stamp, "cubli_base"
        q, w = state.orientation, state.angular_velocity
        q.x, q.y, q.z, q.w = self.attitude
        w.x, w.y, w.z = self.rates
        self.publisher.publish(state)
        self.move(command.effort)

    def move(self, torques):
        """Under torques that are held for a period: the mean rate turns the body."""
        before = self.rates
        self.rates = [rate + torque / INERTIA * PERIOD for rate, torque in zip(before, torques)]
        self.turn([0.5 * (a + b) * PERIOD for a, b in zip(before, self.rates)])

    def turn(self, by):
        """Turn by a rotation vector [rad] in the body's axes."""
        angle = sqrt(sum(part * part for part in by))
        scale = 0.5 if angle < 1e-9 else sin(0.5 * angle) / angle
        (a, b, c), d = [scale * part for part in by], cos(0.5 * angle)
        x, y, z, w = self.attitude
        turned = [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d,
                  w * d - x * a - y * b - z * c]
        length = sqrt(sum(part * part for part in turned))
        self.attitude = [part / length for part in turned]


rclpy.init()
rclpy.spin(PlantNode())
