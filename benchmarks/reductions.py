"""What it saves to take measures while runs fly: CPU time and memory of a run of a campaign, beside the same from logs.

    python benchmarks/reductions.py [--runs 96] [--repeats 3]

The rover's campaign (cubli_asteroid, 100 Hz, drawn mass, angles and seeds) with six measures of three topics, 60 s and
600 s. The numbers are the same in both ways, which this compares; CPU time is counted, in one thread, both ways in turn.
"""

import argparse
import statistics
import time
from pathlib import Path

MEASURES = {
    "rate_peak": {"largest": "plant.truth.rates", "of": "norm"},
    "settled": {"settling": "plant.truth.angles", "within": 0.008},
    "tilted": {"first": "plant.truth.angles", "above": 0.3}, "last": {"final": "plant.truth.angles", "of": "absolute"},
    "effort": {"integral": "controller.command.effort", "of": "squared"},
    "doubt": {"largest": "estimator.filter.innovation_squared"}}
VARY = ["plant.mass=normal:2,0.04", "plant.initial_angles=uniform:-0.3,0.3", "seed=count:1"]


def from_logs(scenario, signals) -> dict:
    """The measures as a metrics function that reads logs."""
    from flight_graph.graphs import measures
    return measures.compute(measures.read(MEASURES, scenario.graph.nodes, "measures"), scenario, signals)


def cases(in_loop: bool, seconds: float, runs: int):
    """The campaign's cases, with its machine code at hand."""
    from flight_graph.campaigns.cases import Batch, Cases
    from flight_graph.campaigns.opening import varied
    from flight_graph.components.foreign import agree
    from flight_graph.lanes.batch import SideBySide
    from flight_graph.lanes.operations import LANES
    from flight_graph.sampling.specifications import Besides
    judged = {"measures": MEASURES} if in_loop else {"metrics": f"{Path(__file__).resolve()}:from_logs"}
    scenario = varied("cubli_asteroid", {"duration_s": seconds, "metrics": None, "measures": None, **judged},
                      Besides(tuple(VARY), 1), agree)
    made = Cases(scenario, Batch(LANES, SideBySide().advance))
    made.rows(range(1 + LANES))
    return made


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=96)
    options.add_argument("--repeats", type=int, default=3)
    chosen = options.parse_args()
    for seconds in (60.0, 600.0):
        ways = {"log": cases(False, seconds, chosen.runs), "loop": cases(True, seconds, chosen.runs)}
        spent, rows = {way: [] for way in ways}, {}
        for _ in range(chosen.repeats):
            for way, made in ways.items():
                began = time.process_time()
                rows[way] = made.rows(range(chosen.runs))
                spent[way].append((time.process_time() - began) / chosen.runs)
        if [row.metrics for row in rows["log"]] != [row.metrics for row in rows["loop"]]:
            raise SystemExit("the two ways give different numbers")
        kept = {way: next(iter(made._prepared.values()))._run.schedule.log_bytes(int(100 * seconds)) for way, made in
                ways.items()}
        ms = {way: 1e3 * statistics.median(found) for way, found in spent.items()}
        print(f"cubli_asteroid, {seconds:g} s, {chosen.runs} runs, six measures: from logs {ms['log']:.2f} ms of CPU a run "
              f"and {kept['log'] / 1e6:.2f} MB of log, in the loop {ms['loop']:.2f} ms and {kept['loop'] / 1e6:.2f} MB: "
              f"{ms['log'] / ms['loop']:.2f} times faster")


if __name__ == "__main__":
    main()
