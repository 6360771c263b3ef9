"""Executables of this package: name -> module:attribute."""

EXECUTABLES = {
    "recorder": "flight_graph.ros.recorder:main",
    "scenario": "flight_graph.ros.launcher:main",
}
