"""flight demo: the main job in one command."""

import importlib.util
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import RunProgress, console, metrics_table, report_next, status, warn_of
from flight_graph.cli.trust import Trust, asked


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight demo cubli_asteroid")(demo)


def demo(
    scenario: Annotated[str, typer.Argument(help="The scenario to show.")] = "cubli_asteroid",
    duration: Annotated[float | None, typer.Option(help="Simulated seconds.")] = None,
    trust: Trust = False,
) -> None:
    """Run a scenario as ROS 2 nodes in lockstep, record it, judge the claims that it can, and draw its figure."""
    from flight_graph import runs
    from flight_graph.claims import claims
    from flight_graph.cli.claims import table
    from flight_graph.graphs.scenario import load
    from flight_graph.recordings.figure import draw_overview
    from flight_graph.recordings.recording import open_run
    loaded = load(scenario, {} if duration is None else {"duration_s": duration}, consent=asked(trust))
    engine = "ros" if importlib.util.find_spec("rclpy") else "compiled"
    if engine == "compiled":
        status("rclpy is not installed here: running in the compiled engine (the bag's messages are the same)")
    status(f"{loaded.file.title}: {loaded.duration_ns / 1e9:g} s in the {engine} engine")
    with RunProgress(loaded, True) as progress:
        outcome = runs.execute(loaded, engine, "lockstep", None, progress.advance, progress.compiling)
    console.print(metrics_table(loaded, outcome))
    if loaded.file.paper:
        console.print(table(claims.read(loaded.file.paper),
                            claims.judge_run(loaded.file.paper, loaded.name, outcome.metrics)))
    _, _, signals = open_run(outcome.bag, trust=True)  # what has just run
    figure = draw_overview(loaded, signals, Path(f"{outcome.bag}.png"))
    print(f"bag:    {outcome.bag}\nfigure: {figure}", flush=True)
    warn_of(outcome.alarms)
    report_next(outcome.bag)
