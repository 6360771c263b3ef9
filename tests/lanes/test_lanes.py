"""Runs side by side have the bits of runs one by one: memory, logs, and the sentence of a stop."""

import re

import numpy as np
import pytest

from flight_graph.campaigns.cases import Batch, Cases
from flight_graph.engines import machine, object_code, part_calls
from flight_graph.engines.addresses import address
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from flight_graph.lanes import batch, lane_code, lane_driver, weave, wide_parts
from flight_graph.lanes.batch import SideBySide
from flight_graph.lanes.operations import LANES
from tests.graph import toy
from tests.lanes import odd
from tests.sweep.sweep_scenarios import RANDOM, swept

FAULTS = [
    {"id": "lost", "at": "sensor.imu", "type": "drop", "probability": 0.3, "from_s": 0.05},
    {"id": "late", "at": "controller.command", "type": "delay", "ticks": 2, "from_s": 0.1},
    {"id": "biased", "at": "sensor.imu.angular_velocity", "type": "bias", "value": 0.1,
     "when": "sensor.imu.angular_velocity[0] > 0"},
    {"id": "anew", "at": "watcher", "type": "restart", "from_s": 0.21, "for_s": 0.1},
]


def case(number, faults=()):
    """Values differ, and the whole number and the choice for some; two cases in three stop, each in its own way."""
    stops = {0: "fault_at", 2: "infinite_at"}.get(number % 5)
    data = toy.scenario(duration_s=0.5, seed=3 + number)
    data["components"]["odd"] = {"use": f"{odd.__file__}:Odd", "parameters": {
        "large": [1.0, 1e3, 1e9][number % 3], "terms": 2 + number % 4, **({stops: 0.11 + 0.05 * number} if stops else {})}}
    data["components"]["varying"] = {"use": f"{odd.__file__}:Varying", "parameters": {"length": 1 + number % 4}}
    data["components"]["fixed"] = {"use": f"{odd.__file__}:Fixed"}
    data["components"]["plant"]["parameters"] = {"angle": [0.1 * number, 0.2, -0.3 + 0.05 * number]}
    data["components"]["controller"]["parameters"] = {"law": ["pd", "p"][number % 2], "angle_limit": [0.62, 100.0][number % 2]}
    data["connect"]["varying.imu"] = {"from": "sensor.imu", "delay": 1}
    return Scenario({**data, **({"faults": list(faults)} if faults else {})}, "toy.yaml")


def flown(scenarios, together: bool):
    runs = [CompiledRun(scenario) for scenario in scenarios]
    ticks = 100
    flights = [run.start(ticks) for run in runs]
    side_by_side = SideBySide()
    if together:
        side_by_side.advance(flights, 37)
        side_by_side.advance(flights, ticks)
    else:
        for flight in flights:
            flight.advance(ticks)
    return flights, side_by_side.report


def assert_same(flights, others):
    for number, (flight, other) in enumerate(zip(flights, others, strict=True)):
        assert str(flight.stop) == str(other.stop) and flight.tick == other.tick, number
        for track, copy in zip(flight.tracks(), other.tracks(), strict=True):
            assert track.stamps_ns.tobytes() == copy.stamps_ns.tobytes(), (number, track.topic)
            assert track.records.tobytes() == copy.records.tobytes(), (number, track.topic)
        for name, array in flight.arrays.items():
            if name[:2] not in ("L_", "C_"):  # a log ends before its array does; conditions hold addresses
                assert array.tobytes() == other.arrays[name].tobytes(), (number, name)


@pytest.mark.parametrize("faults", [(), FAULTS], ids=["without faults", "with faults"])
def test_every_case_has_the_bits_of_its_run_alone(faults):
    scenarios = [case(number, faults) for number in range(LANES + 5)]
    alone, _ = flown(scenarios, False)
    together, report = flown(scenarios, True)
    assert_same(together, alone)
    stops = [str(flight.stop) for flight in together if flight.stop]
    for part in ("it broke after", "only finite numbers are published", "left the limit"):
        assert any(part in text for text in stops), (part, stops)
    assert len({flight.stop.t_ns for flight in together if flight.stop}) > 4 and any(not flight.stop for flight in together)
    assert report.side_by_side > 0
    assert "a work array whose length differs between lanes" in report.reasons["varying"]
    assert "fixed" not in report.reasons
    assert ("sensor" in report.reasons) == bool(faults) and "odd" not in report.reasons


