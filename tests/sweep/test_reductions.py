"""Measures that are taken while runs fly: the bits of NumPy over all messages, with faults, lanes and early ends."""

import functools
import json
import math
import operator
import os
import subprocess
import sys

import numpy as np

from flight_graph.campaigns.cases import Batch, Cases
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from flight_graph.lanes.batch import SideBySide
from flight_graph.lanes.operations import LANES
from tests.graph import toy
from tests.lanes.test_lanes import case
from tests.sweep import battery
from tests.sweep.sweep_scenarios import RANDOM, swept

FIELDS = {"truth": "plant.truth.angle", "imu": "sensor.imu.angular_velocity", "one": "sensor.imu.orientation_covariance",
          "command": "controller.command.effort", "odd": "odd.seen.sorted", "volts": "battery.battery.voltage",
          "amperes": "battery.battery.current", "status": "battery.battery.power_supply_status",
          "present": "battery.battery.present"}
LIMITS = {"truth": 0.05, "imu": 0.02, "one": 0.0, "command": 0.01, "odd": 0.1, "volts": 11.5, "amperes": -0.1, "status": 252,
          "present": 0.5}
FAULTS = [
    {"id": "lost", "at": "sensor.imu", "type": "drop", "probability": 0.3, "from_s": 0.05},
    {"id": "twice", "at": "odd.seen", "type": "duplicate", "every": 3},
    {"id": "late", "at": "controller.command", "type": "delay", "ticks": 2, "from_s": 0.1},
    {"id": "stale", "at": "battery.battery", "type": "stale", "from_s": 0.2, "until_s": 0.3},
]


def block():
    found = {}
    for name, place in FIELDS.items():
        for of in ("value", "absolute", "squared", "norm"):
            found[f"integral {name} {of}"] = {"integral": place, "of": of}
            found[f"largest {name} {of}"] = {"largest": place, "of": of}
        for of in ("absolute", "norm"):
            found[f"least {name} {of}"] = {"least": place, "of": of}
            found[f"final {name} {of}"] = {"final": place, "of": of}
        found[f"first {name} above"] = {"first": place, "above": LIMITS[name]}
        found[f"first {name} below"] = {"first": place, "of": "norm", "below": LIMITS[name]}
        found[f"settling {name} value"] = {"settling": place, "within": abs(LIMITS[name]) + 0.01, "about": 0.01}
    return found


def scenario(number, faults=(), **overrides):
    made = case(number, faults=())
    data = made.file.model_dump(by_alias=True, exclude_none=True)
    data["components"]["battery"] = {"use": f"{battery.__file__}:Battery", "parameters": {"lasts": 0.1 + 0.1 * number}}
    return Scenario({**data, **({"faults": list(faults)} if faults else {}), "measures": block(),
                     "record": {"max_rate_hz": 50}, **overrides}, "toy.yaml")


def by_numpy(entry, records, path, duration_s):
    """A measure of records by other lines: plain sums of lists, NumPy's comparisons."""
    if not len(records):
        return None
    values = records
    for step in path.split("."):
        values = values[step]
    rows = values.reshape(len(records), -1).astype(float)
    stamp = records["header"]["stamp"]
    t = (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] - 946_728_000 * 10**9) / 1e9
    of = entry.get("of", "value")
    if of in ("squared", "norm"):
        sums = [functools.reduce(operator.add, [value * value for value in row], 0.0) for row in rows.tolist()]
        rows = np.array([[math.sqrt(one) if of == "norm" else one] for one in sums])
    elif of == "absolute":
        rows = np.abs(rows)
    if "largest" in entry:
        return rows.max()
    if "least" in entry:
        return rows.min()
    if "final" in entry:
        return rows[-1].max()
    if "integral" in entry:
        total = 0.0
        for row, begin, end in zip(rows.tolist(), t.tolist(), [*t.tolist()[1:], duration_s]):
            total += functools.reduce(operator.add, row, 0.0) * (end - begin)
        return total
    if "first" in entry:
        met = (rows > entry["above"] if "above" in entry else rows < entry["below"]).any(axis=1)
        return t[met.argmax()] if met.any() else None
    away = (np.abs(rows - entry["about"]) > entry["within"]).any(axis=1)
    return None if away[-1] else t[np.flatnonzero(away)[-1]] if away.any() else 0.0


def bits(value):
    """As text; zero has no sign, and NaN is NaN."""
    return None if value is None else "nan" if value != value else (float(value) + 0.0).hex()


