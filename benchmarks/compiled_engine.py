"""What the compiled engine costs: first compile, warm start, real-time factor, cost of a bag.

    python benchmarks/compiled_engine.py [SCENARIO ...]

Prints one table. Each row is made in a fresh process; the first one of a scenario with an empty cache.
"""

import json
import os
import subprocess
import sys
import tempfile
import time

from rich.console import Console
from rich.table import Table

SCENARIOS = ("cubli_asteroid", "cubli_asteroid_paper", "cubli_earth", "cubli_earth_paper")
PROBE = """
import json, sys, time
began = time.perf_counter()
from flight_graph.graphs.scenario import load
from flight_graph.engines.compiled import CompiledRun
from flight_graph.recordings.recording import write_recording
run = CompiledRun(load(sys.argv[1]))
compile_s = run.compile()
first_step_s = time.perf_counter() - began
walls = [run.run() for _ in range(5)]
best = min(walls, key=lambda recording: recording.wall_s)
began = time.perf_counter()
write_recording(best, sys.argv[2], "compiled")
bag_s = time.perf_counter() - began
messages = sum(len(track.records) for track in best.tracks)
print(json.dumps({"compile_s": compile_s, "first_step_s": first_step_s, "wall_s": best.wall_s,
                  "simulated_s": run.scenario.duration_ns / 1e9, "bag_s": bag_s, "messages": messages,
                  "ticks": run.scenario.duration_ns // run.graph.base_ns}))
"""


def probe(scenario: str, cache: str, folder: str) -> dict:
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", PROBE, scenario, folder], capture_output=True, text=True, check=True,
                          env={**os.environ, "FLIGHT_CACHE_DIR": cache})
    return {**json.loads(done.stdout), "process_s": time.perf_counter() - began}


def main() -> None:
    table = Table("scenario", "ticks", "first compile, s", "warm start to first step, s", "real-time factor",
                  "us a tick", "bag, us a message", title="compiled engine", title_justify="left")
    for scenario in sys.argv[1:] or SCENARIOS:
        with tempfile.TemporaryDirectory() as folder:
            cold = probe(scenario, f"{folder}/cache", f"{folder}/cold")
            warm = probe(scenario, f"{folder}/cache", f"{folder}/warm")
        table.add_row(scenario, str(warm["ticks"]), f"{cold['compile_s']:.1f}", f"{warm['first_step_s']:.2f}",
                      f"{warm['simulated_s'] / warm['wall_s']:.0f}", f"{1e6 * warm['wall_s'] / warm['ticks']:.2f}",
                      f"{1e6 * warm['bag_s'] / warm['messages']:.1f}")
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
