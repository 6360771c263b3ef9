"""ros2 launch cubli_ros cubli_asteroid.launch.py [pace:=lockstep] [seed:=7] ...   (--show-args lists all)"""

from flight_graph.ros.launch_description import describe


def generate_launch_description():
    return describe("cubli_asteroid")
