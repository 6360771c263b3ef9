"""Golden bags: each verifies itself, as a compiled loop and as ROS nodes, and every component replays, byte for byte.

On another architecture, or with other library versions, a bag that differs is compared within a tolerance; a warning
says so in pytest's summary. A difference where only this project's own code has changed is a failure: the code has
changed the numbers. Where that is meant, `python bags/make.py --again` records the bags anew.
"""

import warnings
from pathlib import Path

import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs import scenario, source
from flight_graph.recordings.recorded_run import open_recorded
from flight_graph.runs import replay, verify

FOLDER = Path(__file__).resolve().parents[2] / "bags"
BAGS = sorted(path.parent for path in FOLDER.glob("*/metadata.yaml"))
LARGEST = 300_000  # [bytes]


def judge(bag, what, result):
    """Pass bytes; pass the tolerance only where something other than our own code has changed."""
    print(f"{bag.name}, {what}: {result.sentences[0]}")
    assert result.holds, result.sentences
    if result.applied != "bytes":
        run = open_recorded(bag)
        assert not run.same_machine, f"only the code has changed, and with it the numbers: {result.sentences}"
        warnings.warn(f"golden bag {bag.name}, {what}: compared within {result.tolerance:g}, not byte for byte "
                      f"({run.changes_sentence()})", stacklevel=2)


@pytest.mark.parametrize("bag", BAGS, ids=lambda bag: bag.name)
def test_golden_bag(bag):
    assert sum(file.stat().st_size for file in bag.iterdir()) < LARGEST
    run = open_recorded(bag)
    assert run.complete and run.scenario.name == bag.name
    judge(bag, "verify", verify(bag))
    replayed = 0
    for name in run.scenario.graph.nodes:
        judge(bag, f"replay of {name}", replay(bag, name).comparison)
        replayed += 1
    assert replayed == len(run.scenario.graph.nodes)


@pytest.mark.ros
@pytest.mark.parametrize("bag", BAGS, ids=lambda bag: bag.name)
def test_golden_bag_as_nodes(bag):
    """The same components as processes that talk over DDS leave the same bytes."""
    pytest.importorskip("rclpy")
    only = open_recorded(bag).scenario.file.only
    if only is not None and only.engine != "ros":
        with pytest.raises(FlightError, match="runs in the compiled engine only"):
            verify(bag, "ros")
    else:
        judge(bag, "verify as nodes", verify(bag, "ros"))


def test_every_scenario_has_one():
    """A scenario with a vary block stands for many runs, and has none."""
    missing = []
    for name in source.available():
        try:
            if scenario.load(name).vary is None and FOLDER / name not in BAGS:
                missing.append(name)
        except FlightError as error:
            missing.append(f"{name} ({error})")
    assert not missing, "python bags/make.py makes the missing ones"
