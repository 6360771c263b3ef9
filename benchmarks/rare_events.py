"""Subset simulation against known probabilities, and on the landing: benchmarks/rare_events.py [REPETITIONS] [--lander]

Prints how the estimates of the linear limit state P(sum z / sqrt(d) >= beta) scatter, beside what each says of itself;
with --lander the probability that lander_dispersed touches down outside of 1 m, and a campaign's rate beside a
probability that it can see.
"""

import math
import sys

import numpy as np
from scipy import stats

from flight_graph.campaigns.cases import Cases
from flight_graph.campaigns.rare_events import Event, rare_event
from flight_graph.graphs.scenario import load
from flight_graph.statistics.rates import rate
from flight_graph.statistics.subset_simulation import subset_simulation

CASES = ((2, 3.0902, 1000), (100, 3.0902, 1000), (2, 4.7534, 1000), (100, 4.7534, 1000), (100, 4.7534, 4000))
SEEN, RUNS = 0.35, 2000  # [m] a distance that a campaign of so many runs sees


def linear(repetitions: int) -> None:
    print("| dimensions | truth | runs a level | runs | mean / truth | scatter | said | 95 % interval held it |")
    print("|---|---|---|---|---|---|---|---|")
    for dimensions, beta, runs in CASES:
        truth = float(stats.norm.sf(beta))
        found = [subset_simulation(lambda z, d=dimensions: z.sum(axis=1) / math.sqrt(d), dimensions, beta, runs, seed=seed)
                 for seed in range(repetitions)]
        values = np.array([one.probability for one in found]) / truth
        held = np.mean([one.low <= truth <= one.high for one in found])
        print(f"| {dimensions} | {truth:.3g} | {runs} | {np.mean([one.runs for one in found]):.0f} | {values.mean():.2f} | "
              f"{values.std():.2f} | {np.mean([one.variation for one in found]):.2f} | {100 * held:.1f} % |", flush=True)


def lander() -> None:
    scenario = load("lander_dispersed")
    for limit, runs in ((SEEN, 500), (1.0, 400)):
        found = rare_event(scenario, Event("lateral_m", above=limit), runs, down_to=1e-6).estimate
        print(f"lander_dispersed, lateral_m >= {limit} m: {found.probability:.3g}, coefficient of variation "
              f"{found.variation:.2f}, 95 % interval {found.low:.2g} to {found.high:.2g}, {found.runs} runs, "
              f"{found.missing} without a number; levels at {', '.join(f'{one.threshold:.3f}' for one in found.levels)} m",
              flush=True)
    cases = Cases(scenario)
    rows = (cases.row(number) for number in range(RUNS))
    seen = rate(sum(not row.metrics.get("lateral_m", math.inf) < SEEN for row in rows), RUNS)
    print(f"a campaign of {RUNS} runs, lateral_m >= {SEEN} m: {seen.value:.3g}, 95 % interval {seen.low:.2g} to "
          f"{seen.high:.2g}")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    linear(numbers[0] if numbers else 200)
    if "--lander" in sys.argv:
        lander()
