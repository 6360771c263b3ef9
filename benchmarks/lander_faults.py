"""The catalogue of lander_faults, with and without what docs/faults_lander.md describes: how the runs of each unit end.

    python benchmarks/lander_faults.py [--runs K]

Without: the same descent and the same faults on the plain navigation filter, the law straight on the thrusters, and no
monitors. Faults of the mode manager have no counterpart there.
"""

import argparse
from collections import Counter
from statistics import median

from rich.console import Console
from rich.table import Table

from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load, vary_case
from flight_graph.runs import simulate
from sim_nodes.lander.safe_end import named

LOST = ("hit", "below", "stopped")


def unprotected(scenario) -> Scenario:
    """The same run without tests of sensors, modes and monitors. Raises FlightError where its fault has no place there."""
    data = scenario.file.model_dump(by_alias=True, exclude_none=True)
    data["components"].pop("modes")
    data["components"]["navigation"]["use"] = "lander_ros/navigation"
    data["connect"] = {"navigation.gravity": {"from": "gravity.gravity", "delay": 1}}
    for key in ("monitors", "vary", "metrics"):
        data.pop(key, None)
    return Scenario(data, scenario.origin, scenario.folder)


def end_of(scenario) -> str:
    """How a run ends; descending: under way to its site, or to the ground."""
    try:
        recording = simulate(scenario)
    except FlightError:
        return "stopped"
    return named(recording["lander/truth/summary"][-1], recording["lander/truth"][-1])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=2, help="seeds")
    runs = options.parse_args().runs
    suite, found = load("lander_faults"), {}
    for case in range(len(suite.vary.combinations) * runs):
        scenario = vary_case(suite, case)
        unit = scenario.faults.faults[0].unit if suite.vary.name(case) != "none" else "none"
        row = found.setdefault(unit, {"with": [], "without": Counter()})
        row["with"].append(metrics.compute(scenario, simulate(scenario)))
        if unit != "modes":
            row["without"][end_of(unprotected(scenario))] += 1
    table = Table("unit that fails", "runs", "detected", "unit named", "false alarms", "delay [s]", "mode at the end",
                  "ends", "lost", "without: ends", "lost", title="lander_faults", title_justify="left")
    total = Counter()
    for unit, row in found.items():
        of = row["with"]
        delays = [one["fault_detection_delay_s"] for one in of if one.get("fault_detected")]
        counts = {"runs": len(of), "detected": len(delays), "named": sum(one.get("fault_isolated") is True for one in of),
                  "alarms": sum(one["false_alarms"] > 0 for one in of), "lost": sum(not one["is_safe"] for one in of),
                  "without": sum(row["without"][end] for end in LOST), "compared": row["without"].total()}
        total.update(counts if unit != "none" else {})
        table.add_row(unit, str(counts["runs"]), str(counts["detected"]), str(counts["named"]), str(counts["alarms"]),
                      f"{median(delays):.1f}" if delays else "", _words(Counter(one["final_mode"] for one in of)),
                      _words(Counter(one["end"] for one in of)), str(counts["lost"]), _words(row["without"]),
                      f"{counts['without']} of {counts['compared']}")
    counted = (str(total[key]) for key in ("runs", "detected", "named", "alarms"))
    table.add_row("all", *counted, "", "", "", str(total["lost"]), "", f"{total['without']} of {total['compared']}")
    Console(width=170).print(table)


def _words(counts) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())


if __name__ == "__main__":
    main()
