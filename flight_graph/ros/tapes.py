"""Files of what a foreign node said in a recorded run: written by who starts the nodes, read by its stand-in."""

from pathlib import Path

import numpy as np

from flight_graph.graphs.scenario import Scenario


def write(path: Path, scenario: Scenario, name: str) -> str:
    """Write the tape of a foreign node for its stand-in; return the file's name."""
    found = {}
    for port, signal in scenario.graph.nodes[name].component.outputs.items():
        ticks, records = scenario.tapes[name, port]
        found[f"{port} times"], found[f"{port} messages"] = ticks * scenario.graph.base_ns, signal.payloads(records)
    np.savez(path, **found)
    return str(path)


def read(file: str) -> dict[str, np.ndarray]:
    """A tape, as `write` left it."""
    with np.load(file, allow_pickle=False) as found:
        return dict(found)
