"""How often the monitors of a vehicle act although nothing has failed: benchmarks/false_alarms.py [SCENARIO] [RUNS]

The catalogue's graph and monitors with a fault that never begins, under other seeds of all noise. Prints how many runs
raised an alarm, which, and the modes at the end.
"""

import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load

CATALOGUES = ("cubli_faults", "spacerobot_faults", "lander_faults")
NEVER = {"faults.fault.when": "t > 1000000"}


def judged(name: str, seed: int):
    """(actionpoints that acted, mode at the end) of a run without fault."""
    scenario = load(name, {**NEVER, "seed": seed})
    recording = CompiledRun(scenario).run()
    last = recording["monitors"][-1]
    acted = [action.entry.id for action in scenario.faults.monitors.actions if last[action.entry.id] > 0.0]
    return acted, metrics.compute(scenario, recording).get("final_mode")


def main(name: str, runs: int) -> None:
    judged(name, 0)
    with ThreadPoolExecutor(max_workers=2) as pool:
        found = list(pool.map(lambda seed: judged(name, seed), range(1, runs + 1)))
    alarms = Counter(one for acted, _ in found for one in acted)
    print(f"{name}: {runs} runs without fault, {sum(bool(acted) for acted, _ in found)} with an alarm {dict(alarms)}; "
          f"modes at the end {dict(Counter(mode for _, mode in found))}")


if __name__ == "__main__":
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    for catalogue in sys.argv[1:2] or CATALOGUES:
        main(catalogue, count)
