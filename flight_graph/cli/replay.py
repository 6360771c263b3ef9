"""flight verify, replay, play: a bag run again, one component on its inputs, and a bag published live."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.bags import BagPath, Topics, tell_unchecked
from flight_graph.cli.scenarios import CheckBounds, Json, prepare_engine
from flight_graph.cli.show import console, fields_table, status, steps
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

Tolerance = Annotated[float, typer.Option(
    min=0.0, help="Where versions differ: allowed difference, relative to a field's largest magnitude; a field may always "
                  "differ by its floor, mostly 1e-12 of its unit.")]



def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight verify bags/cubli_asteroid --engine ros")(verify)
    app.command(epilog="Example: flight replay runs/cubli_earth-ros-1 --component controller --set k_a=0.02")(replay)
    app.command(epilog="Example: flight play runs/cubli_asteroid-ros-1 --rate 0.5 --topics /cubli/imu --loop")(play)


def verify(
    bag: BagPath,
    engine: Annotated[str, typer.Option(help="compiled, python, or ros (all nodes, in lockstep).")] = "compiled",
    trust: Trust = False, tolerance: Tolerance = 1e-6, check_bounds: CheckBounds = False, as_json: Json = False,
) -> None:
    """Run a bag's scenario again from the bag alone and compare every message, byte for byte.

    Any engine must give the bytes of any other. Where versions differ (they are named) and bytes do too, the comparison
    is within a tolerance. The status is 0 when the bag holds, 1 when it does not or cannot be compared.
    """
    prepare_engine(engine)
    from flight_graph.runs import verify as run_again
    with steps(f"verify {bag}", not as_json) as advance:
        result = run_again(
            bag, engine, trust=asked(trust), tolerance=tolerance, check_bounds=check_bounds,
            progress=lambda seconds, total: advance(seconds, total, "s simulated"),
            compiling=lambda done, total, names: advance(done, total, f"compiling {names} (once; it is kept)"))
    if as_json:
        print(json.dumps({"bag": str(bag), "holds": result.holds, **result.plain()}, default=str))
    else:
        _show(result)
    if not result.holds:
        raise typer.Exit(1)


def replay(
    bag: BagPath,
    component: Annotated[str, typer.Option(help="Name of a component in the bag's scenario.")],
    engine: Annotated[str, typer.Option(help="compiled, python, or ros (the real node over topics).")] = "compiled",
    settings: Annotated[list[str] | None, typer.Option(
        "--set", metavar="PARAM=VALUE", help="Change a parameter of the component; may be repeated.")] = None,
    trust: Trust = False, tolerance: Tolerance = 1e-6, check_bounds: CheckBounds = False, as_json: Json = False,
) -> None:
    """Feed the recorded inputs to one component and compare its outputs with the recorded ones.

    Without --set every byte must be equal. With --set the differences are reported (open loop).
    """
    prepare_engine(engine)
    from flight_graph.graphs.overrides import parse_settings
    from flight_graph.runs import replay as run_again
    with steps(f"replay {component}", not as_json) as advance:
        result = run_again(
            bag, component, engine, settings=parse_settings(settings), trust=asked(trust), tolerance=tolerance,
            check_bounds=check_bounds, progress=lambda seconds, total: advance(seconds, total, "s simulated"))
    if as_json:
        print(json.dumps({"bag": str(bag), "holds": result.holds, **result.plain()}, default=str))
    else:
        console.print(f"{result.component}: {result.firings} firings ({result.engine})", highlight=False)
        _show(result.comparison, result.open_loop)
    if not result.holds:
        raise typer.Exit(1)


def play(
    bag: BagPath,
    rate: Annotated[float, typer.Option(help="Recorded seconds per second of wall time.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end, until Ctrl-C.")] = False,
    start: Annotated[float, typer.Option(min=0.0, help="Begin this many seconds into the bag.")] = 0.0,
    topics: Topics = None,
    remap: Annotated[list[str] | None, typer.Option("--remap", help="old:=new, a topic's name; may be repeated.")] = None,
    qos_overrides: Annotated[Path | None, typer.Option(
        help="A YAML file as ros2 bag play takes it: topic: {reliability: best_effort, depth: 10}.")] = None,
    clock: Annotated[float, typer.Option(help="Rate of /clock between messages [Hz].")] = 40.0,
    longest_gap: Annotated[float, typer.Option(
        help="A longer stretch without messages [s of the recording] is passed over; inf plays all.")] = 60.0,
) -> None:
    """Publish a bag to live ROS topics, with /clock, for viewers and nodes. Any bag of rosbag2 can be played.

    From a terminal: space pauses and resumes, s or the right arrow plays the next message, up and down change the rate.
    """
    from flight_graph.replays.play import Schedule
    chosen = [name.strip() for text in topics or [] for name in text.split(",") if name.strip()] or None
    schedule = Schedule.of(bag, rate, start, chosen, remap or (), qos_overrides, clock, longest_gap)
    try:
        from flight_graph.ros import player
    except ModuleNotFoundError as error:
        raise FlightError(f"flight play publishes to ROS topics and needs rclpy, which is not here ({error})") from None
    tell_unchecked(schedule.bag)
    report = player.run(schedule, loop, lambda sentence: status(sentence))
    print(f"{report.messages} messages on {report.topics} topics"
          + (f"; at most {report.worst_delay_s:.3f} s late" if report.messages else ""))


def _show(result, open_loop: bool = False) -> None:
    """Print a comparison; one of an open-loop replay has no verdict."""
    first, *others = result.sentences
    if not open_loop and not first.startswith(result.verdict):
        first = f"{result.verdict}: {first}"
    colour = "yellow" if open_loop else "green" if result.holds else "red"
    console.print(first, style=colour, markup=False, highlight=False)
    for sentence in others:
        console.print(sentence, markup=False, highlight=False)
    different = [topic for topic in result.topics if not topic.equal]
    if different:
        console.print(fields_table(different))
