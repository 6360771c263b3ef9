"""A layout for Foxglove and Lichtblick: the moving vehicle, plots beside it, parameters, a tab for each topic."""

import json

from flight_graph.viewers.overview import Plot
from flight_graph.viewers.vehicle import MARKERS, MODEL, Vehicle


def foxglove_layout(vehicle: Vehicle) -> str:
    """The layout as JSON."""
    panels = {"3D!picture": _picture(vehicle),
              "Parameters!parameters": _titled("parameters, to be set while it flies")}
    beside = _named(panels, "overview", vehicle.overview)
    first = {"direction": "row", "first": "3D!picture", "second": _column(beside), "splitPercentage": 60} if (
        beside) else "3D!picture"
    tabs = [{"title": "overview", "layout": first}, {"title": "parameters", "layout": "Parameters!parameters"}]
    for topic, plots in vehicle.topics.items():
        name = topic.strip("/")
        tabs.append({"title": name, "layout": _column(_named(panels, name.replace("/", "_"), plots))})
    panels["Tab!topics"] = {"activeTabIdx": 0, "tabs": tabs}
    return json.dumps({"configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1},
                       "layout": "Tab!topics"}, indent=1) + "\n"


def _picture(vehicle):
    extent = vehicle.extent
    grid = {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True, "size": 2 * extent, "divisions": 20}
    return {**_titled(vehicle.name), "followMode": "follow-pose", "followTf": vehicle.still_frame,
            "layers": {"grid": grid, **_models(vehicle)}, "transforms": {}, "imageMode": {}, "publish": {},
            "topics": {f"{'/' * bool(namespace)}{namespace}/{topic}": {"visible": True} for namespace in vehicle.namespaces
                       for topic in (MODEL, MARKERS)},
            "scene": {"transforms": {"axisScale": 0.2 * extent, "labelSize": 0.03 * extent}},
            "cameraState": {"perspective": True, "distance": 2.2 * extent, "phi": 62, "thetaOffset": 35,
                            "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
                            "fovy": 45, "near": 0.001 * extent, "far": 1000 * extent}}


def _models(vehicle) -> dict:
    """Layers for the models of namespaces: links have the names of frames without it."""
    return {namespace: {"layerId": "foxglove.Urdf", "instanceId": namespace, "label": namespace, "visible": True,
                        "sourceType": "topic", "topic": f"/{namespace}/{MODEL}", "framePrefix": f"{namespace}/",
                        "displayMode": "visual"} for namespace in vehicle.namespaces if namespace}


def _titled(title: str) -> dict:
    """The title of a panel: each of the two has a key of its own."""
    return {"foxglovePanelTitle": title, "lichtblickPanelTitle": title}


def _named(panels, prefix, plots: list[Plot]) -> list[str]:
    """Make a panel of each plot; their names."""
    found = []
    for number, plot in enumerate(plots):
        found.append(f"Plot!{prefix}{number}")
        paths = [{"value": f"{one.topic}.{line.path}", "label": label, "enabled": True,
                  "timestampMethod": "receiveTime"} for one in plot.series for line, label in zip(one.lines, one.labels)]
        panels[found[-1]] = {
            **_titled(plot.full_title), "paths": paths,
            "showXAxisLabels": True, "showYAxisLabels": True, "showLegend": True,
            "legendDisplay": "left", "showPlotValuesInLegend": False, "isSynced": True, "xAxisVal": "timestamp"}
    return found


def _column(names):
    """Panels below each other, each of the same height."""
    if len(names) == 1:
        return names[0]
    return {"direction": "column", "first": names[0], "second": _column(names[1:]), "splitPercentage": 100 / len(names)}
