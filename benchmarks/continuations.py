"""Runs taken up at random ticks, of each vehicle and of a graph of several: every byte is that of the run itself.

    python benchmarks/continuations.py            # in process: 50 ticks of each; steps back; resets
    python benchmarks/continuations.py --nodes    # as ROS nodes instead, from three ticks of a compiled run

Times are of this machine.
"""

import argparse
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.recordings.continuation import continued
from flight_graph.stepping.stepper import Stepper

VEHICLES = {"rover": ("cubli_faults", 60.0), "space robot": ("spacerobot_faults", 20.0), "lander": ("lander_faults", 20.0),
            "rover, 1 kHz": ("cubli_earth", 10.0), "lander on a mesh": ("lander_bennu_polyhedral", 20.0),
            "two rovers, a lander": ("rovers_and_lander", 40.0)}
TICKS = 50  # of each vehicle
AS_NODES = ("two rovers, a lander", 10.0, 3)  # vehicle, seconds, ticks
RESETS = 1000


def continuations(scenario) -> int:
    """Continue from random ticks; return how many messages were compared. Every byte must be equal."""
    machine, chance, compared = CompiledRun(scenario), np.random.default_rng(2026), 0
    whole = machine.run()
    ticks = np.sort(chance.choice(np.arange(1, scenario.ticks), TICKS, replace=False))
    flight = CompiledRun(scenario, plan={}).start(0)
    for tick in ticks.tolist():
        flight.advance(tick)
        part = machine.run(begin=Checkpoint.decode(flight.checkpoint().encode(), "checkpoint"))
        for track, other in zip(whole.tracks, part.tracks):
            later = slice(int(np.searchsorted(track.stamps_ns, tick * scenario.graph.base_ns)), None)
            same = np.array_equal(track.stamps_ns[later], other.stamps_ns) and (
                track.records[later].tobytes() == other.records.tobytes())
            assert same, f"{scenario.name}: {track.topic} differs behind tick {tick}"
            compared += len(other.records)
    return compared


def step_back(scenario) -> float:
    """Seconds of the slowest of some steps back by 1000 ticks, from random ticks behind them."""
    run, chance, worst = Stepper(scenario), np.random.default_rng(1), 0.0
    run.until(tick=scenario.ticks)
    for tick in chance.integers(min(1000, scenario.ticks - 1), scenario.ticks, 10).tolist():
        run.until(tick=tick)
        began = time.perf_counter()
        run.back(ticks=1000)
        worst = max(worst, time.perf_counter() - began)
    return worst


def growth() -> int:
    """KiB that the process grows by while a run is gone through, stepped back and begun again a thousand times."""
    scenario = load("cubli_earth", {"duration_s": 10.0})
    run, chance = Stepper(scenario), np.random.default_rng(3)
    run.until(tick=scenario.ticks)
    before = 0
    for number in range(RESETS):
        run.until(tick=0)
        run.until(tick=int(chance.integers(1, 2000)))
        run.back(7)
        if number == 100:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before


def as_nodes(name, seconds, count) -> int:
    """Continue as nodes from random ticks of a compiled run; return how many messages were compared."""
    compared, chance = 0, np.random.default_rng(7)
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole"
        scenario = load(name, {"duration_s": seconds})
        runs.execute(scenario, out=whole)
        messages = list(read_bag(whole).messages())
        for tick in np.sort(chance.choice(np.arange(1, scenario.ticks), count, replace=False)).tolist():
            t_ns = tick * scenario.graph.base_ns
            made = continued(f"{whole}@{t_ns / 1e9!r}")
            runs.execute(made.scenario, "ros", out=Path(folder) / f"part_{tick}", begin=made.begin)
            part = list(read_bag(Path(folder) / f"part_{tick}").messages())
            later = [one for one in messages if one[1] >= scenario.epoch_ns + t_ns]
            assert sorted(part) == sorted(later), f"{name}: the nodes' bag from tick {tick} on differs"
            compared += len(part)
    return compared


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--nodes", action="store_true", help="as ROS nodes instead")
    if parser.parse_args().nodes:
        words, seconds, count = AS_NODES
        print(f"as nodes: {words}: {count} ticks, {as_nodes(VEHICLES[words][0], seconds, count)} messages, equal")
        return
    print(f"{'vehicle':<24}{'scenario':<28}{'ticks':>8}{'messages, equal':>18}{'back 1000 ticks':>18}")
    for words, (name, seconds) in VEHICLES.items():
        scenario = load(name, {"duration_s": seconds})
        compared = continuations(scenario)
        print(f"{words:<24}{name:<28}{TICKS:>8}{compared:>18}{1e3 * step_back(scenario):>15.1f} ms", flush=True)
    print(f"{RESETS} resets, runs and steps back: {growth()} KiB more")


main()
