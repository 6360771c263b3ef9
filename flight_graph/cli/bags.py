"""flight info, plot: looking at a bag."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import console
from flight_graph.errors import FlightError

BagPath = Annotated[Path, typer.Argument(help="A bag: its folder, or an .mcap file.")]


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight info runs/cubli_asteroid-ros-1")(info)
    app.command(epilog="Example: flight plot runs/cubli_asteroid-ros-1 --out balance.png")(plot)


def info(bag: BagPath, as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False) -> None:
    """Say what a bag holds: topics, counts, rates, how it was made and how it ended."""
    from flight_graph.bag.reader import read_bag
    content = read_bag(bag)
    seconds = (content.end_ns - content.start_ns) / 1e9
    topics = [{"topic": topic.name, "type": topic.type_name, "count": topic.count,
               "rate_hz": (topic.count - 1) / seconds if seconds > 0 and topic.count > 1 else None}
              for topic in content.topics.values()]
    report = {"bag": str(bag), "start_ns": content.start_ns, "duration_s": seconds, "topics": topics,
              "metadata": dict(content.metadata), "attachments": list(content.attachments)}
    if as_json:
        print(json.dumps(report))
        return
    from rich.table import Table
    table = Table("topic", "type", "messages", "rate [Hz]", title=f"{bag}: {seconds:g} s", title_justify="left")
    for topic in topics:
        table.add_row(topic["topic"], topic["type"], str(topic["count"]),
                      f"{topic['rate_hz']:g}" if topic["rate_hz"] else "")
    console.print(table)
    for name, entries in report["metadata"].items():
        if name != "rosbag2":
            console.print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in dict(entries).items()),
                          highlight=False)
    console.print("attachments: " + ", ".join(report["attachments"]), highlight=False)


def plot(
    bag: BagPath,
    out: Annotated[Path | None, typer.Option(help="The PNG to write; beside the bag when left out.")] = None,
) -> None:
    """Draw a run's overview figure from its bag."""
    from flight_graph.recording import open_run
    _, scenario, signals = open_run(bag)
    print(draw_overview(scenario, signals, out or bag.with_name(bag.stem + ".png")))


def draw_overview(scenario, signals, path: Path) -> Path:
    """The figure that the scenario names. Raises FlightError when it names none."""
    from flight_graph.metrics import load
    if not scenario.file.figure:
        raise FlightError(f"{scenario.name} names no figure")
    return load(scenario.file.figure)(scenario, signals, path)
