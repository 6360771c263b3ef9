"""flight design: parameters that keep a promise, with the argument for them."""

import json
from pathlib import Path
from typing import Annotated

import typer
import yaml

from flight_graph.cli.show import add, console, number
from flight_graph.errors import FlightError

START = (-0.3, 0.3, 0.3)  # [rad] section 5 of the paper
DESIGNS = {"cubli": "the Cubli rover on the ground of a small body (Aerospace 2022, 9(11), 728)"}


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
    from cubli_ros import design as rules
    from cubli_ros.design_site import Rover, Site
    if out is not None and out.exists():
        raise FlightError(f"--out {out}: it exists already; name a new file")
    site = Site(gravity, tilt, friction, disturbance, phasing, frequency)
    rover = Rover(start=start, gyro_sigma=gyro_noise, model=model)
    made = rules.design(rule, site, rover)
    text = parameter_file(made, site, rover)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
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
    for name, value in _facts(made).items():
        add(table, name, number(value))
    console.print(table)
    for sentence in made.argument:
        console.print(sentence, markup=False)
    for sentence in made.warnings:
        console.print(f"warning: {sentence}", markup=False, style="yellow")
    print(out)


def parameter_file(made, site, rover) -> str:
    """The design as a ROS parameter file, with the argument as its comments."""
    from cubli_ros.design_site import PHASINGS
    lines = [f"# Cubli rover, design rule {made.rule}: g = {site.gravity:g} m/s^2, ground tilt {site.tilt:g} rad, "
             f"friction {site.friction:g},", f"# disturbance {site.disturbance:g} rad/s^2 at {site.frequency:g} rad/s, "
             f"axes {site.phasing}, {rover.model} inertia."]
    lines += [f"# {sentence}" for sentence in made.argument]
    lines += [f"# {name}: {value:.4g}" for name, value in _facts(made).items()]
    lines += [f"# WARNING: {sentence}" for sentence in made.warnings]
    controller = {"rate_hz": made.rate_hz, **made.parameters}
    inertia = made.parameters["inertia"]
    monitor = {"gravity": float(site.gravity), "friction": float(site.friction), "tilt": float(site.tilt),
               "inertia": inertia}
    truth = {"gravity": float(site.gravity), "initial_angles": [float(angle) for angle in rover.start],
             "disturbance_amplitude": [float(site.disturbance)] * 3, "disturbance_frequency": float(site.frequency),
             "disturbance_phase": list(PHASINGS[site.phasing])}
    ground = {"friction": float(site.friction), "tilt": float(site.tilt)}
    sections = {"/**/controller": controller, "/**/appc_controller": controller, "/**/monitor": monitor,
                "/**/jump_monitor": monitor, "/**/plant": truth, "/**/cubli_physical_plant": ground}
    for name, values in sections.items():
        if name == "/**/plant":
            lines.append("# the case that the design is for, as a simulation has it")
        lines.append(yaml.dump({name: {"ros__parameters": values}}, Dumper=_Dumper, sort_keys=False,
                               default_flow_style=None, width=110).rstrip())
    return "\n".join(lines) + "\n"


class _Dumper(yaml.SafeDumper):
    """Without anchors, which the readers of ROS parameter files do not know."""

    def ignore_aliases(self, data):
        return True


def _facts(made):
    return {"control rate [Hz]": made.rate_hz, "minimum control rate [Hz]": made.minimum_rate_hz,
            "expected settling [s]": made.settling_s, **made.margins}
