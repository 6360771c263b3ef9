"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "appc_controller": "cubli_ros.appc_controller:AppcController",
    "attitude_estimator": "cubli_ros.attitude_estimator:AttitudeEstimator",
    "jump_monitor": "cubli_ros.jump_monitor:JumpMonitor",
}
