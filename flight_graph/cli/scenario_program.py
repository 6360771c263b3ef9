"""The executable ``scenario`` of sim_nodes: ``ros2 run sim_nodes scenario cubli_asteroid`` runs a scenario as nodes."""

import sys


def main(arguments: list[str]) -> int:
    """The same as ``flight run ... --engine ros``, with all its options."""
    from flight_graph.cli import main as flight
    sys.argv = ["flight", "run", *(arguments or ["--help"])] + (["--engine", "ros"] if arguments else [])
    return flight()
