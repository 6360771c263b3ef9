"""flight urdf: the model of a scenario's vehicle, for tools that take a file."""

from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight urdf cubli_asteroid --set plant.mass=3 --out rover.urdf")(urdf)


def urdf(
    scenario: Annotated[str, typer.Argument(help="A scenario's name, the path of a YAML file, or the bag of a run.")],
    settings: Annotated[list[str] | None, typer.Option(
        "--set", metavar="COMPONENT.PARAM=VALUE", help="Change a parameter of the scenario; may be repeated.")] = None,
    vehicle: Annotated[str | None, typer.Option(help="Of a graph of several, the one that is written: rover_a.")] = None,
    out: Annotated[Path | None, typer.Option(help="A new file; standard output when left out.")] = None,
    trust: Trust = False,
) -> None:
    """Write the vehicle of a scenario or a bag as URDF: masses, inertias, joints and shapes from its parameters.

    Runs publish and record the same text on /robot_description, latched, with /joint_states, /tf and /tf_static.
    """
    from flight_graph.scenes.urdf import urdf as text_of
    scene = _scene(scenario, settings, vehicle, asked(trust))
    if others := [body.frame for body in scene.bodies if body.frame not in scene.links]:
        raise FlightError(f"{scenario}: it has several vehicles ({scene.base}, {others[0]}), and a URDF file is of one; "
                          f"--vehicle names it: --vehicle {scene.base.partition('/')[0]}")
    text = text_of(scene)
    if out is None:
        print(text, end="")
        return
    try:
        with out.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except OSError as error:
        raise FlightError(f"--out {out}: cannot be written ({(error.strerror or str(error)).lower()})") from None
    print(out)


def _scene(scenario, settings, vehicle, consent):
    """The scene of a scenario, of a bag, or of a vehicle of either."""
    from flight_graph.graphs import vehicles
    from flight_graph.graphs.overrides import parse_settings
    from flight_graph.graphs.scenario import load
    from flight_graph.scenes.finding import scene_of, scene_of_bag
    path = Path(scenario)
    if path.is_dir() or path.suffix in (".mcap", ".db3"):
        from flight_graph.bags.reader import read_bag
        if settings:
            raise FlightError("--set is of a scenario; a bag has the parameters that it was recorded with")
        return scene_of_bag(read_bag(path), consent, vehicle)
    loaded = load(scenario, parse_settings(settings or []), consent=consent)
    return scene_of(vehicles.named(loaded, vehicle) if vehicle else loaded)
