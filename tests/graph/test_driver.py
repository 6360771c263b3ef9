"""The driver: which numbers are not finite, when slower outputs are checked, and the memory of a run under way."""

import ctypes
import math

import numpy as np
import pytest

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_graph.engines import driver, parts
from flight_graph.engines.addresses import address
from flight_graph.engines.compiled import CompiledRun
from flight_graph.engines.schedule import Schedule, finite_runs, stamp_offset
from flight_graph.errors import RunStopped
from flight_graph.graphs.scenario import Scenario
from flight_math import kernel
from msg_schemas.qos import Role
from msg_schemas.signal import Signal
from tests.graph import toy

pytestmark = pytest.mark.xdist_group("executors")
IMAGE = Signal("part/battery", "sensor_msgs/msg/BatteryState", Role.TELEMETRY, {"header.frame_id": "part"},
               may_be_nonfinite=("current",))


class WriterParameters(Parameters):
    bad: float = field(0.0)
    fires: int = field(0, doc="firing from which on the value is bad")
    place: int = field(0)


class WriterState(State):
    count: int


@kernel
def write(t_ns, p, x, battery):
    value = 0.0
    if p.bad < 0.0:
        value = -math.inf
    elif p.bad > 0.0:
        value = math.nan if p.bad > 1.5 else math.inf
    if x.count < p.fires:
        value = 1e300
    if p.place == 0:
        battery.voltage = value if x.count >= p.fires else 1.0
    else:
        battery.current = value
    x.count += 1


class Writer(Component):
    """Writes single precision floats."""

    parameters, state = WriterParameters, WriterState
    outputs = {"battery": IMAGE}
    kernel = write


class SlowWriter(Writer):
    """The same, published at every fourth firing."""

    output_rate_hz = {"battery": 25.0}


def run(name="Writer", **parameters):
    """A run of 0.2 s at 100 Hz."""
    return CompiledRun(Scenario({"name": "n", "title": "t", "duration_s": 0.2, "components": {
        "part": {"use": f"{__file__}:{name}", "parameters": parameters}}}, "n.yaml")).run()


@pytest.mark.parametrize("bad, word", [(1.0, "inf"), (-1.0, "-inf"), (2.0, "nan")])
def test_single_precision_that_is_not_finite_stops_a_run(bad, word):
    with pytest.raises(RunStopped, match=rf"part stopped at t = 0.03 s: its output battery.voltage is {word}; only finite "
                       "numbers are published") as stop:
        run(bad=bad, fires=3)
    assert stop.value.reason == "nonfinite" and stop.value.t_ns == 30_000_000
    assert stop.value.recording["part/battery"]["voltage"].tolist() == [1.0, 1.0, 1.0]


def test_a_field_that_may_be_nonfinite_may():
    assert np.isnan(run(bad=2.0, place=1)["part/battery"]["current"]).all()


def test_a_slower_output_is_checked_when_it_is_published():
    """The fifth firing writes NaN; the next message is that of the ninth, t = 0.08 s."""
    with pytest.raises(RunStopped, match="part stopped at t = 0.08 s") as stop:
        run("SlowWriter", bad=2.0, fires=5)
    assert stop.value.recording.tracks[0].stamps_ns.tolist() == [0, 40_000_000]


@pytest.mark.parametrize("bits, finite", [
    (0x0000000000000000, True), (0x8000000000000000, True), (0x0000000000000001, True), (0x7FEFFFFFFFFFFFFF, True),
    (0xFFEFFFFFFFFFFFFF, True), (0x7FF0000000000000, False), (0xFFF0000000000000, False), (0x7FF8000000000000, False),
    (0xFFF8000000000000, False), (0x7FF0000000000001, False), (0xFFFFFFFFFFFFFFFF, False), (0x7FFFFFFFFFFFFFFF, False),
    (0x3FF0000000000000, True), (0x0010000000000000, True)])
def test_finite_by_bits(bits, finite):
    """Every place of a record, each number alone; against IEEE 754: an exponent of ones is inf or NaN."""
    schedule = Schedule.of(CompiledRun(Scenario(toy.scenario(), "toy.yaml")).graph, {})
    arrays = schedule.memory(0)
    imu = arrays["O_sensor.imu"].view("u1").reshape(-1)
    runs = finite_runs(toy.SENSED)
    assert {size for _, _, size in runs} == {8} and sum(n for _, n, _ in runs) == 4 + 9 + 3 + 9 + 3 + 9 and math.isfinite(_float(bits)) == finite
    for start, n, _ in runs:
        for i in range(n):
            imu[start:start + 8 * n] = 0
            imu[start + 8 * i:start + 8 * i + 8] = np.frombuffer(bits.to_bytes(8, "little"), "u1")
            found = all(np.isfinite(imu[a:a + 8 * b].view("<f8")).all() for a, b, _ in runs)
            assert found == finite
            assert _driver_says(schedule, arrays) == finite
        imu[start:start + 8 * n] = 0


def _float(bits):
    return float(np.frombuffer(bits.to_bytes(8, "little"), "<f8")[0])


def _driver_says(schedule, arrays):
    """Whether the driver lets the sensor's record pass; the part that it calls does nothing."""
    nothing = {node: {part: NOTHING for part in ("start", "kernel", "output", "update")} for node in schedule.graph.nodes}
    tables = driver.Tables(schedule, arrays, nothing)
    number = [firing.node for firing in schedule.firings].index("sensor")
    return driver.CODE.function("fire")(address(tables.firings) + number * driver.FIRING.itemsize, 0, 0, 0) == 0


_IDLE = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 4)(lambda *_: None)
NOTHING = parts.Code(ctypes.cast(_IDLE, ctypes.c_void_p).value, {})


def test_stamps_are_where_the_message_has_them():
    record = toy.SENSED.new()[1]
    record["header"]["stamp"]["sec"], record["header"]["stamp"]["nanosec"] = -2, 7
    at = stamp_offset(toy.SENSED)
    assert record.view("u1").reshape(-1)[at:at + 8].tobytes() == (-2).to_bytes(4, "little", signed=True) + (7).to_bytes(4, "little")


def test_a_run_under_way_is_its_arrays():
    """Stopped after some tick and taken on: the same bytes as in one go."""
    scenario = Scenario(toy.scenario(duration_s=0.5), "toy.yaml")
    whole = CompiledRun(scenario).run()
    made = CompiledRun(scenario)
    flight = made.start(100)
    flight.advance(37)
    assert flight.tick == 37 and len(flight.tracks()[0].records) == 37
    flight.advance(100)
    for one, other in zip(flight.tracks(), whole.tracks):
        assert one.records.tobytes() == other.records.tobytes() and (one.stamps_ns == other.stamps_ns).all()
