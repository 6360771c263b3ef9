"""Runs side by side beside runs one by one: CPU time of a step of a run, in one run of this script.

    python benchmarks/lanes.py [--runs 16] [--rounds 5] [SCENARIO ...]

The best of several rounds, in turn; with all topics that a scenario records, and with none (as campaigns whose metrics read
little). All bytes of all logs are compared, and how long the machine code took to make is said.
"""

import argparse
import math
import os
import time

from rich.console import Console
from rich.table import Table

from flight_graph.engines import driver
from flight_graph.engines.addresses import address
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.lanes.batch import SideBySide

LONGEST = 20_000  # [ticks] of a run here


def angles(number):
    """Cardan angles [rad] of a start of the rover."""
    return {"plant.initial_angles": [0.3 * math.cos(1.0 + 0.37 * number * axis) for axis in (1, 2, 3)]}


VARIED = {"cubli_asteroid_paper": angles, "cubli_asteroid": angles,
          "lander_nominal": lambda number: {"plant.draw_seed": 20201 + number, "plant.contact_height": 0.1}}


class Bench:
    """Some runs of a scenario, flown in both ways."""

    def __init__(self, name: str, count: int, with_logs: bool):
        scenarios = [load(name, {**VARIED[name](number), "seed": 1 + number}) for number in range(count)]
        self._runs = [CompiledRun(scenario, plan=None if with_logs else {}) for scenario in scenarios]
        self._together = SideBySide()
        ticks = -(-scenarios[0].duration_ns // self._runs[0].graph.base_ns)
        self.ticks, self.steps = min(LONGEST, ticks), min(LONGEST, ticks) * count
        began = time.perf_counter()
        self._together.advance(self.flights(), 1)
        self.compile_s = time.perf_counter() - began
        self.sentence = self._together.report.sentence()

    def flights(self):
        flights = [run.start(self.ticks) for run in self._runs]
        for flight in flights:
            for name, array in flight.arrays.items():
                if name.startswith("L_"):
                    array[:] = array[:1]  # memory that the system has given already
        return flights

    def one_by_one(self, flights) -> float:
        """CPU time [s]."""
        run, began = driver.CODE.function("run"), time.thread_time()
        for flight in flights:
            flight.control["end"] = self.ticks
            run(address(flight.control))
        return time.thread_time() - began

    def side_by_side(self, flights) -> float:
        """CPU time [s]."""
        began = time.thread_time()
        self._together.advance(flights, self.ticks)
        return time.thread_time() - began

    def differing(self, flights, others) -> tuple[int, int]:
        """Bytes that were compared, and bytes that differ."""
        compared = wrong = 0
        for flight, other in zip(flights, others):
            for name, array in flight.arrays.items():
                if name[:2] != "C_":
                    mine, theirs = array.view("u1"), other.arrays[name].view("u1")
                    compared, wrong = compared + mine.size, wrong + int((mine != theirs).sum())
        return compared, wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=list(VARIED), metavar="SCENARIO", help=", ".join(VARIED))
    parser.add_argument("--runs", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    table = Table("scenario", "logs", "one by one [ns]", "side by side [ns]", "ratio", "bytes compared", "differ",
                  "compiled [s]")
    for name in given.scenarios:
        for with_logs in (True, False):
            bench, alone, together = Bench(name, given.runs, with_logs), math.inf, math.inf
            for _ in range(given.rounds):
                flights, others = bench.flights(), bench.flights()
                alone = min(alone, bench.one_by_one(flights))
                together = min(together, bench.side_by_side(others))
            compared, wrong = bench.differing(flights, others)
            table.add_row(name, "all topics" if with_logs else "none", f"{1e9 * alone / bench.steps:.0f}",
                          f"{1e9 * together / bench.steps:.0f}", f"{alone / together:.2f}", str(compared), str(wrong),
                          f"{bench.compile_s:.1f}")
    Console(width=140).print(table, f"{bench.sentence}; load of the machine {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
