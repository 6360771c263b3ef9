"""The same pointing spacecraft here and in Basilisk: microseconds a tick of both, and how far the two motions differ.

    python benchmarks/beside_basilisk.py --python BASILISK_PYTHON [--repeats 7] [--seconds 600]

Rigid body, MRP feedback at 100 Hz, classical Runge-Kutta of fourth order with steps of 10 ms, constant force and disturbing
torque; once with three reaction wheels, once with torques on the body. Each side has the same blocks with the same messages
between them (benchmarks/pointing/): ours as compiled components, Basilisk's as its own C++ and C modules in one task; each
problem with every message recorded to memory, and with none. The two take turns, each time in a fresh process whose first
tenth of the ticks is warm-up. What is counted is CPU time of the loop alone: the machine may be busy with other work.
A ratio is of two runs in a row, and its spread that of all such pairs. The last line says how much of Basilisk's time
goes into its spacecraft alone, whose equations of motion are general: any effector, gravity, changing mass.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

HERE = Path(__file__).resolve().parent / "pointing"
PROBLEMS = {"wheels": "three reaction wheels", "torque": "torques on the body"}
NEEDED = ("Basilisk is not part of this project: make it an environment by `python -m venv basilisk-env` and "
          "`basilisk-env/bin/pip install bsk numba`, and name it by --python basilisk-env/bin/python")
STATES = {"position": "m", "velocity": "m/s", "sigma": "1", "omega": "rad/s"}
QUANTITIES = {**STATES, "wheel speeds": "rad/s"}


def scenario_of(problem: str, seconds: float, recorded: bool = True):
    """The scenario; no message is recorded where none is to be."""
    from flight_graph.graphs.scenario import load
    return load(str(HERE / f"{problem}.yaml"), {"duration_s": seconds, **({} if recorded else {"record": {"topics": []}})})


def ours(problem: str, seconds: float, recorded: bool, trajectory: Path) -> None:
    """One run of this project's side, in a process of its own; prints one line of JSON."""
    from flight_graph.engines.compiled import CompiledRun
    began = time.perf_counter()
    run = CompiledRun(scenario_of(problem, seconds, recorded))
    run.compile()
    start_s = time.perf_counter() - began
    ticks = run.scenario.duration_ns // run.graph.base_ns
    flight = run.start(ticks)
    flight.advance(ticks // 10)
    wall, cpu = time.perf_counter(), time.process_time()
    flight.advance(ticks)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if recorded:
        tracks = {track.topic: track for track in flight.tracks()}
        truth = tracks["pointing/truth"]
        parts = [truth.records[name] for name in STATES]
        if problem == "wheels":
            parts.append(tracks["pointing/wheel_speeds"].records["speeds"])
        np.savez(trajectory, t_ns=truth.stamps_ns, state=np.hstack(parts))
    print(json.dumps({"wall_s": wall, "cpu_s": cpu, "start_s": start_s, "ticks": ticks - ticks // 10}))


def parameters(problem: str, seconds: float) -> dict:
    """What the other side needs to set up the same: the scenario's parameters, the period and the ticks."""
    scenario = scenario_of(problem, seconds)
    ticks = scenario.duration_ns // scenario.graph.base_ns
    return {**{name: dict(node.values) for name, node in scenario.graph.nodes.items()},
            "period_s": scenario.graph.base_ns / 1e9, "ticks": ticks, "ticks_of_warm_up": ticks // 10}


def asked(*command) -> dict:
    """The last line that a program prints, read as JSON."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}:\n{done.stderr[-2000:]}\n{NEEDED}")
    return json.loads(done.stdout.splitlines()[-1])


def differences(first: Path, second: Path) -> list[tuple[str, float, float]]:
    """Of each quantity: largest difference of a component at any tick, and its largest value. Raises SystemExit."""
    one, other = np.load(first), np.load(second)
    stamps, mine, theirs = np.intersect1d(one["t_ns"], other["t_ns"], return_indices=True)
    if len(stamps) < len(one["t_ns"]):
        raise SystemExit(f"{len(one['t_ns']) - len(stamps)} of {len(one['t_ns'])} ticks are missing in the other recording")
    reference = other["state"][theirs].reshape(len(stamps), -1, 3)
    off = np.abs(one["state"][mine].reshape(reference.shape) - reference).max(axis=(0, 2))
    largest = np.abs(reference).max(axis=(0, 2))
    return [(f"{name}, {unit}", *pair) for (name, unit), *pair in zip(QUANTITIES.items(), off, largest)]


def in_turn(problem: str, recorded: bool, chosen, work: Path) -> tuple[list[dict], list[dict]]:
    """The runs of both sides, one after the other."""
    how, here, there = "record" if recorded else "bare", [], []
    for _ in range(chosen.repeats):
        here.append(asked(sys.executable, __file__, "--ours", problem, how, work / f"{problem}_ours.npz",
                          "--seconds", chosen.seconds))
        there.append(basilisk(problem, how, chosen, work))
        if recorded:
            for side, run in (("ours", here[-1]), ("basilisk", there[-1])):
                run["state"] = np.load(work / f"{problem}_{side}.npz")["state"].tobytes()
    return here, there


def basilisk(problem: str, how: str, chosen, work: Path) -> dict:
    """One run of the other side."""
    given = work / f"{problem}.json"
    given.write_text(json.dumps(parameters(problem, chosen.seconds), default=list), encoding="utf-8")
    return asked(chosen.python, HERE / "basilisk_program.py", given, how, work / f"{problem}_basilisk.npz")


def shown(values: list[float]) -> str:
    """Median, least and most."""
    return f"{statistics.median(values):.3g} ({min(values):.3g} to {max(values):.3g})"


def microseconds(run: dict) -> float:
    return 1e6 * run["cpu_s"] / run["ticks"]


def compare(chosen, work: Path) -> None:
    """Run everything and print it."""
    costs = Table("control", "recorded messages", "ours, us a tick", "Basilisk, us a tick", "ratio", title_justify="left",
                  title=f"CPU time of the loop: median of {chosen.repeats} (least to most)")
    motions = Table("control", "quantity", "largest difference", "largest value", title="Is it the same motion?",
                    title_justify="left")
    alone, repeatable = [], {"ours": True, "Basilisk": True}
    for problem, control in PROBLEMS.items():
        asked(sys.executable, __file__, "--ours", problem, "record", work / "compiled.npz", "--seconds", 10)
        for recorded in (True, False):
            here, there = in_turn(problem, recorded, chosen, work)
            for side, made in zip(repeatable, (here, there)):
                repeatable[side] &= len({run.get("state") for run in made}) == 1
            mine, theirs = ([microseconds(run) for run in runs] for runs in (here, there))
            costs.add_row(control, "all" if recorded else "none", shown(mine), shown(theirs),
                          shown([slow / fast for slow, fast in zip(theirs, mine)]))
        for name, off, largest in differences(work / f"{problem}_ours.npz", work / f"{problem}_basilisk.npz"):
            motions.add_row(control, name, f"{off:.1e}", f"{largest:.3g}")
        alone.append(f"{microseconds(basilisk(problem, 'plant', chosen, work)):.1f}")
    Console(width=128).print(costs, motions)
    ready, started = (statistics.median(run["start_s"] for run in runs) for runs in (here, there))
    print(f"Basilisk {there[0]['version']}, navigation by {there[0]['navigation']}; its spacecraft alone: "
          f"{' and '.join(alone)} us a tick\n"
          f"from nothing to the first tick: ours {ready:.2f} s (once compiled), Basilisk {started:.2f} s\n"
          "recorded runs equal byte for byte among themselves: "
          + ", ".join(f"{side} {'yes' if equal else 'no'}" for side, equal in repeatable.items()))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--python", help="an interpreter that has bsk (Basilisk)")
    options.add_argument("--repeats", type=int, default=7, help="runs of each side for each row")
    options.add_argument("--seconds", type=float, default=600.0, help="simulated time")
    options.add_argument("--ours", nargs=3, metavar=("PROBLEM", "HOW", "TRAJECTORY"), help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if chosen.ours:
        problem, how, trajectory = chosen.ours
        ours(problem, chosen.seconds, how == "record", Path(trajectory))
        return
    if not chosen.python:
        print(f"Skipped. {NEEDED}.")
        return
    with tempfile.TemporaryDirectory() as work:
        compare(chosen, Path(work))


if __name__ == "__main__":
    main()
