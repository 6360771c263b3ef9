"""The components that follow from the blocks ``monitors`` and ``faults`` of a scenario."""

from flight_graph.faults import report
from flight_graph.graphs.graph import Node
from flight_graph.monitors.monitor_set import component_of
from flight_graph.timebase import period_ns


def added_nodes(nodes: list[Node], entries: list, watching, origin: str) -> list[Node]:
    """Their nodes. nodes: of the rest of the graph; entries: of the faults; watching: the monitors' block, or None.

    Raises FlightError.
    """
    added = []
    if watching:
        where = f"{origin}: monitors"
        name, component = component_of(watching, {node.name: node for node in nodes}, where)
        period_ns(watching.rate_hz, f"{where}.rate_hz")
        added.append(Node(report.MONITORS, name, component, {}, watching.rate_hz))
    if entries:
        identifiers = [entry.id for entry in entries]
        added.append(Node(report.REPORT, report.use(identifiers), report.fault_report(tuple(identifiers)), {},
                          report.report_rate_hz(nodes)))
    return added