def assert_as_numpy(flight, scenario):
    found, logs = flight.reduced(), flight.logged()
    assert found.keys() == block().keys()
    for (name, entry), measure in zip(block().items(), scenario.measures, strict=True):
        records, place = logs[measure.topic], next(entry[kind] for kind in entry if kind not in ("of", "above", "below"))
        expected = by_numpy(entry, records, place.split(".", 2)[2], 0.5)
        assert bits(found[name]) == bits(expected), (name, found[name], expected)
        defined = measure.of(records, scenario.epoch_ns, scenario.duration_ns)
        assert bits(defined) == bits(expected), (name, defined, expected)
    return found


def flown(faults, together):
    scenarios = [scenario(number, faults) for number in range(LANES + 2)]
    flights = [CompiledRun(one, reducing=True).start(100) for one in scenarios]
    side_by_side = SideBySide()
    if together:
        side_by_side.advance(flights, 37)
        side_by_side.advance(flights, 100)
    else:
        for flight in flights:
            flight.advance(100)
    return flights, scenarios, side_by_side.report


def test_the_numbers_are_those_of_all_messages():
    """One by one, side by side, with lanes that stop early, with lost, doubled, late and stale messages."""
    for faults in ((), FAULTS):
        alone, (flights, scenarios, report) = flown(faults, False)[0], flown(faults, True)
        found = [assert_as_numpy(*pair) for pair in zip(flights, scenarios, strict=True)]
        assert [list(map(bits, one.reduced().values())) for one in alone] == [list(map(bits, one.values())) for one in found]
        assert report.side_by_side > 0 and len({flight.tick for flight in flights}) > 4
        numbers = [value for one in found for value in one.values()]
        assert None in numbers and any(value != value for value in numbers if value is not None)
        if faults:
            assert len({len(flight.logged()["toy/imu"]) for flight in flights if not flight.stop}) > 1


def test_plain_python_gives_the_same_bits():
    one = scenario(3, FAULTS)
    flight = CompiledRun(one, reducing=True).start(100)
    flight.advance(30)
    code = ("import json; from tests.sweep import test_reductions as t\n"
            "one = t.scenario(3, t.FAULTS); flight = t.CompiledRun(one, reducing=True).start(100); flight.advance(30)\n"
            "print(json.dumps([t.bits(value) for value in flight.reduced().values()]))")
    said = subprocess.run([sys.executable, "-c", code], env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True,
                          text=True, check=True).stdout
    assert json.loads(said) == [bits(value) for value in flight.reduced().values()]


def test_a_campaign_of_measures_keeps_no_log():
    """Runs that would log more than any machine has: the same numbers as of a run that logs, and no array that grows."""
    measures = {"high": {"largest": "plant.truth.angle", "of": "norm"}, "worn": {"integral": "controller.command.effort",
                                                                                "of": "squared"}}
    together = SideBySide()
    cases = Cases(swept(RANDOM, measures=measures, metrics=None), Batch(LANES, together.advance))
    rows = cases.rows(range(LANES + 1))
    prepared, = cases._prepared.values()
    assert prepared.plan == {} and together.report.side_by_side == LANES
    recording = CompiledRun(cases._variation.case(LANES)[0]).run()
    expected = [one.of(recording[one.topic], cases.scenario.epoch_ns, cases.scenario.duration_ns)
                for one in cases.scenario.measures]
    assert list(map(bits, rows[LANES].metrics.values())) == list(map(bits, expected))
    sizes = []
    for seconds in (1.0, 1e9):
        longer = Cases(swept(RANDOM, measures=measures, metrics=None, duration_s=seconds))
        flight = longer._ready(*reversed(longer._variation.case(0))).flight(longer._variation.case(0)[0])
        sizes.append(sum(array.nbytes for array in flight.arrays.values()))
    assert sizes[0] == sizes[1]


def test_a_function_and_measures_together():
    """What a function reads is logged, what measures read is not."""
    measures = {"rate": {"largest": "plant.truth.rate", "of": "absolute"}, "noise": {"largest": "sensor.imu.angular_velocity"}}
    cases = Cases(swept(RANDOM, measures=measures, metrics="tests.requirements.swing_metrics:compute"))
    rows = cases.rows(range(3))
    assert [row.status for row in rows] == ["ok"] * 3 and cases._asked == {"toy/truth"}
    assert all(row.metrics["rate"] == row.metrics["rate_max"] > 0 and row.metrics["noise"] > 0 for row in rows)
    assert toy.SENSED.topic not in {cases.scenario.graph.signal(*output).topic
                                    for prepared in cases._prepared.values() for output in prepared.plan}
