"""The landings of docs/lander.md, scenario by scenario: when and how well each touches down, and how near to its limits.

    python benchmarks/lander_scenarios.py
"""

import argparse

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate

NAMES = ("lander_nominal", "lander_estimated", "lander_bennu", "lander_bennu_polyhedral", "lander_stress_descent",
         "lander_stress_view", "lander_gravity_error", "lander_unconstrained", "lander_pd")
SHOWN = {"touchdown_time_s": "t [s]", "lateral_m": "lateral [m]", "attitude_deg": "attitude [deg]",
         "clearance_min_m": "least clearance, r > 20 m [m]", "los_max_deg": "line of sight, r > 5 m [deg]",
         "delta_v_mps": "delta-v [m/s]"}


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    table = Table("scenario", *map(escape, SHOWN.values()), title="landings, compiled engine", title_justify="left")
    for name in NAMES:
        scenario = load(name)
        found = metrics.compute(scenario, simulate(scenario))
        table.add_row(name, *("none" if found[key] is None else f"{found[key]:.5g}" for key in SHOWN))
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
