"""ros2 launch lander_ros lander_estimated.launch.py [pace:=lockstep] [seed:=7] ...   (--show-args lists all)"""

from flight_graph.ros.launch_description import describe


def generate_launch_description():
    return describe("lander_estimated")
