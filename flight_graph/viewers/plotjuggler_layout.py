"""A layout for PlotJuggler: a tab with the plots to look at first, then one for each topic."""

import xml.etree.ElementTree as ElementTree

from flight_graph.viewers.overview import Plot
from flight_graph.viewers.vehicle import Vehicle

_COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22",
            "#000080", "#006400")


def plotjuggler_layout(vehicle: Vehicle) -> str:
    """The layout as XML."""
    root = ElementTree.Element("root")
    widget = ElementTree.SubElement(root, "tabbed_widget", parent="main_window", name="Main Window")
    for title, plots in {"overview": vehicle.overview, **vehicle.topics}.items():
        if plots:
            _tab(widget, title, plots)
    ElementTree.SubElement(widget, "currentTabIndex", index="0")
    ElementTree.SubElement(root, "use_relative_time_offset", enabled="1")
    ElementTree.indent(root, " ")
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ElementTree.tostring(root, encoding="unicode") + "\n"


def _tab(widget, title, plots: list[Plot]):
    tab = ElementTree.SubElement(widget, "Tab", tab_name=title, containers="1")
    splitter = ElementTree.SubElement(
        ElementTree.SubElement(tab, "Container"), "DockSplitter", orientation="-", count=str(len(plots)),
        sizes=";".join([f"{1 / len(plots):.6f}"] * len(plots)))
    for plot in plots:
        area = ElementTree.SubElement(splitter, "DockArea", name=plot.full_title)
        drawn = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false",
                                       line_width="1.5")
        ElementTree.SubElement(drawn, "limitY")
        curves = [_curve(one.topic, line) for one in plot.series for line in one.lines]
        for number, curve in enumerate(curves):
            ElementTree.SubElement(drawn, "curve", name=curve, color=_COLOURS[number % len(_COLOURS)])


def _curve(topic, line) -> str:
    """What PlotJuggler calls a number: it knows the names in a message, and puts them before the field."""
    if line.own:
        return f"{topic}/{line.own}/{line.path.partition('[')[0]}"
    return f"{topic}/{line.path.replace('.', '/')}"
