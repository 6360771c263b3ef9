"""ros2 launch spacerobot_ros spacerobot_harmonic_rls.launch.py [pace:=lockstep] [seed:=7] ...   (--show-args lists all)"""

from flight_graph.ros.launch_description import describe


def generate_launch_description():
    return describe("spacerobot_harmonic_rls")
