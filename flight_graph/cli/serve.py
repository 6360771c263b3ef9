"""flight serve: a bag, a run that flies, or the running graph, live in Foxglove or Lichtblick."""

import signal
import threading
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Params, Settings, overrides
from flight_graph.cli.show import next_command, status, steps, working
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight serve cubli_asteroid --speed 2 --set live_faults=4")(serve)


def serve(
    source: Annotated[str | None, typer.Argument(
        metavar="BAG|SCENARIO", help="A bag, or a scenario, which flies while it is watched.")] = None,
    ros: Annotated[bool, typer.Option("--ros", help="The running ROS graph in place of both (ROS_DOMAIN_ID).")] = False,
    host: Annotated[str, typer.Option(
        help="Who may connect: 127.0.0.1 is this machine alone, 0.0.0.0 everybody.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Where viewers connect.")] = 8765,
    speed: Annotated[float, typer.Option(help="Simulated seconds a second; 0 stands still.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="A bag again and again.")] = False,
    once: Annotated[bool, typer.Option("--once", help="End where the source ends; else Ctrl-C ends it.")] = False,
    wait: Annotated[bool, typer.Option(help="Begin when the first viewer has subscribed.")] = True,
    settings: Settings = None,
    params: Params = None,
    seed: Annotated[int | None, typer.Option(help="A scenario's seed of all noise.")] = None,
    duration: Annotated[float | None, typer.Option(help="A scenario's simulated seconds.")] = None,
    out: Annotated[Path | None, typer.Option(help="A scenario's bag (a new folder); else nothing is recorded.")] = None,
    trust: Trust = False,
) -> None:
    """Stream to Foxglove or Lichtblick: open the address there as a Foxglove WebSocket.

    Named numbers have topics of their own, by their names. Parameters of a run that flies, and of a running graph, may be
    set in the viewer; faults go in by the parameter faults.inject where the scenario has live_faults (docs/seeing.md).
    """
    from flight_graph.extras import required
    required("foxglove", "foxglove", "flight serve")
    if (source is None) != ros:
        raise FlightError("flight serve needs a bag or a scenario, or --ros in their place")
    if not 0.0 <= speed < 1e6:
        raise FlightError(f"--speed {speed:g}: allowed: simulated seconds a second, 0 to 1e6")
    given = {"--set": settings, "--params": params, "--seed": seed, "--duration": duration, "--out": out}
    found = _source(source, {name: value for name, value in given.items() if value is not None}, asked(trust))
    if loop and not found.can_seek:
        raise FlightError("--loop: only a bag can begin again")
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    from flight_graph.viewers.foxglove_stream import FoxgloveStream
    stream = FoxgloveStream(found, host, port, speed, status)
    print(f"ws://{host}:{stream.port}", flush=True)
    try:
        if wait and not ros:
            status("waiting for a viewer: in Foxglove or Lichtblick, open a Foxglove WebSocket at this address")
            stream.wait_for_viewer(stop)
        stream.run(stop, once, loop)
    finally:
        stream.close()
        found.close()
        if out is not None:
            found.write(out, "compiled")
            print(out, flush=True)
            next_command("verify", out)
    if found.stopped:
        raise FlightError(found.stopped)


def _source(name, given, consent):
    """What is served. given: the options of a scenario that were used."""
    from flight_graph.viewers import opening
    if name is None or opening.is_bag(name):
        if given:
            raise FlightError(f"{' and '.join(given)}: these are for a scenario that flies")
    if name is None:
        from flight_graph.ros.listening import RosSource
        return RosSource()
    if opening.is_bag(name):
        from flight_graph.bags.reader import read_bag
        from flight_graph.viewers.bag_source import BagSource
        with working(f"reading {name}", True):
            bag = read_bag(Path(name))
            for remark in bag.remarks:
                status(remark)
            return BagSource(bag)
    from flight_graph import runs
    from flight_graph.engines.choice import check_engine
    from flight_graph.graphs import scenario as scenarios
    from flight_graph.viewers.flying import FlyingSource
    loaded = scenarios.load(name, overrides(name, given.get("--set"), given.get("--params"), given.get("--seed"),
                                            given.get("--duration"), consent), None, consent)
    check_engine(loaded, "compiled")
    if "--out" in given:
        runs.new_folder(given["--out"], loaded, "compiled")
    with steps(loaded.name, True) as advance:
        return FlyingSource(loaded, lambda done, total, names: advance(done, total, f"compiling {names}"))
