"""When a fault acts: windows exactly on ticks, chance, conditions, and what the report says of it."""

import numpy as np
import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import RunStopped
from flight_graph.graphs.scenario import Scenario
from tests.faults import chain
from tests.faults.chain import Flown, fault

pytestmark = pytest.mark.xdist_group("faults")
TICKS = range(0, 1000, 10)  # [ms]
PLACE = "gauge.imu.linear_acceleration[0]"  # the angle, 0.3 rad/s t


def active(type="bias", place=PLACE, **keys):
    """Ticks [ms] in which a bias of 100 acts, and what the report says: [(time [ms], active)]."""
    flown = Flown([fault(type, place, value=100.0, **keys)])
    found = flown["chain/imu"]["linear_acceleration"][:, 0] > 50.0
    return np.array(TICKS)[found].tolist(), list(zip(flown.ms("faults"), flown["faults"]["it"].tolist()))


@pytest.mark.parametrize("keys, expected", [
    ({}, TICKS),
    ({"from_s": 0.2}, range(200, 1000, 10)),
    ({"until_s": 0.2}, range(0, 200, 10)),
    ({"from_s": 0.2, "until_s": 0.21}, [200]),
    ({"from_s": 0.201, "until_s": 0.209}, []),
    ({"from_s": 0.201, "until_s": 0.2100001}, [210]),
    ({"from_s": 0.2, "for_s": 0.05}, range(200, 250, 10)),
    ({"for_s": 0.05}, range(0, 50, 10)),
    ({"from_s": 0.2, "until_s": 0.65, "every_s": 0.2, "for_s": 0.04}, [*range(200, 240, 10), *range(400, 440, 10), *range(600, 640, 10)]),
    ({"every_s": 0.25}, [0, 250, 500, 750]),
    ({"from_s": 0.1, "every_s": 0.33}, [100, 430, 760]),
    ({"from_s": 0.105, "every_s": 0.3}, [110, 410, 710]),
    ({"at_s": 0.2}, [200]),
    ({"at_s": 0.201}, [210]),
    ({"at_s": 0.999}, []),
    ({"at_s": 5.0}, []),
    ({"from_s": 5.0}, []),
    ({"at_s": 0.0}, [0]),
], ids=str)
def test_windows_of_a_lasting_fault(keys, expected):
    found, said = active(**keys)
    assert found == list(expected)
    changes, was = [], None
    for t in TICKS:
        if (t in found) != was:
            was = t in found
            changes.append((t, float(was)))
    assert said == changes


@pytest.mark.parametrize("keys, expected", [
    ({"at_s": 0.2}, [200]),
    ({"from_s": 0.2}, [200]),
    ({"from_s": 0.201}, [210]),
    ({"every_s": 0.3}, [0, 300, 600, 900]),
    ({"from_s": 0.2, "until_s": 0.6, "every_s": 0.3}, [200, 500]),
    ({"when": "truth.angle[0] > 0.0899"}, [310]),  # 0.09 rad at 0.3 s, seen in the tick after
    ({"when": "truth.angle[0] > 0.0899", "until_s": 0.3}, []),
], ids=str)
def test_windows_of_an_event(keys, expected):
    assert active("spike", **keys)[0] == expected


