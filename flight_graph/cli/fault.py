"""flight fault: faults injected into a graph that runs as nodes."""

import json
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Json
from flight_graph.cli.show import add, console
from flight_graph.errors import FlightError


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight fault imu.imu.angular_velocity[2] bias 0.01 --for 5")(fault)


def fault(
    place: Annotated[str | None, typer.Argument(
        help="Where, as in a scenario's faults: 'plant <- command.effort[2]'.")] = None,
    kind: Annotated[str | None, typer.Argument(help="What happens there: bias, drop, hang, ...")] = None,
    value: Annotated[float | None, typer.Argument(help="The size, where the kind has one.")] = None,
    for_s: Annotated[float | None, typer.Option("--for", help="How long it lasts [s]; to the end when left out.")] = None,
    probability: Annotated[float | None, typer.Option(help="Of each firing.")] = None,
    ramp_s: Annotated[float | None, typer.Option("--ramp", help="Bias, scale: grows within this time [s].")] = None,
    bit: Annotated[int | None, typer.Option(help="Bit flip: number of the bit.")] = None,
    ticks: Annotated[int | None, typer.Option(help="Delay: by how many firings.")] = None,
    every: Annotated[int | None, typer.Option(help="Drop, duplicate: every so manieth message.")] = None,
    every_s: Annotated[float | None, typer.Option("--every-s", help="Again and again, with this period [s].")] = None,
    unit: Annotated[str | None, typer.Option(help="The unit that fails, for scores.")] = None,
    clear: Annotated[str | None, typer.Option(help="End the injected fault with this id.")] = None,
    listed: Annotated[bool, typer.Option("--list", help="Show what has been injected.")] = False,
    namespace: Annotated[str, typer.Option(help="Of the graph's nodes.")] = "",
    as_json: Json = False,
) -> None:
    """Inject a fault into a running graph, list what has been injected, or clear it. The bag records it.

    The graph's scenario needs live_faults (flight run SCENARIO --engine ros --set live_faults=4); ROS_DOMAIN_ID says on
    which domain it is.
    """
    wanted = [place is not None, clear is not None, listed]
    if sum(wanted) != 1 or (place is not None and kind is None):
        raise FlightError("name a place and what happens there, or --clear ID, or --list")
    from flight_graph.ros import fault_client
    if listed:
        found = fault_client.injected(namespace)
        if as_json:
            print(json.dumps({"faults": found}))
        else:
            console.print(_table(found))
        return
    if clear is not None:
        found = fault_client.clear(clear, namespace)
        said = f"{found['id']} ends at t = {found['until_s']:.9g} s"
    else:
        given = {"for_s": for_s, "probability": probability, "ramp_s": ramp_s, "bit": bit, "ticks": ticks, "every": every,
                 "every_s": every_s, "unit": unit, "value": value}
        given = {key: one for key, one in given.items() if one is not None}
        found = fault_client.inject({"at": place, "type": kind, **given}, namespace)
        said = f"{found['id']} begins at t = {found['from_s']:.9g} s"
    print(json.dumps(found) if as_json else said)


def _table(found):
    from rich.table import Table
    table = Table("id", "place", "type", "from [s]", "until [s]", "more", title="injected faults", title_justify="left")
    shown = ("id", "at", "type", "from_s", "until_s")
    for one in found:
        more = ", ".join(f"{key} {value}" for key, value in one.items() if key not in shown)
        add(table, one["id"], one["at"], one["type"], one["from_s"], one.get("until_s", ""), more)
    return table
