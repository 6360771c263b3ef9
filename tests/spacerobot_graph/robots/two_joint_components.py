"""Components of the robot in two_joints.yaml, each from the factory that makes the shipped four-joint one."""

from msg_schemas.spacerobot import topics
from sim_nodes.spacerobot.plant import plant
from sim_nodes.spacerobot.prediction import prediction
from sim_nodes.spacerobot.sensors import sensors
from spacerobot_ros.adaptive_controller import controller
from spacerobot_ros.least_squares_estimator import estimator
from spacerobot_ros.trajectory_generator import generator

TOPICS = topics(["shoulder", "elbow"], ["bus", "upper_arm", "forearm"], "two_joints")
Plant = plant(TOPICS)
_, _, JointSensors, PerfectState = sensors(TOPICS)
Trajectory = generator(TOPICS)
Controller = controller(TOPICS)
Estimator = estimator(TOPICS)
Prediction = prediction(TOPICS)
