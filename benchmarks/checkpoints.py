"""What checkpoints cost: times are of this machine, ratios are of one run. What is continued: `continuations.py`."""

import time

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load

VEHICLES = {"rover": ("cubli_faults", 60.0), "space robot": ("spacerobot_faults", 20.0), "lander": ("lander_faults", 20.0),
            "rover, 1 kHz": ("cubli_earth", 10.0), "lander on a mesh": ("lander_bennu_polyhedral", 20.0)}
PERIOD_S = 5.0  # [s] between checkpoints


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


print(f"{'vehicle':<18}{'run with/without':>18}{'to take':>10}{'size':>12}{'packed':>10}{'to pack':>10}")
for words, (name, seconds) in VEHICLES.items():
    plain = load(name, {"duration_s": seconds})
    kept = load(name, {"duration_s": seconds, "record": {"checkpoint_period_s": PERIOD_S if seconds > PERIOD_S else 1.0}})
    ratio, taken, size, packed, milliseconds = cost(plain, kept)
    print(f"{words:<18}{ratio:>18.3f}{taken:>7.2f} ms{size / 1024:>8.1f} KiB{packed / 1024:>6.1f} KiB"
          f"{milliseconds:>7.2f} ms", flush=True)
