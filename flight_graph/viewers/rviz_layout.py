"""A configuration for rviz: the vehicle's model, its frames, ground and other bodies."""

import yaml

from flight_graph.viewers.vehicle import MARKERS, MODEL, Vehicle

_LATCHED = {"Depth": 1, "Durability Policy": "Transient Local", "History Policy": "Keep Last",
            "Reliability Policy": "Reliable"}


def _model(vehicle, namespace):
    """The model and the markers of a namespace; links have the names of frames without it."""
    before = f"/{namespace}" if namespace else ""
    prefix = {"TF Prefix": namespace} if namespace else {}
    yield {"Class": "rviz_default_plugins/RobotModel", "Name": namespace or vehicle.name, "Enabled": True, "Value": True,
           "Description Source": "Topic", "Description Topic": {**_LATCHED, "Value": f"{before}/{MODEL}"}, **prefix,
           "Visual Enabled": True, "Collision Enabled": False, "Alpha": 1}
    yield {"Class": "rviz_default_plugins/MarkerArray", "Name": f"ground and bodies {namespace}".strip(), "Enabled": True,
           "Value": True, "Topic": {**_LATCHED, "Value": f"{before}/{MARKERS}"}}


def rviz_layout(vehicle: Vehicle) -> str:
    """The configuration as YAML."""
    extent = float(vehicle.extent)
    displays = [
        {"Class": "rviz_default_plugins/Grid", "Name": "Grid", "Enabled": True, "Value": True,
         "Cell Size": extent / 10, "Plane Cell Count": 20, "Reference Frame": "<Fixed Frame>"},
        *(display for namespace in vehicle.namespaces for display in _model(vehicle, namespace)),
        {"Class": "rviz_default_plugins/TF", "Name": "frames", "Enabled": True, "Value": True, "Show Axes": True,
         "Show Names": True, "Show Arrows": False, "Marker Scale": extent / 4, "Frame Timeout": 15}]
    view = {"Class": "rviz_default_plugins/Orbit", "Name": "Current View", "Distance": 2.2 * extent, "Pitch": 0.5,
            "Yaw": 0.8, "Focal Point": {"X": 0, "Y": 0, "Z": 0}, "Target Frame": vehicle.still_frame,
            "Near Clip Distance": extent / 1000}
    return yaml.safe_dump({
        "Panels": [{"Class": "rviz_common/Displays", "Name": "Displays"}, {"Class": "rviz_common/Views", "Name": "Views"},
                   {"Class": "rviz_common/Time", "Name": "Time"}],
        "Visualization Manager": {
            "Class": "", "Displays": displays, "Enabled": True, "Name": "root", "Value": True,
            "Global Options": {"Fixed Frame": vehicle.still_frame, "Frame Rate": 30, "Background Color": "48; 48; 48"},
            "Tools": [{"Class": "rviz_default_plugins/MoveCamera"}, {"Class": "rviz_default_plugins/Select"}],
            "Views": {"Current": view, "Saved": None}},
        "Window Geometry": {"Width": 1200, "Height": 800}}, sort_keys=False)
