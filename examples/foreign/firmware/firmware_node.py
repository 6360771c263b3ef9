"""The board of the firmware, as a ROS node: hands the bytes of each attitude to it, and publishes the bytes it answers.

    python firmware_node.py firmware.so

It knows no field of any message: what the firmware reads and writes are the bodies behind four bytes of encapsulation.
"""

import ctypes
import sys

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

EPOCH_NS = 946_728_000_000_000_000  # J2000, the stamp of t = 0 in scenarios that say no other
HEAD = b"\x00\x01\x00\x00"  # CDR, little endian
COMMAND, FUNNEL = 104, 952  # [bytes] of the bodies, as the header says


class FirmwareNode(Node):
    def __init__(self, firmware):
        super().__init__("firmware")
        self.firmware = firmware
        self.command = self.create_publisher(JointState, "cubli/wheel_command", 10)
        self.funnel = self.create_publisher(JointState, "cubli/funnel", 10)
        self.create_subscription(Imu, "cubli/attitude", self.answer, 10, raw=True)

    def answer(self, message):
        command, funnel = ctypes.create_string_buffer(COMMAND), ctypes.create_string_buffer(FUNNEL)
        fault = self.firmware.firmware_step(message[4:], command, funnel)
        if fault:
            raise SystemExit(f"the firmware has stopped: fault {fault}")
        self.command.publish(HEAD + command.raw)
        self.funnel.publish(HEAD + funnel.raw)


firmware = ctypes.CDLL(sys.argv[1])
firmware.firmware_begin(ctypes.c_int64(EPOCH_NS))
rclpy.init()
rclpy.spin(FirmwareNode(firmware))
