"""flight design: parameters that keep a promise, with the argument for them."""

import importlib
import json
import os
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import add, console, next_command, number, working
from flight_graph.errors import FlightError

START = (-0.3, 0.3, 0.3)  # [rad] section 5 of the paper
DESIGNS = {"cubli": "cubli_ros.design_file"}  # vehicle -> module with design, facts, parameter_file, SCENARIO


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight design cubli --gravity 8e-5 --disturbance 8e-4 --out bennu.yaml && "
                       "flight run cubli_asteroid --params bennu.yaml --duration 240")(design)


def design(
    vehicle: Annotated[str, typer.Argument(help="cubli.")],
    gravity: Annotated[float, typer.Option(help="Surface gravity [m/s^2].")],
    tilt: Annotated[float, typer.Option(help="Angle between up and the ground's normal [rad].")] = 0.0,
    friction: Annotated[float, typer.Option(help="Friction coefficient of the ground.")] = 0.5,
    disturbance: Annotated[float, typer.Option(help="Disturbing acceleration d of each axis [rad/s^2].")] = 0.0,
    frequency: Annotated[float, typer.Option(help="Its frequency [rad/s].")] = 1.0,
    phasing: Annotated[str, typer.Option(help="Of its axes: equal, or 120 degrees apart.")] = "equal",
    rule: Annotated[str, typer.Option(help="A (rate limit), B (critically damped reference) or best.")] = "best",
    model: Annotated[str, typer.Option(help="Inertia: physical (about the corner) or paper (m l^2 / 6).")] = "physical",
    start: Annotated[tuple[float, float, float], typer.Option(help="Cardan angles at the start [rad].")] = START,
    gyro_noise: Annotated[float, typer.Option(help="White noise of a rate sample [rad/s].")] = 1.0e-4,
    out: Annotated[Path | None, typer.Option(help="Write the parameter file here (a new one).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print a parameter file whose funnels keep the vehicle on the ground, with the argument and the margins.

    The file is for flight run --params and for --params-file of ROS nodes.
    """
    if vehicle not in DESIGNS:
        raise FlightError(f"there is no design rule for '{vehicle}'; allowed: {', '.join(DESIGNS)}")
    rules = importlib.import_module(DESIGNS[vehicle])
    if out is not None and os.path.lexists(out):
        raise FlightError(f"--out {out}: it exists already; name a new file")
    site = rules.Site(gravity, tilt, friction, disturbance, phasing, frequency)
    rover = rules.Rover(start=start, gyro_sigma=gyro_noise, model=model)
    with working(f"designing {vehicle}", not as_json):
        made = rules.design(rule, site, rover)
    text = rules.parameter_file(made, site, rover)
    if out is not None:
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
            out.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            raise FlightError(f"--out {out}: it cannot be written ({(error.strerror or str(error)).lower()})") from None
    if as_json:
        print(json.dumps({
            "rule": made.rule, "parameters": made.parameters, "rate_hz": made.rate_hz,
            "minimum_rate_hz": made.minimum_rate_hz, "settling_s": made.settling_s, "margins": made.margins,
            "argument": made.argument, "warnings": made.warnings, "file": str(out) if out else None}))
        return
    if out is None:
        print(text, end="")
        return
    from rich.table import Table
    table = Table("what", "value", title=f"rule {made.rule}", title_justify="left")
    for name, value in rules.facts(made).items():
        add(table, name, number(value))
    console.print(table)
    for sentence in made.argument:
        console.print(sentence, markup=False)
    for sentence in made.warnings:
        console.print(f"warning: {sentence}", markup=False, style="yellow")
    print(out, flush=True)
    next_command("run", rules.SCENARIO, "--params", out)
