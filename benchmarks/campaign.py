"""What a campaign costs: runs a second on one core, counted with everything, beside Basilisk's; and memory over many runs.

    python benchmarks/campaign.py [--runs 400] [--short 100000] [--repeats 3] [--python BASILISK_PYTHON]

1. cubli_asteroid (60 s, 100 Hz) with drawn mass, angles and noise seeds: CPU time of the whole of a campaign in one thread,
   draws, preparation, loop, metrics, digest, file and fsync among it, divided by its runs; and the loop alone.
2. A pointing spacecraft with three reaction wheels (benchmarks/pointing, 60 s, 100 Hz) with drawn attitudes and rates, its
   campaign here, and in Basilisk nothing but the loop of one such run: making the simulation and judging it are free there.
3. --short runs of one second of the same spacecraft in one campaign: runs a second, and the memory of the process after a
   tenth of them and at the end. 1000000 takes about ten minutes a core.

CPU time is counted, since the machine may be busy; a ratio is of two measurements in a row.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # beside_basilisk.py

MEASURES = {"pointing_error": {"final": "tracking.error.sigma", "of": "norm"},
            "rate_peak": {"largest": "plant.truth.omega", "of": "norm", "unit": "rad/s"}}
ROVER = ["plant.mass=normal:2,0.04", "plant.initial_angles=uniform:-0.3,0.3", "seed=count:1"]
POINTING = {"random": {"plant.sigma": {"uniform": [-0.3, 0.3], "size": 3},
                       "plant.omega": {"uniform": [-0.05, 0.05], "size": 3}}}


def rover(runs: int):
    """The rover's campaign as a scenario."""
    from flight_graph.campaigns.opening import varied
    from flight_graph.components.foreign import agree
    return varied("cubli_asteroid", {}, ROVER, 1, agree)


def pointing(runs: int, seconds: float):
    """The spacecraft's campaign as a scenario."""
    from beside_basilisk import HERE

    from flight_graph.graphs.scenario import Scenario, read
    data, origin, folder = read(str(HERE / "wheels.yaml"), {"duration_s": seconds})
    return Scenario({**data, "measures": MEASURES, "vary": {**POINTING, "runs": runs}}, origin, folder)


def campaign(scenario, runs: int, folder: Path, watch=None) -> float:
    """CPU seconds of a campaign in one thread, the compilation apart."""
    from flight_graph.campaigns.opening import run_here
    from flight_graph.campaigns.workers import compile_first
    compile_first(scenario, 1)
    began = time.process_time()
    made = run_here(scenario, folder, runs, workers=1, progress=watch)
    spent = time.process_time() - began
    bad = [status for batch in made.batches(["status"]) for status in batch.column("status").to_pylist() if status != "ok"]
    if bad or made.missing():
        raise SystemExit(f"{len(bad)} of {runs} runs did not end well")
    return spent


def loop_alone(scenario) -> float:
    """CPU seconds of the loop of one case."""
    from flight_graph.campaigns.cases import Cases
    cases, spent = Cases(scenario), []
    cases.row(0)

    def fly():
        for number in range(9):
            made, structure = cases._variation.case(number)
            prepared = cases._ready(structure, made)
            flight = prepared.flight(made)
            began = time.thread_time()
            flight.advance(prepared.ticks)
            spent.append(time.thread_time() - began)

    thread = threading.Thread(target=fly)  # whose machine code runs in itself
    thread.start()
    thread.join()
    return statistics.median(spent)


def basilisk(python: Path, seconds: float, work: Path) -> float:
    """CPU seconds of the loop of one run in Basilisk, all messages recorded to memory."""
    from beside_basilisk import HERE, asked, parameters
    given = work / "wheels.json"
    given.write_text(json.dumps(parameters("wheels", seconds), default=list), encoding="utf-8")
    found = asked(python, HERE / "basilisk_program.py", given, "record", work / "basilisk.npz")
    return found["cpu_s"] * (seconds * 100.0) / found["ticks"]


def memory_mb() -> float:
    """Memory [MB] that the process holds now."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6
    except OSError:
        return float("nan")


def in_process(task: str, *words) -> dict:
    """A task of this file in a fresh process."""
    done = subprocess.run([sys.executable, __file__, "--task", task, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def task_of(name: str, runs: int, seconds: float) -> dict:
    """What a process of its own measures."""
    with tempfile.TemporaryDirectory() as work:
        scenario = rover(runs) if name == "rover" else pointing(runs, seconds)
        loop = loop_alone(scenario)
        marks, began = {}, time.monotonic()

        def watch(done, total):
            if "tenth" not in marks and done >= 0.1 * total:
                marks["tenth"] = memory_mb()

        spent = campaign(scenario, runs, Path(work) / "c", watch)
        size = sum(path.stat().st_size for path in (Path(work) / "c").iterdir())
        return {"cpu_s": spent, "wall_s": time.monotonic() - began, "loop_s": loop, "tenth_mb": marks.get("tenth"),
                "end_mb": memory_mb(), "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3, "bytes": size}


def spread(values) -> str:
    return f"{statistics.median(values):.3g} ({min(values):.3g} to {max(values):.3g})"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=400)
    options.add_argument("--short", type=int, default=100_000)
    options.add_argument("--repeats", type=int, default=3)
    options.add_argument("--python", type=Path, help="of an environment with Basilisk's wheel (bsk)")
    options.add_argument("--task", help=argparse.SUPPRESS)
    options.add_argument("--seconds", type=float, default=60.0, help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if chosen.task:
        print(json.dumps(task_of(chosen.task, chosen.runs, chosen.seconds)))
        return
    found = [in_process("rover", "--runs", chosen.runs) for _ in range(chosen.repeats)]
    rates = [chosen.runs / one["cpu_s"] for one in found]
    whole, loop = ([1e3 * value for value in values] for values in (
        [one["cpu_s"] / chosen.runs for one in found], [one["loop_s"] for one in found]))
    print(f"cubli_asteroid, 60 s, {chosen.runs} runs: {spread(rates)} runs a second of CPU; {spread(whole)} ms a run, of "
          f"which the loop {spread(loop)} ms")
    mine, theirs = [], []
    with tempfile.TemporaryDirectory() as work:
        for _ in range(chosen.repeats):
            mine.append(in_process("pointing", "--runs", chosen.runs))
            if chosen.python:
                theirs.append(basilisk(chosen.python, 60.0, Path(work)))
    rates = [chosen.runs / one["cpu_s"] for one in mine]
    print(f"pointing, three wheels, 60 s, {chosen.runs} runs: {spread(rates)} runs a second of CPU")
    if theirs:
        print(f"the loop of one such run in Basilisk: {spread(theirs)} s; runs a second here and there: "
              f"{spread([rate * other for rate, other in zip(rates, theirs)])} times")
    else:
        print("Basilisk is not compared: --python names an environment with its wheel (see beside_basilisk.py)")
    if chosen.short:
        one = in_process("pointing", "--runs", chosen.short, "--seconds", 1.0)
        print(f"pointing, 1 s, {chosen.short} runs in one campaign: {chosen.short / one['cpu_s']:.0f} runs a second of "
              f"CPU, {one['wall_s']:.0f} s on the clock, {one['bytes'] / chosen.short:.0f} bytes a row; memory "
              f"{one['tenth_mb']:.0f} MB after a tenth, {one['end_mb']:.0f} MB at the end, {one['peak_mb']:.0f} MB at most")


if __name__ == "__main__":
    main()
