"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "actuator_monitor": "spacerobot_ros.actuator_monitor:ActuatorMonitor",
    "adaptation_monitor": "spacerobot_ros.adaptation_monitor:AdaptationMonitor",
    "adaptive_controller": "spacerobot_ros.adaptive_controller:AdaptiveController",
    "filtered_estimator": "spacerobot_ros.filtered_estimator:FilteredEstimator",
    "least_squares_estimator": "spacerobot_ros.least_squares_estimator:LeastSquaresEstimator",
    "lyapunov_estimator": "spacerobot_ros.gradient_estimators:LyapunovEstimator",
    "mode_manager": "spacerobot_ros.mode_manager:ModeManager",
    "natural_estimator": "spacerobot_ros.gradient_estimators:NaturalEstimator",
    "robust_state_estimator": "spacerobot_ros.robust_state_estimator:RobustStateEstimator",
    "state_estimator": "spacerobot_ros.state_estimator:StateEstimator",
    "trajectory_generator": "spacerobot_ros.trajectory_generator:TrajectoryGenerator",
}
