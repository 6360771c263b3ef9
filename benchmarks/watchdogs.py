"""Nodes that are killed, stopped or restarted at random moments of a realtime run: is the graph safe in time, and is all tidy?

    python benchmarks/watchdogs.py [--rounds 20] [--scenario cubli_faults]

Each round takes the flight nodes of the scenario by turns and does each of three things to one of them at a random moment: kill
-9, SIGSTOP, and a fault `restart`. Printed of each: how long after the newest message of the node the mode manager was in
a safe state, in control periods after its deadline; whether the node beat again; whether the bag is complete and no process and no
shared memory is left.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml
from rich.console import Console
from rich.table import Table

from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import open_run
from flight_graph.ros import shared_memory

DURATION_S, GAP_S = 20.0, 1.5  # [s]
_FLIGHT = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rounds", type=int, default=20, help="times that each thing is done")
    options.add_argument("--scenario", default="cubli_faults", help="a scenario with a mode manager")
    options.add_argument("--seed", type=int, default=1, help="of the moments")
    chosen = options.parse_args()
    rng, table = random.Random(chosen.seed), Table("node", "what", "at [s]", "safe after [s]", "beats again", "bag", "tidy")
    for number in range(chosen.rounds):
        for what in ("kill", "stop", "restart"):
            table.add_row(*one(chosen.scenario, number, what, rng.uniform(4.0, 9.0)))
            print(".", end="", flush=True, file=sys.stderr)
    Console().print(table)


def one(name, number, what, at) -> list[str]:
    """One run; the row of the table."""
    scenario = load(name)
    nodes = [other for other in scenario.file.components if other != scenario.graph.clock_master]
    node = nodes[number % len(nodes)]
    data = scenario.file.model_dump(by_alias=True, exclude_none=True, exclude={"vary", "faults"})
    data |= {"duration_s": DURATION_S, "watchdog": {"gap_s": GAP_S, "restart": {"limit": 3, "window_s": 600}}}
    if what == "restart":
        data["faults"] = [{"id": "restart", "at": node, "type": "restart", "from_s": round(at, 1), "for_s": 0.5}]
    before = set(shared_memory.leftovers(0.0))
    with tempfile.TemporaryDirectory() as folder:
        path, bag = Path(folder) / "scenario.yaml", Path(folder) / "bag"
        path.write_text(yaml.safe_dump(data))
        process = subprocess.Popen([*_FLIGHT, "run", path, "--engine", "ros", "--pace", "realtime", "--out", bag, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        pids = disturb(process, bag, node, what, at)
        out, err = process.communicate()
        if process.returncode:
            return [node, what, f"{at:.1f}", "-", err.strip().splitlines()[-1][:60], "-", "-"]
        found, _, signals = open_run(bag, trust=True)
        notes = json.loads(out)["watchdog"]
        tidy = not any(Path(f"/proc/{pid}").exists() for pid in pids) and not set(shared_memory.leftovers(0.0)) - before
        return [node, what, f"{at:.1f}", entered(scenario, found, signals, node),
                str(any("started again" in text for text in notes)),
                found.metadata["flight_graph.outcome"]["complete"], str(tidy)]


def disturb(process, bag, node, what, at) -> set[int]:
    """Do it at a moment of the run; the process ids of all nodes."""
    while not (bag / "RECORDING").exists() and process.poll() is None:
        time.sleep(0.05)
    began = time.monotonic()
    while time.monotonic() - began < at and process.poll() is None:
        time.sleep(0.01)
    pids = descendants(process.pid)
    if what != "restart" and node in pids:
        os.kill(pids[node], signal.SIGKILL if what == "kill" else signal.SIGSTOP)
    return set(pids.values())


def descendants(pid) -> dict[str, int]:
    """name -> process id, of all that descends from a process."""
    parents, names = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (folder / "stat").read_text().partition("(")[2].rpartition(")")
        except OSError:
            continue
        parents[int(folder.name)], names[int(folder.name)] = int(rest.split()[1]), name
    found, last = {pid}, set()
    while found != last:
        last = set(found)
        found |= {child for child, parent in parents.items() if parent in found}
    return {names[one]: one for one in found if one in names and one != pid}


def entered(scenario, bag, signals, node) -> str:
    """How long after the newest message of the node before its silence the mode changed [s]; -: it did not need to."""
    modes = next(one for one in scenario.graph.nodes.values() if one.component.modes)
    record = signals[modes.component.outputs["mode"].topic]
    port = next(iter(scenario.graph.nodes[node].component.outputs))
    stamps = bag.stamps_ns("/" + scenario.graph.signal(node, port).topic) - scenario.epoch_ns
    gaps = stamps[1:] - stamps[:-1]
    last = stamps[gaps.argmax()] / 1e9 if len(gaps) and gaps.max() > 2e8 else stamps[-1] / 1e9
    after = record["entered"][(record["mode"] != 0.0) & (record["entered"] > last)]
    return f"{float(after[0]) - last:.3f}" if len(after) else "-"


if __name__ == "__main__":
    main()
