"""The catalogues of faults of all vehicles: how many were found, how the runs ended: a Markdown table (the README's).

    python benchmarks/fault_catalogues.py [SCENARIO ...] [--runs K] [--jobs 2]
"""

import argparse
import tempfile
from collections import Counter

from flight_graph.campaigns.fault_table import fault_rows
from flight_graph.campaigns.opening import run_here
from flight_graph.cli.show import number, steps
from flight_graph.graphs.scenario import load

CATALOGUES = ("cubli_faults", "spacerobot_faults", "lander_faults")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenario", nargs="*", default=CATALOGUES)
    options.add_argument("--runs", type=int, help="in all; as the scenario says when left out")
    options.add_argument("--jobs", type=int, default=2)
    chosen = options.parse_args()
    columns = ("scenario", "faults", "runs with a fault", "found", "right unit", "wrong unit", "false alarms",
               "delay, median [s]", "safe at the end", "modes at the end")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for name in chosen.scenario:
        print(line(name, chosen.runs, chosen.jobs))


def line(name, runs, jobs) -> str:
    """The line of one catalogue."""
    with steps(name, True) as advance, tempfile.TemporaryDirectory() as folder:
        campaign = run_here(load(name), folder, runs, jobs, progress=lambda done, total: advance(done, total, "runs"))
        rows = list(campaign.rows())
    found = fault_rows(rows)
    active = [row for row in rows if row.metrics.get("fault_onset_s") is not None]
    delays = sorted(row.metrics["fault_detection_delay_s"] for row in active if row.metrics["fault_detected"])
    safe = [row.metrics["is_safe"] for row in active if "is_safe" in row.metrics]
    modes = Counter(row.metrics.get("final_mode") or row.status for row in active)
    return (f"| `{name}` | {sum(row.active > 0 for row in found)} | {len(active)} | {sum(row.detected for row in found)} | "
            f"{sum(row.isolated for row in found)} | {sum(row.wrong for row in found)} | "
            f"{sum(row.false_alarms for row in found)} | {number(delays[len(delays) // 2])} | "
            f"{f'{sum(safe)} of {len(safe)}' if safe else '-'} | "
            f"{', '.join(f'{mode} {count}' for mode, count in modes.most_common())} |")


if __name__ == "__main__":
    main()
