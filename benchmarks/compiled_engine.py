"""What the compiled engine costs: cold compile, start of a new graph, a tick, a bag; here and at an older commit.

    python benchmarks/compiled_engine.py [--before COMMIT] [SCENARIO ...]

Prints one table a tree. A cold compile is given in CPU seconds of all its processes, too (the machine may be busy); a tick
is the best of several runs. --before: also measure that commit, unpacked into a temporary folder, first.
"""

import argparse
import io
import json
import os
import resource
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

import yaml
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
SCENARIOS = ("cubli_asteroid", "cubli_asteroid_paper", "spacerobot_harmonic_rls", "lander_nominal", "lander_estimated")
LOAD = """
import json, sys, time
began = time.perf_counter()
try:  # where the modules stood before they had rooms
    from flight_graph.scenario import available, load
    from flight_graph.compiled import CompiledRun
    from flight_graph.recording import write_recording
except ImportError:
    from flight_graph.graphs.scenario import load
    from flight_graph.graphs.source import available
    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.recordings.recording import write_recording
"""
COLD = LOAD + """
scenarios = [load(name) for name in sys.argv[1:] or available()]
for scenario in scenarios:
    CompiledRun(scenario).compile()
print(json.dumps({"wall_s": time.perf_counter() - began}))
"""
WARM = LOAD + """
run = CompiledRun(load(sys.argv[1]))
run.compile()
start_s = time.perf_counter() - began
ticks = run.scenario.duration_ns // run.graph.base_ns
walls = []
for _ in range(int(sys.argv[3])):
    cpu = time.process_time()
    recording = run.run()
    walls.append((min(recording.wall_s, time.process_time() - cpu)))
began = time.perf_counter()
write_recording(recording, sys.argv[2], "compiled")
messages = sum(len(track.records) for track in recording.tracks)
print(json.dumps({"start_s": start_s, "tick_us": 1e6 * min(walls) / ticks, "ticks": ticks,
                  "factor": run.scenario.duration_ns / 1e9 / min(walls),
                  "message_us": 1e6 * (time.perf_counter() - began) / messages}))
"""


def probe(tree: Path, cache: Path, code: str, *arguments: str) -> dict:
    """What a program prints, with the CPU seconds of its process and of those it started."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, cwd=tree,
                          env={**os.environ, "FLIGHT_CACHE_DIR": str(cache), "PYTHONPATH": str(tree)})
    if done.returncode:
        raise SystemExit(f"{tree}: {' '.join(arguments)}: {done.stderr[-2000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {**json.loads(done.stdout), "cpu_s": cpu_s, "process_s": time.perf_counter() - began}


def unpacked(commit: str, folder: Path) -> Path:
    """The tree of a commit."""
    packed = subprocess.run(["git", "-C", str(ROOT), "archive", commit], capture_output=True, check=True).stdout
    tarfile.open(fileobj=io.BytesIO(packed)).extractall(folder, filter="data")
    return folder


def measure(tree: Path, scenarios: list[str], everything: bool, repeats: int) -> tuple[dict, dict]:
    """scenario -> its numbers; and those of the cold compile of all scenarios together."""
    rows, whole = {}, {}
    for scenario in scenarios:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            cold = probe(tree, folder / "cache", COLD, scenario)
            warm = probe(tree, folder / "cache", WARM, scenario, str(folder / "bag"), str(repeats))
            rows[scenario] = {**warm, "cold_cpu_s": cold["cpu_s"], "cold_s": cold["process_s"]}
    if everything:
        with tempfile.TemporaryDirectory() as folder:
            whole = probe(tree, Path(folder) / "cache", COLD)
    return rows, whole


def new_graph(tree: Path) -> float:
    """Seconds from nothing to the first step of a graph without its monitor: never seen, of compiled components."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        probe(tree, folder / "cache", COLD, "cubli_asteroid")
        data = yaml.safe_load((tree / "scenarios/cubli_asteroid.yaml").read_text(encoding="utf-8"))
        del data["components"]["monitor"]
        path = folder / "new_graph.yaml"
        path.write_text(yaml.safe_dump(data), encoding="utf-8")
        return min(probe(tree, folder / "cache", COLD, str(path))["wall_s"] for _ in range(3))


def show(title: str, rows: dict, whole: dict) -> None:
    """One table."""
    table = Table("scenario", "ticks", "cold: CPU s", "cold: wall s", "warm start, s", "us a tick", "real-time factor",
                  "bag, us a message", title=title, title_justify="left")
    for name, row in rows.items():
        table.add_row(name, str(row["ticks"]), f"{row['cold_cpu_s']:.1f}", f"{row['cold_s']:.1f}", f"{row['start_s']:.2f}",
                      f"{row['tick_us']:.3f}", f"{row['factor']:.0f}", f"{row['message_us']:.1f}")
    if whole:
        table.add_row("all scenarios together", "", f"{whole['cpu_s']:.1f}", f"{whole['process_s']:.1f}", *[""] * 4)
    Console(width=140).print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=SCENARIOS)
    parser.add_argument("--before", metavar="COMMIT", help="measure this commit, too")
    parser.add_argument("--all", action="store_true", help="also compile all scenarios together, cold")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    if options.before:
        with tempfile.TemporaryDirectory() as folder:
            show(f"before ({options.before})", *measure(
                unpacked(options.before, Path(folder)), options.scenarios, options.all, options.repeats))
    show("here", *measure(ROOT, options.scenarios, options.all, options.repeats))
    print(f"a new graph of compiled components: {new_graph(ROOT):.2f} s from nothing to its first step")


if __name__ == "__main__":
    main()
