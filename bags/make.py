"""Makes the golden bags that are missing: one for each scenario, short enough to stay below a size.

    python bags/make.py [SCENARIO ...] [--again]

A golden bag is recorded by the compiled engine with every parameter of its scenario, for a shorter duration, and with
all topics at their full rates, so that each component can be replayed. A scenario with a ``vary`` block
stands for many runs, and has none. --again replaces bags that are there already, with their duration where that fits:
after a change that is meant to change the numbers, and then the commit says which one.
"""

import argparse
import json
import shutil
import tempfile
from pathlib import Path

from flight_graph.bags.reader import read_bag
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.graphs.source import available
from flight_graph.recordings.bag_scenario import SCENARIO
from flight_graph.recordings.recording import write_recording

FOLDER = Path(__file__).resolve().parent
LARGEST = 272_000  # [bytes] of a bag's folder


def make(name: str) -> tuple[int, float]:
    """Record the golden bag of a scenario; return its size [bytes] and duration [s]. Raises FlightError."""
    scenario = load(name)
    whole = scenario.file.duration_s
    with tempfile.TemporaryDirectory() as work:
        for seconds in (*_present(name), *_durations(whole)):
            folder = Path(work) / name
            shutil.rmtree(folder, ignore_errors=True)
            shorter = Scenario({**scenario.file.model_dump(by_alias=True, exclude_none=True), "duration_s": seconds,
                                "record": {}}, scenario.origin, scenario.folder)
            write_recording(CompiledRun(shorter).run(), folder, "compiled")
            size = sum(file.stat().st_size for file in folder.iterdir())
            if size <= LARGEST:
                shutil.rmtree(FOLDER / name, ignore_errors=True)
                shutil.copytree(folder, FOLDER / name)
                return size, seconds
    raise FlightError(f"{name}: not even a short bag stays below {LARGEST} bytes")


def _present(name: str) -> list[float]:
    """The duration of the bag that is there, if one is."""
    if not (FOLDER / name).exists():
        return []
    return [json.loads(read_bag(FOLDER / name).attachments[SCENARIO].data)["duration_s"]]


def _durations(whole: float):
    """The whole duration, then 5, 2, 1, 0.5, ... powers of ten below it."""
    yield whole
    yield from (seconds for power in range(5, -4, -1) for factor in (5, 2, 1)
                if (seconds := float(f"{factor}e{power}")) < min(whole, 500.0))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenarios", nargs="*")
    options.add_argument("--again", action="store_true")
    given = options.parse_args()
    for name in given.scenarios or available():
        try:
            if load(name).vary is not None:
                continue
            if (FOLDER / name).exists() and not given.again:
                continue
            size, seconds = make(name)
            print(f"{name}: {seconds:g} s, {size} bytes", flush=True)
        except FlightError as error:
            print(f"{name}: no bag: {error}", flush=True)


if __name__ == "__main__":
    main()
