"""Checkpoints: continuation from random ticks of each vehicle, what they cost, steps back, and memory.

Byte-equality is checked for 50 random ticks of each vehicle; times are of this machine, ratios are of one run.
"""

import resource
import time

import numpy as np

from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.stepping.stepper import Stepper

VEHICLES = {"rover": ("cubli_faults", 60.0), "space robot": ("spacerobot_faults", 20.0), "lander": ("lander_faults", 20.0),
            "rover, 1 kHz": ("cubli_earth", 10.0), "lander on a mesh": ("lander_bennu_polyhedral", 20.0)}
TICKS = 50  # of each vehicle
PERIOD_S = 5.0  # [s] between checkpoints


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


def cost(scenario, kept) -> tuple[float, float, int, int, float]:
    """(CPU time of a run with checkpoints to one without, milliseconds to take one, size [bytes], packed size, milliseconds
    to pack one)."""
    found = []
    times, machines = {True: [], False: []}, {True: CompiledRun(kept), False: CompiledRun(scenario)}
    logs = {True: {}, False: {}}
    for _ in range(30):
        for keeping, machine in machines.items():
            began = time.process_time()
            recording = machine.run(logs=logs[keeping], keeping=keeping)
            times[keeping].append(time.process_time() - began)
            found = recording.checkpoints or found
    began = time.process_time()
    packed = [one.encode() for one in found]
    spent, without = min(times[True]), min(times[False])
    return (spent / without, max(0.0, 1e3 * (spent - without) / len(found)), found[0].size, len(packed[0]),
            1e3 * (time.process_time() - began) / len(packed))


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
    for number in range(1000):
        run.until(tick=0)
        run.until(tick=int(chance.integers(1, 2000)))
        run.back(7)
        if number == 100:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before


print(f"{'vehicle':<18}{'compared':>12}{'run with/without':>18}{'to take':>10}{'size':>12}{'packed':>10}{'to pack':>10}"
      f"{'back 1000':>12}")
for words, (name, seconds) in VEHICLES.items():
    plain = load(name, {"duration_s": seconds})
    kept = load(name, {"duration_s": seconds, "record": {"checkpoint_period_s": PERIOD_S if seconds > PERIOD_S else 1.0}})
    compared = continuations(plain)
    ratio, taken, size, packed, milliseconds = cost(plain, kept)
    print(f"{words:<18}{compared:>12}{ratio:>18.3f}{taken:>7.2f} ms{size / 1024:>8.1f} KiB{packed / 1024:>6.1f} KiB"
          f"{milliseconds:>7.2f} ms{1e3 * step_back(plain):>9.1f} ms", flush=True)
print(f"a thousand resets, runs and steps back: {growth()} KiB more")
