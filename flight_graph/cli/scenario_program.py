"""The executable ``scenario`` of sim_nodes: ``ros2 run sim_nodes scenario cubli_asteroid`` runs a scenario as nodes."""

import signal
import sys


def main(arguments: list[str]) -> int:
    """The same as ``flight run ... --engine ros``, with all its options."""
    from flight_graph.cli import main as flight
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it ends its nodes and closes the bag
    sys.argv = ["flight", "run", *(arguments or ["--help"])] + (["--engine", "ros"] if arguments else [])
    return flight()
