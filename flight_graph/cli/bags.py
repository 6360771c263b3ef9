"""flight info, recover, diff, export: looking at a bag, saving it, comparing it, taking it elsewhere."""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import add, console, number, report_next, status, working
from flight_graph.errors import FlightError, unknown
from flight_graph.plots.names import beside
from flight_graph.text_files import printable

BagPath = Annotated[Path, typer.Argument(help="A bag: its folder, or an .mcap or .db3 file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Topics = Annotated[list[str] | None, typer.Option(
    "--topics", help="Only these topics: a name, or several with commas; may be repeated.")]
_HIDDEN = ("rosbag2", "units")  # metadata records for programs


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight info runs/cubli_asteroid-ros-1")(info)
    app.command(epilog="Example: flight recover runs/cubli_asteroid-ros-1 --out saved")(recover)
    app.command(epilog="Example: flight diff runs/cubli_asteroid-ros-1 runs/cubli_asteroid-compiled-1")(diff)
    app.command(epilog="Example: flight export runs/cubli_asteroid-ros-1 --to npz --topics /cubli/imu,/cubli/truth")(
        export)


def topic_names(given: list[str] | None, *bags) -> list[str] | None:
    """``--topics`` as the names have it in the bags (with or without their first slash); None: all. Raises FlightError."""
    names = [name.strip() for text in given or [] for name in text.split(",") if name.strip()]
    known = {name: None for bag in bags for name in bag.topics}
    found = []
    for name in names:
        other = name[1:] if name.startswith("/") else f"/{name}"
        if name not in known and other not in known:
            raise unknown("topic", name, known, " and ".join(str(bag.path) for bag in bags))
        found.append(name if name in known else other)
    return found or None


def info(
    bag: BagPath, as_json: Json = False,
    attachment: Annotated[str | None, typer.Option(help="Print this attachment instead.")] = None,
) -> None:
    """Say what a bag holds: topics, counts, rates, how it was made and how it ended."""
    from flight_graph.bags.reader import read_bag
    with working(f"reading {bag}", not as_json):
        content = read_bag(bag)
    tell_unchecked(content)
    if attachment is not None:
        if attachment not in content.attachments:
            raise unknown("attachment", attachment, content.attachments, str(bag))
        text = content.attachments[attachment].data.decode(errors="replace")
        sys.stdout.write(printable(text) if sys.stdout.isatty() else text)  # what is read must be what runs
        return
    seconds = (content.end_ns - content.start_ns) / 1e9
    topics = [{"topic": topic.name, "type": topic.type_name, "count": topic.count,
               "rate_hz": _mean_rate(content.stamps_ns(topic.name)), "encoding": topic.encoding,
               "problem": _problem(content, topic)} for topic in content.topics.values()]
    report = {"bag": str(bag), "start_ns": content.start_ns, "duration_s": seconds, "topics": topics,
              "checked": content.checked,
              "metadata": dict(content.metadata), "attachments": [record.name for record in content.all_attachments],
              "remarks": content.remarks}
    if as_json:
        print(json.dumps(report))
        return
    from rich.table import Table
    table = Table("topic", "type", "messages", "rate [Hz]", title=printable(f"{bag}: {seconds:g} s"), title_justify="left")
    for topic in topics:
        add(table, topic["topic"], topic["type"], topic["count"], f"{topic['rate_hz']:g}" if topic["rate_hz"] else "")
    console.print(table)
    for topic in topics:
        if topic["problem"]:
            console.print(f"not decoded: {topic['topic']} {topic['problem']}", highlight=False, markup=False)
    for record in content.all_metadata:
        if record.name not in _HIDDEN:
            text = f"{record.name}: " + ", ".join(f"{key} {value}" for key, value in record.metadata.items())
            console.print(text, highlight=False, markup=False)
    console.print("attachments: " + ", ".join(_attachments(report["attachments"])), highlight=False, markup=False)


def _attachments(names: list[str]) -> list[str]:
    """Names of attachments, of many checkpoints the first and the last."""
    from flight_graph.engines.checkpoint import FOLDER
    checkpoints = [name for name in names if name.startswith(FOLDER)]
    if len(checkpoints) < 4:
        return names
    return [*(name for name in names if name not in checkpoints),
            f"{len(checkpoints)} checkpoints ({checkpoints[0]} to {checkpoints[-1].removeprefix(FOLDER)})"]


