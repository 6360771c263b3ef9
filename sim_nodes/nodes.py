"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "cubli_plant": "sim_nodes.cubli_plant:CubliPlant",
    "imu": "sim_nodes.cubli_sensors:Imu",
    "star_tracker": "sim_nodes.cubli_sensors:StarTracker",
    "lander_gravity_model": "sim_nodes.lander_site:GravityModel",
    "lander_plant": "sim_nodes.lander_plant:LanderPlant",
    "recorder": "flight_graph.ros.recorder:main",
    "scenario": "flight_graph.ros.scenario_program:main",
}
