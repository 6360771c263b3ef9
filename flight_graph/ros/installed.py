"""Which messages this machine's ROS has: tf2_msgs, for one, does not come with the wheels."""

import importlib.util


def is_installed(type_name: str) -> bool:
    """Whether the package of a message type is installed."""
    return importlib.util.find_spec(type_name.split("/")[0]) is not None


def not_live(components) -> str:
    """A sentence on topics that are recorded and not published, because their messages are not installed; or nothing."""
    made = [one for component in components for one in component.formatted if not is_installed(one.type_name)]
    if not made:
        return ""
    topics = sorted({f"/{one.topic}" for one in made})
    packages = sorted({one.type_name.partition("/")[0] for one in made})
    return f"{' and '.join(topics)}: in the bag, and not live; {', '.join(packages)} is not installed here"
