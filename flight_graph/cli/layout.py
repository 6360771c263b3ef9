"""flight layout: a vehicle's picture and plots arranged for a viewer, every number under its name."""

from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError, unknown

VIEWERS = ("foxglove", "lichtblick", "plotjuggler", "rviz", "rerun")


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight layout cubli_asteroid --for plotjuggler --out cubli_asteroid.xml")(layout)


def layout(
    scenario: Annotated[str, typer.Argument(help="A scenario's name, or the path of a YAML file.")],
    viewer: Annotated[str, typer.Option("--for", metavar="VIEWER", help=", ".join(VIEWERS) + ".")] = "foxglove",
    out: Annotated[Path | None, typer.Option(help="A new file; standard output when left out.")] = None,
    trust: Trust = False,
) -> None:
    """Write a layout in which every named number has its name, to be imported by a viewer.

    JSON for Foxglove and Lichtblick, XML for PlotJuggler, a configuration for rviz, a blueprint (.rbl) for Rerun. Those of
    the vehicles are installed under share/PACKAGE/config.
    """
    from flight_graph.graphs.scenario import load
    if viewer not in VIEWERS:
        raise unknown("viewer", viewer, VIEWERS, "--for")
    if viewer == "rerun" and out is None:
        raise FlightError("--for rerun: a blueprint is no text; --out FILE.rbl says where it goes")
    loaded = load(scenario, consent=asked(trust))
    content = _blueprint(loaded) if viewer == "rerun" else text_of(loaded, viewer)
    if out is None:
        print(content, end="")
        return
    try:
        with out.open("xb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
    except OSError as error:
        raise FlightError(f"--out {out}: cannot be written ({(error.strerror or str(error)).lower()})") from None
    print(out)


def text_of(scenario, viewer: str) -> str:
    """The layout of a scenario for one of the viewers that read text."""
    from flight_graph.viewers.foxglove_layout import foxglove_layout
    from flight_graph.viewers.plotjuggler_layout import plotjuggler_layout
    from flight_graph.viewers.rviz_layout import rviz_layout
    from flight_graph.viewers.vehicle import vehicle_of
    made = {"foxglove": foxglove_layout, "lichtblick": foxglove_layout, "plotjuggler": plotjuggler_layout,
            "rviz": rviz_layout}
    return made[viewer](vehicle_of(scenario))


def _blueprint(scenario) -> bytes:
    from flight_graph.viewers.rerun_stream import blueprint_file
    from flight_graph.viewers.vehicle import vehicle_of
    return blueprint_file(vehicle_of(scenario))