def test_events_at_slow_outputs_inputs_and_states_are_one_firing_of_theirs():
    clean = Flown()
    for place, topic, column, period in (("gauge.range.range", "chain/range", "range", 50),
                                         ("follower <- imu.angular_velocity[0]", "chain/echo", "rate", 20)):
        flown = Flown([fault("spike", place, value=100.0, at_s=0.501)])
        changed = np.flatnonzero((flown[topic][column] != clean[topic][column]).reshape(len(flown[topic]), -1).any(axis=1))
        assert changed.tolist() == [-(-501 // period)]


@pytest.mark.parametrize("seed", [1, 2])
def test_chance_is_of_each_firing(seed):
    flown = Flown([fault("bias", PLACE, value=100.0, probability=0.25, from_s=10.0)], duration_s=50.0, seed=seed)
    hit = flown["chain/imu"]["linear_acceleration"][:, 0] > 50.0
    assert not hit[:1000].any()
    hit = hit[1000:]
    assert abs(hit.mean() - 0.25) < 4.0 * np.sqrt(0.25 * 0.75 / hit.size)
    assert abs((hit[1:] & hit[:-1]).mean() - 0.0625) < 4.0 * np.sqrt(0.0625 / hit.size)
    assert flown.ms("faults") == [0, 10_000]  # the report leaves chance out


def test_chance_differs_from_fault_to_fault():
    flown = Flown([fault("bias", f"gauge.imu.linear_acceleration[{n}]", f"it{n}", value=100.0, probability=0.5) for n in range(3)],
                  duration_s=20.0)
    hit = flown["chain/imu"]["linear_acceleration"] > 50.0
    for a, b in ((0, 1), (1, 2), (0, 2)):
        assert abs((hit[:, a] & hit[:, b]).mean() - 0.25) < 4.0 * np.sqrt(0.1875 / len(hit))


# -- conditions --------------------------------------------------------------------------------------------------------
def test_as_long_as_it_holds():
    found, said = active(when="truth.angle[0] > 0.0599 and truth.angle[0] < 0.1199")
    assert found == list(range(210, 410, 10)) and said == [(0, 0.0), (210, 1.0), (410, 0.0)]


def test_for_a_time_from_each_onset():
    """Time is read as a person writes it: at 0.3 s, t is 0.3."""
    assert active(when="t > 0.3 and t < 0.32 or t > 0.6 and t < 0.9", for_s=0.1)[0] == [*range(310, 410, 10), *range(610, 710, 10)]


def test_the_window_bounds_a_condition():
    assert active(when="truth.angle[0] > 0.0599", from_s=0.4, until_s=0.5)[0] == list(range(400, 500, 10))


def test_a_condition_reads_what_came_before_the_tick_even_of_slow_and_irregular_topics():
    slow, _ = active(when="gauge.range.range >= 10.0749 and gauge.range.range < 10.08")  # that of 0.25 s
    assert slow == list(range(260, 310, 10))
    hang = fault("hang", "gauge", "h", from_s=0.3, until_s=0.5)
    flown = Flown([hang, fault("bias", "bystander <- imu.angular_velocity[0]", "b", value=100.0, when="age(gauge.imu) > 0.0551")])
    assert [t for t, hit in zip(TICKS, flown["chain/seen"]["rate"][:, 0] > 50.0) if hit] == list(range(350, 510, 10))


def test_a_condition_reads_whole_numbers_of_every_width():
    for when in ("gauge.range.radiation_type == 200", "gauge.imu.header.stamp.sec == 946728000",
                 "gauge.imu.header.stamp.nanosec > 1000000000 * 0 + 200000000"):
        found, _ = active(when=when)
        assert found == list(range(220 if "nano" in when else 10, 1000, 10)), when


def test_the_report_may_be_read_by_a_condition_of_another_fault():
    """A second fault follows the first, a tick later."""
    first = fault("bias", PLACE, "first", value=1.0, from_s=0.2, until_s=0.4)
    second = fault("bias", "gauge.imu.angular_velocity[0]", "second", value=100.0, when="faults.faults.first > 0")
    flown = Flown([first, second])
    assert [t for t, hit in zip(TICKS, flown["chain/imu"]["angular_velocity"][:, 0] > 50.0) if hit] == list(range(210, 410, 10))


def test_a_component_above_a_kilohertz_has_a_report_that_sees_each_millisecond():
    data = chain.data([fault("bias", PLACE, value=1.0, from_s=0.011, until_s=0.013)], duration_s=0.05)
    for name in ("world", "gauge"):
        data["components"][name]["rate_hz"] = 2000
    run = CompiledRun(Scenario(data, "chain.yaml"))
    track = next(track for track in run.run().tracks if track.topic == "faults")
    assert (track.stamps_ns // 1_000_000).tolist() == [0, 11, 13]


# -- many ---------------------------------------------------------------------------------------------------------------
def test_a_thousand_faults_in_one_run():
    faults = [fault("bias", "gauge.imu.angular_velocity[0]", f"it{n}", value=2.0**-n if n < 50 else 0.0) for n in range(1000)]
    clean, flown = Flown(duration_s=0.1), Flown(faults, duration_s=0.1)
    expected = clean["chain/imu"]["angular_velocity"][:, 0]
    for n in range(50):
        expected = expected + 2.0**-n
    assert (flown["chain/imu"]["angular_velocity"][:, 0] == expected).all()
    assert all(flown["faults"][f"it{n}"].tolist() == [1.0] for n in range(1000))


def test_memory_that_a_sweep_hands_on_keeps_nothing():
    """Logs are used again by later runs of a thread: with more messages, with fewer, and with none of the kind."""
    logs, plans = {}, ([fault("duplicate", "gauge.imu")], [fault("drop", "gauge.imu", every=2)], [fault("hang", "gauge")], None)
    for faults in [*plans, *reversed(plans)]:
        again = CompiledRun(chain.scenario(faults)).run(logs=logs)
        alone = CompiledRun(chain.scenario(faults)).run()
        assert [track.topic for track in again.tracks] == [track.topic for track in alone.tracks]
        for one, other in zip(again.tracks, alone.tracks):
            assert one.records.tobytes() == other.records.tobytes() and (one.stamps_ns == other.stamps_ns).all()


# -- runs that a fault stops -------------------------------------------------------------------------------------------
def test_a_number_that_is_not_finite_ends_the_run_with_a_sentence():
    pair = [fault("bias", "gauge.imu.angular_velocity[1]", f"it{n}", value=1.7e308, from_s=0.3) for n in range(2)]
    with pytest.raises(RunStopped, match=r"^gauge stopped at t = 0.3 s: its output imu.angular_velocity\[1\] is inf") as stopped:
        Flown(pair)
    tracks = {track.topic: track for track in stopped.value.recording.tracks}
    assert len(tracks["chain/imu"].records) == 30 and tracks["faults"].records["it0"].tolist() in ([0.0], [0.0, 1.0])
    with pytest.raises(RunStopped, match=r"^gauge stopped at t = 0.3 s: its output range.range is inf"):
        Flown([fault("bias", "gauge.range.range", value=1e39, from_s=0.3)])
    with pytest.raises(RunStopped, match=r"^follower stopped at t = 0.3 s: its output echo.rate\[0\] is inf"):
        Flown([fault("bias", "follower <- imu.angular_velocity[0]", f"it{n}", value=1.7e308, from_s=0.3) for n in range(2)])
