"""How often the monitors of cubli_faults act although nothing has failed: benchmarks/rover_false_alarms.py [RUNS]

The scenario's graph and monitors, with a fault that never begins. Noise, gyro bias (as the filter expects it, 1e-3 rad/s
an axis) and start (within 0.03 rad of the balance point) are drawn anew for each run. Prints how many runs raised an alarm,
which, how many changed the mode or ended elsewhere than in balance, and the largest error of the attitude.
"""

import sys
from collections import Counter

import numpy as np

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load

NEVER = {"faults.fault.when": "t > 1000000"}


def main(runs: int) -> None:
    draws, alarms, ends, worst = np.random.default_rng(13), Counter(), Counter(), 0.0
    for number in range(runs):
        scenario = load("cubli_faults", {
            **NEVER, "seed": 1000 + number, "imu.gyro_bias": draws.normal(0.0, 1e-3, 3).tolist(),
            "plant.initial_angles": draws.uniform(-0.03, 0.03, 3).tolist()})
        recording = CompiledRun(scenario).run()
        found = metrics.compute(scenario, recording)
        last = recording["monitors"][-1]
        alarms.update(action.entry.id for action in scenario.faults.monitors.actions if last[action.entry.id] > 0.0)
        alarms["any"] += found["false_alarms"] > 0
        ends[found["end"], found["mode_changes"]] += 1
        worst = max(worst, found["attitude_error_max"])
    print(f"{runs} runs without fault: {alarms['any']} with an alarm {dict(alarms)}")
    print(f"ends (and changes of mode): {dict(ends)}; largest attitude error {worst:.3g} rad")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
