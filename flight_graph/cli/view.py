"""flight view: a run as a moving 3-D picture with plots beside it."""

from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Params, Settings, overrides
from flight_graph.cli.show import RunProgress, status, working
from flight_graph.cli.trust import Trust, asked
from flight_graph.cli.watched import PORT, shown
from flight_graph.errors import FlightError

Source = Annotated[str, typer.Argument(
    metavar="BAG|SCENARIO", help="A bag (its folder, an .mcap or .db3 file), or a scenario, which is run first.")]
Web = Annotated[bool, typer.Option("--web", help="In a browser, served from here until Ctrl-C.")]
Host = Annotated[str, typer.Option(help="Who may see it: 127.0.0.1 is this machine alone, 0.0.0.0 everybody.")]
Port = Annotated[int, typer.Option(min=1, max=65535, help="--web: the port of the page.")]


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight view runs/cubli_asteroid-compiled-1 --web")(view)


def view(
    source: Source,
    web: Web = False,
    save: Annotated[Path | None, typer.Option(
        metavar="FILE.rrd", help="Write a recording that Rerun opens, and show nothing.")] = None,
    host: Host = "127.0.0.1",
    port: Port = PORT,
    points: Annotated[int, typer.Option(min=10, help="Show at most so many messages of a topic.")] = 20_000,
    settings: Settings = None,
    params: Params = None,
    seed: Annotated[int | None, typer.Option(help="A scenario's seed of all noise.")] = None,
    duration: Annotated[float | None, typer.Option(help="A scenario's simulated seconds.")] = None,
    trust: Trust = False,
) -> None:
    """Show a run as a moving 3-D picture with plots beside it, in Rerun: a window, a browser, or a file.

    Rerun is installed apart (the sentence says how); `flight report BAG` writes a page that needs nothing.
    """
    from flight_graph.bags.reader import read_bag
    from flight_graph.extras import required
    from flight_graph.viewers import opening, rerun_stream
    from flight_graph.viewers.display import refuse_without_display
    required("rerun", "view", "flight view", "; flight report BAG writes a page with the vehicle in 3-D that needs nothing")
    if web and save:
        raise FlightError("--web or --save: one at a time")
    if not web and save is None:
        refuse_without_display("flight view")
    given = {"--set": settings, "--params": params, "--seed": seed, "--duration": duration}
    if opening.is_bag(source):
        if used := [name for name, value in given.items() if value is not None]:
            raise FlightError(f"{' and '.join(used)}: a bag stays as it was recorded; flight run --from BAG@SECONDS makes "
                              "another run of it")
        path = Path(source)
    else:
        path = _flown(source, overrides(source, settings, params, seed, duration, asked(trust)), asked(trust))
    with working(f"reading {path}", True):
        bag = read_bag(path)
        scene, notes = opening.picture_of_bag(bag, asked(trust))
    stream = rerun_stream.RerunStream(str(path), scene, bag.start_ns, points)
    with shown(stream, "flight view", host, port if web else None, save):
        with working(f"drawing {path}", True):
            stream.show(bag)
            stream.flush()
        for note in [*bag.remarks, *notes, *stream.notes]:
            status(note)


def _flown(name, given, consent) -> Path:
    """Run a scenario as flight run does; its bag."""
    from flight_graph import runs
    from flight_graph.engines.choice import check_engine
    from flight_graph.graphs import scenario as scenarios
    loaded = scenarios.load(name, given, None, consent)
    check_engine(loaded, "compiled")
    folder = runs.new_folder(None, loaded, "compiled")
    with RunProgress(loaded, True) as progress:
        try:
            runs.execute(loaded, "compiled", "lockstep", folder, progress.advance, progress.compiling)
        except FlightError as error:
            if not (folder / "metadata.yaml").exists():
                raise
            status(f"{error}; shown is the run up to there")
    status(f"recorded to {folder}")
    return folder
