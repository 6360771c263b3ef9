"""Files of the MCAP conformance set that are read as the library mcap reads them.

    python benchmarks/mcap_conformance.py FOLDER

FOLDER: the set's files, unpacked (one file a combination of features of the format). For each, messages, attachments
and metadata must be those that the library mcap gives.
"""

import sys
from collections import Counter
from pathlib import Path

from mcap.reader import NonSeekingReader
from rich.progress import track

from flight_graph.bags.reader import read_bag
from flight_graph.errors import FlightError


def reader(path):
    return NonSeekingReader(open(path, "rb"))


def verdict(path: Path) -> str:
    """'equal', or what is wrong."""
    expected = [(channel.topic, found.log_time, found.data)
                for _, channel, found in reader(path).iter_messages(log_time_order=False)]
    try:
        bag = read_bag(path)
    except FlightError as error:
        return f"refused: {str(error).partition('is damaged: ')[2] or error}"
    if [(topic, stamp, bytes(payload)) for topic, stamp, payload in bag.messages()] != expected:
        return "other messages"
    if [(a.name, a.data) for a in bag.all_attachments] != [(a.name, a.data) for a in reader(path).iter_attachments()]:
        return "other attachments"
    if [(m.name, m.metadata) for m in bag.all_metadata] != [(m.name, m.metadata) for m in reader(path).iter_metadata()]:
        return "other metadata"
    return "equal"


def main():
    if len(sys.argv) != 2:
        print(__doc__.split("\n\n")[1].strip(), "(skipped: no folder was named)")
        return
    files = sorted(Path(sys.argv[1]).rglob("*.mcap"))
    found = Counter(verdict(path) for path in track(files, "reading", transient=True))
    for what, count in found.most_common():
        print(f"{count} of {len(files)}: {what}")


if __name__ == "__main__":
    main()
