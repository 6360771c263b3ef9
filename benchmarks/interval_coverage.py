"""How often each interval holds the truth in 4000 repetitions: benchmarks/interval_coverage.py [REPETITIONS]

Prints the table of docs/statistics.md: what is promised, and what was found.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # where the tests stand

from tests.statistics import coverage

EXPERIMENTS = (coverage.rates, coverage.percentiles, coverage.bounds, coverage.stopping, coverage.pairs,
               coverage.correlations, coverage.indices, coverage.rare_events)


def main(repetitions: int) -> None:
    print(f"| interval | promised | held in {repetitions} repetitions |\n|---|---|---|")
    for experiment in EXPERIMENTS:
        for found in experiment(np.random.default_rng(20261127), repetitions):
            promised = f"{'at least ' if found.promise == 'at least' else ''}{100 * found.expected:.2f} %"
            print(f"| {found.name} | {promised} | {100 * found.covered:.2f} % |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else coverage.REPETITIONS)