def tell_unchecked(*bags) -> None:
    """Say on standard error what is to be known of bags, and which have messages that no checksum stands over."""
    for bag in bags:
        for remark in bag.remarks:
            status(remark)
        if not bag.checked:
            status(f"{bag.path}: it carries no checksums, so damage that keeps its messages' form cannot be seen")


def _problem(content, topic):
    """Why a topic's messages cannot be decoded; nothing where they can."""
    try:
        content.field_trees(topic.name)
    except FlightError as error:
        return topic.problem or str(error).partition(f"'{topic.name}': ")[2]
    return ""


def _mean_rate(stamps):
    """Messages per second between the first and the last one; None where these do not differ."""
    seconds = int(stamps.max() - stamps.min()) / 1e9 if len(stamps) else 0.0
    return (len(stamps) - 1) / seconds if seconds else None


def recover(
    bag: BagPath,
    out: Annotated[Path | None, typer.Option(help="Folder of the new bag; BAG_recovered when left out.")] = None,
    as_json: Json = False,
) -> None:
    """Make a valid bag of a truncated, corrupted or unfinished one; say what was saved and how much time is lost.

    The damaged bag stays as it is.
    """
    from flight_graph.bags.recover import recover as save
    folder = out or beside(bag, "_recovered")
    with working(f"recovering {bag}", not as_json):
        report = save(bag, folder)
    if as_json:
        print(json.dumps({
            "source": str(bag), "bag": str(folder), "topics": {name: asdict(t) for name, t in report.topics.items()},
            "gaps": [asdict(gap) for gap in report.gaps], "seconds_lost": report.seconds_lost,
            "attachments": report.attachments, "metadata": report.metadata, "remarks": report.remarks}))
        return
    from rich.table import Table
    table = Table("topic", "saved", "lost", title=printable(f"{bag} -> {folder}"), title_justify="left")
    for name, topic in report.topics.items():
        add(table, name, topic.saved, "unknown" if topic.lost is None else topic.lost)
    console.print(table)
    kept = f"{len(report.attachments)} attachments and {len(report.metadata)} metadata records kept"
    for line in [*map(str, report.gaps), kept, *report.remarks]:
        console.print(line, markup=False, highlight=False)
    print(folder, flush=True)
    report_next(folder)


def diff(
    bag_a: BagPath, bag_b: BagPath,
    topics: Topics = None, as_json: Json = False,
) -> None:
    """Compare two bags topic by topic: equal bytes, or where and by how much they differ. The status is 1 then."""
    from flight_graph.bags.diff import diff as compare
    from flight_graph.bags.reader import read_bag
    with working(f"comparing {bag_a} and {bag_b}", not as_json):
        a, b = read_bag(bag_a), read_bag(bag_b)
        found = compare(a, b, topic_names(topics, a, b))
    tell_unchecked(a, b)
    equal = all(topic.equal for topic in found)
    if as_json:
        print(json.dumps({"a": str(bag_a), "b": str(bag_b), "equal": equal, "topics": [asdict(t) for t in found]},
                         default=str))
    else:
        from flight_graph.cli.show import fields_table
        for topic in found:
            console.print(str(topic), markup=False, highlight=False)
        if any(topic.fields for topic in found):
            console.print(fields_table([topic for topic in found if not topic.equal]))
    if not equal:
        raise typer.Exit(1)


def export(
    bag: BagPath,
    to: Annotated[str, typer.Option(help="csv, parquet or npz.")] = "csv",
    out: Annotated[Path | None, typer.Option(help="Folder of the tables; BAG_tables when left out.")] = None,
    topics: Topics = None, as_json: Json = False,
) -> None:
    """Write one table a topic, with named and unit-labelled columns.

    A topic that cannot be read is named, the others are written, and the status is 1.
    """
    from flight_graph.bags.export import export as write
    from flight_graph.bags.reader import read_bag
    with working(f"writing {to} tables of {bag}", not as_json):
        content = read_bag(bag)
        done = write(content, out or beside(bag, "_tables"), to, topic_names(topics, content))
    tell_unchecked(content)
    if as_json:
        print(json.dumps({"bag": str(bag), "format": to, "files": [str(path) for path in done.paths],
                          "problems": done.problems}))
    else:
        for path in done.paths:
            print(f"{path} ({number(path.stat().st_size / 1e6)} MB)")
        for sentence in done.problems.values():
            status(f"not exported: {sentence}")
    if done.problems:
        raise typer.Exit(1)
