"""What faults cost: a scenario without faults against the tree before there were any, and what each fault adds to a tick.

    python benchmarks/fault_cost.py [--before COMMIT] [SCENARIO]

Both trees run in turn, in processes of their own; a time is the CPU time of the best of many runs, so that a busy machine
matters little. The tree before is the parent of the commit that made `flight_graph/faults`, unless --before names one.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.compiled_engine import unpacked

SENSOR, READER = "imu.imu.angular_velocity[2]", "estimator <- imu.angular_velocity[2]"
CASES = {  # of the scenario cubli_asteroid
    "without": [],
    "a bias that is not active": [{"at": SENSOR, "type": "bias", "value": 1e-9, "from_s": 1e6}],
    "a bias": [{"at": SENSOR, "type": "bias", "value": 1e-9}],
    "a bias of one reader": [{"at": READER, "type": "bias", "value": 1e-9}],
    "noise": [{"at": SENSOR, "type": "noise", "value": 1e-9}],
    "a bias while a condition holds": [
        {"at": SENSOR, "type": "bias", "value": 1e-9, "when": "imu.imu.angular_velocity[0] > -9 and t > 0"}],
    "lost messages": [{"at": "imu.imu", "type": "drop", "probability": 0.01}],
    "a parameter": [{"at": "controller.parameters.lambda_a", "type": "scale", "value": 1.000000001}],
    "a component that may hang": [{"at": "estimator", "type": "hang", "from_s": 1e6}],
    "100 biases": [{"at": SENSOR, "type": "bias", "value": 1e-12}] * 100,
}
SERVE = """
import json, sys, time
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario, read
runs = {}
for line in sys.stdin:
    name, faults = json.loads(line)
    if name not in runs:
        data, *rest = read(sys.argv[1], {"duration_s": float(sys.argv[2])})
        if faults:
            data["faults"] = [{"id": f"it{n}", **one} for n, one in enumerate(faults)]
        run, logs = CompiledRun(Scenario(data, *rest)), {}
        run.run(logs=logs)
        runs[name] = run, logs
    run, logs = runs[name]
    began = time.process_time()
    wall_s = run.run(logs=logs).wall_s
    spent = min(time.process_time() - began, wall_s)
    print(json.dumps(1e6 * spent * run.graph.base_ns / run.scenario.duration_ns), flush=True)
"""


class Tree:
    """A process that runs a scenario of a tree with given faults, as often as it is asked; microseconds a tick."""

    def __init__(self, tree: Path, cache: str, scenario: str, duration_s: float):
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVE, scenario, str(duration_s)], cwd=tree, text=True, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(tree), "FLIGHT_CACHE_DIR": cache})

    def __call__(self, name: str, faults: list) -> float:
        self._process.stdin.write(json.dumps([name, faults]) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait()


def before_faults() -> str:
    """The parent of the commit that made the package of faults."""
    command = ["git", "-C", str(ROOT), "log", "--diff-filter=A", "--format=%H", "--", "flight_graph/faults/fault_set.py"]
    return f"{subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()[-1]}^"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", nargs="?", default="cubli_asteroid")
    parser.add_argument("--before", metavar="COMMIT", help="the tree without faults")
    parser.add_argument("--duration", type=float, default=60.0, help="of a run [s]")
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        older = unpacked(options.before or before_faults(), Path(folder) / "before")
        trees = [Tree(tree, f"{folder}/{name}", options.scenario, options.duration)
                 for name, tree in (("cache_before", older), ("cache", ROOT))]
        least = {name: float("inf") for name in ["before", *CASES]}
        for _ in range(options.rounds):
            least["before"] = min(least["before"], trees[0]("without", []))
            for name, faults in CASES.items():
                least[name] = min(least[name], trees[1](name, faults))
        for tree in trees:
            tree.close()
    table = Table("run", "us a tick", "ratio", "more, us a tick", title_justify="left",
                  title=f"{options.scenario}, {options.duration:g} s")
    table.add_row("before", f"{least['before']:.3f}", "", "")
    for name in CASES:
        other = least["before" if name == "without" else "without"]
        table.add_row(name, f"{least[name]:.3f}", f"{least[name] / other:.3f}", f"{least[name] - other:.3f}")
    Console(width=110).print(table)
    print(f"without faults against the tree before: {least['without'] / least['before']:.3f}; "
          f"one active fault against none: {least['a bias'] / least['without']:.3f}")


if __name__ == "__main__":
    main()
