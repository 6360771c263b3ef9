"""flight identify: which parameters of a robot a motion makes visible."""

import importlib
import json
from typing import Annotated

import typer

from flight_graph.cli.show import console, working
from flight_graph.cli.trust import Trust, asked

REPORTS = "spacerobot_ros.identifiability_report"  # the module that knows robots


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight identify spacerobot --trajectory spacerobot_harmonic --json")(identify)


def identify(
    robot: Annotated[str, typer.Argument(help="spacerobot, or a robot model as YAML or URDF file.")],
    trajectory: Annotated[str, typer.Option(help="A scenario whose desired motion is taken, or random.")] = "random",
    rows: Annotated[str, typer.Option(help="all (with forces), moments (without), joints (torques).")] = "moments",
    cut: Annotated[float, typer.Option(help="Singular values below this part of the largest count as zero.")] = 1e-10,
    settings: Annotated[list[str] | None, typer.Option(
        "--set", metavar="COMPONENT.PARAM=VALUE", help="Change a parameter of the scenario; may be repeated.")] = None,
    trust: Trust = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")] = False,
) -> None:
    """Rank, singular values, and which parameters are identifiable, on their own or in which combinations."""
    from flight_graph.graphs.overrides import parse_settings
    from flight_graph.graphs.scenario import load
    scenario = None if trajectory == "random" else load(trajectory, parse_settings(settings), consent=asked(trust))
    reports = importlib.import_module(REPORTS)
    with working(f"parameters of {robot}", not as_json):
        found = reports.report(reports.robot_named(robot), scenario, rows, cut)
    alone = [name for name, single in zip(found.names, found.individual) if single]
    if as_json:
        print(json.dumps({
            "robot": robot, "trajectory": trajectory, "rows": rows, "parameters": len(found.names), "rank": found.rank,
            "singular_values": found.singular_values.tolist(), "individual": alone,
            "null_component": dict(zip(found.names, found.null_component.tolist())),
            "combinations": found.sentences()}))
        return
    largest = found.singular_values[0] or 1.0
    console.print(f"{found.rank} of {len(found.names)} directions are visible on {trajectory} (rows: {rows})")
    console.print(f"on their own: {', '.join(alone) or 'none'}")
    console.print("singular values over the largest: " + ", ".join(
        f"{value / largest:.3g}" for value in found.singular_values[:found.rank]))
    console.print("what is visible, each line one combination:")
    for sentence in found.sentences():
        console.print(f"  {sentence}", highlight=False)
