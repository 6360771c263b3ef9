"""Steps a run of nodes, ten firings of its plant at a time, until a wheel of the rover is fast; then it may play.

    flight run cubli_asteroid --engine ros --control         # says on which ROS domain it is, and waits
    ROS_DOMAIN_ID=101 python examples/step_until.py 0.5      # [rad/s]
"""

import os
import sys

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # as the nodes have it

import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

PATIENCE_S = 20.0


class Operator(Node):
    """Asks the node ``simulation``, and hears the wheels."""

    def __init__(self):
        super().__init__("operator")
        self.wheels = None
        self.create_subscription(JointState, "cubli/wheel_state", self.hear, 10)

    def hear(self, message):
        self.wheels = message

    def ask(self, type_, name, request):
        client = self.create_client(type_, f"simulation/{name}")
        if not client.wait_for_service(PATIENCE_S):
            sys.exit(f"there is no {client.srv_name} on ROS domain {os.environ.get('ROS_DOMAIN_ID') or 0}: is a run there, "
                     "with --control?")
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future)
        self.destroy_client(client)
        return future.result()

    def call(self, name) -> str:
        answer = self.ask(Trigger, name, Trigger.Request())
        if not answer.success:
            sys.exit(answer.message)
        return answer.message

    def set(self, name, value):
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        result = self.ask(SetParameters, "set_parameters", request).results[0]
        if not result.successful:
            sys.exit(result.reason)


def main(limit: float) -> None:
    rclpy.init()
    operator = Operator()
    print(operator.call("pause"))
    operator.set("steps", 10)
    fastest = 0.0
    while fastest < limit:
        seen, where = operator.wheels, operator.call("step")
        while operator.wheels is seen:  # the answer may be here before the messages of the step
            rclpy.spin_once(operator, timeout_sec=PATIENCE_S)
        fastest = max(map(abs, operator.wheels.velocity))
        print(f"{where}: {fastest:.3f} rad/s")
    print(operator.call("play"))


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.5)
