"""The whole Monte Carlo of the landing: how many of the runs succeed, how far from the limits, and how long it takes.

    python benchmarks/lander_monte_carlo.py [--fresh N] [--jobs N]

Four batches: 200 starts with perfect model and navigation, the same 200 perturbed, and --fresh (100) starts of each
kind with seeds that no choice of gains or trigger has seen (70001 on).
"""

import argparse
import tempfile
import time
from importlib import resources
from pathlib import Path

import yaml

from flight_graph.campaigns.opening import run_here
from flight_graph.graphs.scenario import Scenario

FRESH_SEED = 70001
SHOWN = {"lateral_m": max, "speed_mps": max, "attitude_deg": max, "los_max_deg": max, "clearance_min_m": min,
         "saturated_s": max}


def batch(name: str, first_seed: int | None, runs: int, jobs: int | None) -> dict:
    """Run one batch; returns its counts, extremes and wall time."""
    data = yaml.safe_load((resources.files("scenarios") / f"{name}.yaml").read_text(encoding="utf-8"))
    if first_seed is not None:
        data["vary"]["seed"] = first_seed
        data["vary"]["random"]["plant.draw_seed"] = {"count": first_seed}
        if "seed" in data["vary"]["random"]:
            data["vary"]["random"]["seed"] = {"count": first_seed}
    scenario = Scenario(data, name)
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        rows = list(run_here(scenario, Path(folder) / "sweep", runs, jobs).rows())
        wall = time.perf_counter() - began
    good = [row.metrics for row in rows if row.status == "ok"]
    flown = sum(row["touchdown_time_s"] or scenario.duration_ns / 1e9 for row in good)
    return {"success": sum(row["success"] for row in good), "runs": len(rows), "wall_s": wall, "flown_s": flown,
            **{name: pick(row[name] for row in good) for name, pick in SHOWN.items()}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fresh", type=int, default=100, help="starts with fresh seeds, of each kind")
    parser.add_argument("--jobs", type=int, default=None, help="threads; one a core when left out")
    options = parser.parse_args()
    print(f"{'batch':32s} {'success':>9s} {'wall [s]':>9s} {'landing/s':>10s}  extremes")
    for seed, runs in ((None, 200), (FRESH_SEED, options.fresh)):
        for name in ("lander_monte_carlo", "lander_monte_carlo_perturbed"):
            found = batch(name, seed, runs, options.jobs)
            label = name.removeprefix("lander_") + ("" if seed is None else f", seeds {seed} on")
            extremes = ", ".join(f"{key} {found[key]:.3g}" for key in SHOWN)
            print(f"{label:32s} {found['success']:4d}/{found['runs']:<4d} {found['wall_s']:9.1f} "
                  f"{found['flown_s'] / found['wall_s']:10.0f}  {extremes}")


if __name__ == "__main__":
    main()
