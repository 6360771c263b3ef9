"""flight sweep: many runs of a scenario, one row of a table for each."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Json, Params, Settings, overrides
from flight_graph.cli.show import add, console, number, steps
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

SHOWN_FAILURES = 5


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight sweep my_scenario.yaml --runs 1000 --jobs 2 --out sweeps/first")(sweep)


def sweep(
    scenario: Annotated[str, typer.Argument(help="A scenario's name, or a YAML file, with a 'vary' block.")],
    runs: Annotated[int | None, typer.Option(help="Runs in all; as the scenario says when left out.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; one a core when left out.")] = None,
    settings: Settings = None,
    params: Params = None,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds of each run.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the table (a new one, except with --resume).")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the sweep in --out.")] = False,
    figure: Annotated[Path | None, typer.Option(
        help="Draw the table of faults and monitors into this PNG (of a scenario that has them).")] = None,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """Run all cases of a scenario's 'vary' block; one row of a parquet table for each run.

    Any row is run again to a full bag, bit for bit the same, by its number: flight run SCENARIO --case K.
    """
    from flight_graph import runs as one_run
    from flight_graph.bags.errors import quoted
    from flight_graph.graphs import scenario as scenarios
    from flight_graph.sweeps import sweep as sweeps
    from flight_graph.sweeps.fault_table import draw, fault_rows
    consent = asked(trust)
    given = overrides(scenario, settings, params, None, duration, consent)
    prepared = sweeps.Sweep(scenarios.load(scenario, given, consent=consent), given)
    prepared.cases(runs)
    if resume and out is None:
        raise FlightError("--resume: name the sweep's folder with --out")
    folder = out if resume else one_run.new_folder(out, prepared.scenario, "sweep")
    began = time.perf_counter()
    with steps(f"sweep of {prepared.scenario.name}", not as_json) as advance:
        try:
            rows = sweeps.run_sweep(prepared, folder, runs, jobs, resume,
                                    lambda done, total: advance(done, total, "runs"))
        except KeyboardInterrupt:
            kept = (f"the runs up to here are in {folder / sweeps.TABLE}" if (folder / sweeps.TABLE).exists()
                    else "no run had ended")
            raise FlightError(f"interrupted; {kept}; continue with --resume --out {quoted(folder)}") from None
    wall_s = time.perf_counter() - began
    failed = [row for row in rows if row.status != "ok"]
    found, faults = statistics(rows), fault_rows(rows)
    if figure is not None:
        if not faults:
            raise FlightError(f"--figure {figure}: {prepared.scenario.name} has no monitors, so there is no such table")
        draw(faults, figure)
    if as_json:
        print(json.dumps({
            "scenario": prepared.scenario.name, "table": str(folder / sweeps.TABLE), "runs": len(rows),
            "ok": len(rows) - len(failed), "wall_s": wall_s, "metrics": found,
            "faults": [row.plain() for row in faults],
            "failed": [{"case": row.case, "status": row.status, "sentence": row.sentence} for row in failed]}))
        return
    console.print(_table(prepared.scenario.name, found, len(rows), wall_s))
    if faults:
        console.print(_fault_table(faults))
    for row in failed[:SHOWN_FAILURES]:
        console.print(f"case {row.case} ({row.status}): {row.sentence}", markup=False)
    if failed:
        console.print(f"{len(failed)} of {len(rows)} runs did not end well; the table's column 'sentence' says why")
    print(folder / sweeps.TABLE)
    if figure is not None:
        print(figure)


def _fault_table(rows):
    from rich.table import Table
    table = Table("fault", "runs", "active", "detected", "missed", "isolated", "wrong", "false alarm", "delay [s]",
                  "first to act", "mode at the end", "stopped", title="faults and monitors", title_justify="left")
    for row in rows:
        plain = row.plain()
        add(table, row.name, row.runs, row.active, row.detected, row.missed, row.isolated, row.wrong, row.false_alarms,
            number(plain["median_delay_s"]), _counted(row.by), _counted(row.modes), row.stopped or "")
    return table


def _counted(counter) -> str:
    return ", ".join(f"{name} {count}" for name, count in counter.most_common())


def statistics(rows) -> dict:
    """Of each metric: least, median and largest value, the cases of the ends, and in how many runs it has none."""
    found = {}
    good = [row for row in rows if row.status == "ok"]
    for name in dict.fromkeys(name for row in good for name in row.metrics):
        values = [(row.metrics.get(name), row.case) for row in good]
        numbers = sorted((float(value), case) for value, case in values if isinstance(value, (int, float)))
        if numbers:
            middle = len(numbers) // 2
            median = numbers[middle][0] if len(numbers) % 2 else 0.5 * (numbers[middle - 1][0] + numbers[middle][0])
            found[name] = {"least": numbers[0][0], "least_case": numbers[0][1], "median": median,
                           "largest": numbers[-1][0], "largest_case": numbers[-1][1],
                           "without": len(values) - len(numbers)}
        else:
            found[name] = {"without": len(values)}
    return found


def _table(name, found, runs, wall_s):
    from rich.table import Table
    table = Table("metric", "least", "case", "median", "largest", "case", "never in",
                  title=f"{name}: {runs} runs in {wall_s:.3g} s", title_justify="left")
    for metric, row in found.items():
        cells = [number(row[key]) if key in row else "-"
                 for key in ("least", "least_case", "median", "largest", "largest_case")]
        add(table, metric, *cells, row["without"] or "")
    return table