def test_a_flight_goes_on_alone_where_it_went_with_others():
    scenarios = [case([1, 3][number % 2]) for number in range(LANES)]
    alone, _ = flown(scenarios, False)
    runs = [CompiledRun(scenario).start(100) for scenario in scenarios]
    SideBySide().advance(runs, 41)
    assert not any(flight.stop for flight in runs)
    for flight in runs:
        flight.advance(100)
    assert_same(runs, alone)


def assembly(component, part, differs):
    """The machine code of a wide part as text."""
    found, records = [], part_calls.records(component, part)
    names = ["parameters", "state", *(f"record {i}" for i in range(len(records) - 2))]
    widths = {name: weave.widths(dtype) for name, (dtype, _) in zip(names, records)}

    def optimised(module, target):
        made = lane_code.widened(module, target, "wide", records[0][0].itemsize, differs, widths)
        found.append(target.emit_assembly(made))
        return made

    with object_code.installed():
        object_code.part_code(getattr(component, part), part_calls.compiled_arguments(component, part), len(records) - 2,
                              "wide", component.state.dtype.fields["fault"][1], optimised)
    return found[0]


@pytest.mark.skipif(not machine.cpu()[0].startswith("x86_64"), reason="names of instructions are those of x86-64")
def test_the_machine_code_is_vector_code():
    """Products and sums work on whole vectors, and no product is contracted with a sum."""
    text = assembly(toy.Plant, "update", [(0, toy.PlantParameters.dtype.itemsize)])
    packed, single = (len(re.findall(rf"\bv?(?:add|sub|mul|div){kind}\b", text)) for kind in ("pd", "sd"))
    assert packed > 50 and packed > 5 * single
    assert not re.search(r"\bvfn?m(?:add|sub)", text)


def test_woven_memory_is_unwoven_as_it_was():
    """Every number of every lane, at eight times its offset."""
    dtype = toy.SENSED.dtype
    assert sum(count * width for _, count, width in weave.leaves(dtype)) == sum(
        length for _, _, _, length in toy.SENSED.leaves())
    assert weave.widths(np.dtype([("a", "<i4", 3), ("b", "u1"), ("c", [("d", "<f8", (2, 2))])], align=True)) == {
        0: 4, 4: 4, 8: 4, 12: 1, 16: 8, 24: 8, 32: 8, 40: 8}
    assert address(weave.block(1000)) % 64 == 0
    mixed = np.dtype([("a", "<u2", 3), ("b", "u1"), ("c", "<f8", 2), ("d", "<i4"), ("e", "<i2")], align=True)
    records, back = np.zeros(LANES, mixed), np.zeros(LANES, mixed)
    for name in mixed.names:
        count = records[name].size
        records[name] = np.arange(1, count + 1).reshape(records[name].shape) * (30 if name == "b" else 257)
    wide_parts.load({})  # the driver's own machine code
    leaves, woven = np.array(list(weave.leaves(mixed)), lane_driver.LEAF), weave.block(LANES * mixed.itemsize)
    for lanes, inward in ((records, True), (back, False)):
        places = address(lanes) + mixed.itemsize * np.arange(LANES)
        row = np.array([(address(woven), address(leaves), address(leaves) + leaves.nbytes, address(places), inward)],
                       lane_driver.TRANSFER)
        lane_driver.CODE.function("transfer")(address(row), address(row) + row.nbytes, (1 << LANES) - 1)
    assert back.tobytes() == records.tobytes() and woven[:LANES * 2].view("<u2").tolist() == records["a"][:, 0].tolist()


def test_machine_code_is_made_where_it_pays(monkeypatch):
    """Twenty short runs are over before a compiler is; with its code in the cache, they go side by side."""
    monkeypatch.setattr(batch.wide_parts, "missing", lambda asked: [{}] * 5)
    monkeypatch.setattr(batch.wide_parts, "load", None)
    flights, together = [CompiledRun(case(3)).start(100) for _ in range(6)], SideBySide(runs=20)
    together.advance(flights[:1], 100)
    together.advance(flights[1:], 100)
    assert together.report.singly == 6 and "would not pay" in together.report.sentence()


def test_a_campaign_has_the_same_rows():
    """Cases of a campaign, whose memory is used again, side by side and one by one."""
    scenario, together = swept(RANDOM), SideBySide()
    rows = Cases(scenario, Batch(LANES, together.advance)).rows(range(21))
    assert rows == Cases(scenario).rows(range(21)) and len({row.metrics["digest"] for row in rows}) == 21
    assert together.report.side_by_side == 20
