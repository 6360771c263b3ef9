"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "landing_controller": "lander_ros.landing_controller:LandingController",
    "landing_monitor": "lander_ros.landing_monitor:LandingMonitor",
    "mode_manager": "lander_ros.mode_manager:ModeManager",
    "navigation": "lander_ros.navigation:Navigation",
    "pose_pd_controller": "lander_ros.pose_pd_controller:PosePdController",
    "robust_navigation": "lander_ros.robust_navigation:RobustNavigation",
}
