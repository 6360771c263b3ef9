"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "appc_controller": "cubli_ros.appc_controller:AppcController",
    "attitude_estimator": "cubli_ros.attitude_estimator:AttitudeEstimator",
    "backstepping_controller": "cubli_ros.backstepping_controller:BacksteppingController",
    "jump_monitor": "cubli_ros.jump_monitor:JumpMonitor",
    "mode_manager": "cubli_ros.mode_manager:ModeManager",
    "pd_controller": "cubli_ros.pd_controller:PdController",
    "robust_attitude_estimator": "cubli_ros.robust_attitude_estimator:RobustAttitudeEstimator",
    "wheel_monitor": "cubli_ros.wheel_monitor:WheelMonitor",
}
