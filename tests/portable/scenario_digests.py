"""The bits of every scenario as one number: SHA-256 of all that its run records, written down in scenario_digests.json.

    python -m tests.portable.scenario_digests [SCENARIO ...] [--whole] [--write]

Without --whole each scenario is flown for its short duration alone, which takes seconds for all of them once they are
compiled. Exit status: 0 all as written down, 1 one or more differ. --write writes all of them anew, whole and short:
after a change that is meant to change the numbers, together with the golden bags.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path

from flight_graph.engines.compiled import CompiledRun, Recording
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.graphs.source import available

FILE = Path(__file__).with_name("scenario_digests.json")
LENGTHS = ("short", "whole")
MOST_TICKS = 20_000  # of a short run


def scenarios() -> list[str]:
    """Names of the scenarios that stand for one run: those without a ``vary`` block."""
    return [name for name in available() if load(name).vary is None]


def digest(recording: Recording) -> str:
    """SHA-256 over the topics in the order of the schedule: name, stamps [ns], and the messages in wire form."""
    found = hashlib.sha256()
    for track in recording.tracks:
        payloads = track.signal.payloads(track.records)
        found.update(f"{track.topic} {track.signal.type_name} {payloads.shape}\n".encode())
        found.update(track.stamps_ns.astype("<i8").tobytes())
        found.update(payloads.tobytes())
    return found.hexdigest()


def duration_s(name: str, length: str) -> float:
    """How long a scenario is flown: the whole of it, or the longest of 0.1, 1, 10 s within MOST_TICKS."""
    scenario = load(name)
    whole = scenario.file.duration_s
    if length == "whole":
        return whole
    seconds = MOST_TICKS * scenario.graph.base_ns * 1e-9
    return min(whole, max(step for step in (0.01, 0.1, 1.0, 10.0) if step <= seconds))


def fly(name: str, length: str) -> str:
    """The digest of one scenario on this machine. Raises FlightError."""
    return digest(CompiledRun(load(name, {"duration_s": duration_s(name, length)})).run())


def written() -> dict[str, dict[str, str]]:
    """The digests of the source: scenario -> length -> SHA-256."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def write(names: list[str]) -> None:
    """Write the digests of this machine down, whole and short; those of scenarios that are gone are dropped."""
    known = written()
    for name in names:
        known[name] = {length: fly(name, length) for length in LENGTHS}
        print(f"{name}: written", flush=True)
    kept = {name: known[name] for name in scenarios() if name in known}
    FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8", newline="\n")


def compare(names: list[str], length: str) -> int:
    """Print a line a scenario, as it comes; return how many differ from what is written down."""
    known, differing = written(), 0
    for name in names:
        found = fly(name, length)
        same = found == known.get(name, {}).get(length)
        differing += not same
        print(f"{name} {'equal' if same else 'differs'} {found}", flush=True)
    return differing


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenarios", nargs="*")
    options.add_argument("--whole", action="store_true", help="fly whole scenarios")
    options.add_argument("--write", action="store_true", help="write the digests anew")
    given = options.parse_args()
    try:
        names = given.scenarios or scenarios()
        if given.write:
            write(names)
            return 0
        return 1 if compare(names, "whole" if given.whole else "short") else 0
    except FlightError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
