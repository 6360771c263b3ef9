"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "cubli_physical_plant": "sim_nodes.cubli_physical_plant:CubliPhysicalPlant",
    "cubli_plant": "sim_nodes.cubli_plant:CubliPlant",
    "imu": "sim_nodes.cubli_sensors:Imu",
    "star_tracker": "sim_nodes.cubli_sensors:StarTracker",
    "lander_altimeter": "sim_nodes.lander_sensors:Altimeter",
    "lander_gravity_model": "sim_nodes.lander_site:GravityModel",
    "lander_imu": "sim_nodes.lander_sensors:Imu",
    "lander_noisy_navigation": "sim_nodes.lander_sensors:NoisyNavigation",
    "lander_plant": "sim_nodes.lander_plant:LanderPlant",
    "lander_site_camera": "sim_nodes.lander_sensors:SiteCamera",
    "lander_star_tracker": "sim_nodes.lander_sensors:StarTracker",
    "recorder": "flight_graph.ros.recorder:main",
    "spacerobot_imu": "sim_nodes.spacerobot_sensors:SpaceRobotImu",
    "spacerobot_joint_sensors": "sim_nodes.spacerobot_sensors:SpaceRobotJointSensors",
    "spacerobot_perfect_state": "sim_nodes.spacerobot_sensors:SpaceRobotPerfectState",
    "spacerobot_plant": "sim_nodes.spacerobot_plant:SpaceRobotPlant",
    "spacerobot_prediction": "sim_nodes.spacerobot_prediction:SpaceRobotPrediction",
    "spacerobot_star_tracker": "sim_nodes.spacerobot_sensors:SpaceRobotStarTracker",
    "scenario": "flight_graph.ros.scenario_program:main",
}
