"""Process-wide settings that must stand before rclpy is imported."""

import os
from importlib import resources


def prepare_environment() -> None:
    """Limit discovery to this machine and announce quickly, unless the user has said otherwise."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    profile = resources.files("flight_graph.ros") / "fastdds_profile.xml"
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))
