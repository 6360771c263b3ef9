"""What the ros engine reaches: lockstep ticks a second with one process a node, realtime deadlines, the recorder.

    python benchmarks/ros_engine.py [--realtime SECONDS]

Prints one table. Nodes talk by real DDS between real processes on this machine.
"""

import argparse
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from flight_graph.graphs.scenario import load
from flight_graph.ros import launcher

HOPS = 4  # plant -> imu -> estimator -> controller -> plant


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--realtime", type=float, default=60.0, help="seconds of the realtime run")
    seconds = options.parse_args().realtime
    table = Table("quantity", "value", title="ros engine, cubli_asteroid: 6 nodes and a recorder, each a process",
                  title_justify="left")
    with tempfile.TemporaryDirectory() as folder:
        scenario = load("cubli_asteroid", {"duration_s": 120})
        began = time.perf_counter()
        run = launcher.run(scenario, Path(folder) / "lockstep")
        whole = time.perf_counter() - began
        ticks = scenario.duration_ns // scenario.graph.base_ns
        table.add_row("lockstep, ticks a second", f"{ticks / run.wall_s:.0f}")
        table.add_row("lockstep, microseconds a hop (4 hops a tick)", f"{1e6 * run.wall_s / ticks / HOPS:.0f}")
        table.add_row("lockstep, real-time factor", f"{120 / run.wall_s:.1f}")
        table.add_row("start and end of all processes, s", f"{whole - run.wall_s:.1f}")
        scenario = load("cubli_asteroid", {"duration_s": seconds})
        run = launcher.run(scenario, Path(folder) / "realtime", pace="realtime")
        plant = run.statistics["plant"]
        table.add_row(f"realtime, 100 Hz for {seconds:g} s: late commands", str(plant["late_inputs"]))
        table.add_row("realtime, deadline misses", str(plant["deadline_misses"]))
        for percent in (50, 90, 99, 100):
            table.add_row(f"realtime, plant to command, {percent} %, us", f"{plant[f'latency_us_p{percent}']:.0f}")
        table.add_row("realtime, messages lost", run.outcome["lost"])
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
