"""Monitors: limits, counting in a row, modes and parameters a tick later, and how a run is scored."""

import numpy as np
import pytest

from flight_graph.graphs import fault_scores
from tests.faults import chain
from tests.faults.chain import Flown, fault
from tests.faults.engines import digest, plainly

pytestmark = pytest.mark.xdist_group("faults")
TICKS = list(range(0, 1000, 10))  # [ms]
NEVER = {"id": "never", "when": "imu.angular_velocity[0] > 1e9"}


def watching(*watchpoints, actionpoints=(), rate_hz=100) -> dict:
    return {"rate_hz": rate_hz, "watchpoints": list(watchpoints), "actionpoints": list(actionpoints)}


def held(flown, name) -> list[int]:
    """Ticks [ms] in which a watchpoint holds, or an actionpoint acts."""
    status = flown["monitors"][name]
    return [t for t, value in zip(flown.ms("monitors"), status) if value > 0.0]


def acts(flown, name) -> list[int]:
    return [t for t, more in zip(flown.ms("monitors"), np.diff(flown["monitors"][name], prepend=0.0)) if more > 0.0]


# -- watchpoints -------------------------------------------------------------------------------------------------------
def test_a_limit_is_seen_in_the_tick_after_the_message():
    spike = fault("spike", "gauge.imu.angular_velocity[0]", value=5.0, at_s=0.3)
    flown = Flown([spike], monitors=watching({"id": "fast", "when": "imu.angular_velocity[0] > 4"}))
    assert held(flown, "fast") == [310] and flown.ms("monitors") == TICKS
    flown = Flown([spike], monitors=watching({"id": "fast", "when": "imu.angular_velocity[0] > 4"}, rate_hz=50))
    assert held(flown, "fast") == []  # it looks at 0.3 s (that of 0.29 s) and at 0.32 s (that of 0.31 s)


@pytest.mark.parametrize("after_s", [0.005, 0.01, 0.015, 0.05, 0.1001])
@pytest.mark.parametrize("type, keys", [("drop", {}), ("hang", {})])
def test_ages(type, keys, after_s):
    """Messages of a 100 Hz topic are missing from 0.2 to 0.5 s: the newest is of 0.19 s, and is looked at before the tick."""
    place = "gauge" if type == "hang" else "gauge.imu"
    flown = Flown([fault(type, place, from_s=0.2, until_s=0.5)],
                  monitors=watching({"id": "old", "stale": "gauge.imu", "after_s": after_s}))

    def newest(t):
        return 190 if 200 <= t - 10 < 500 else t - 10

    expected = [t for t in TICKS if t > 0 and (t - newest(t)) * 1_000_000 > round(after_s * 1e9)]
    assert held(flown, "old") == expected


def test_ages_of_slow_topics_old_stamps_and_silence_from_the_start():
    slow = Flown(monitors=watching({"id": "old", "stale": "gauge.range", "after_s": 0.035}))
    assert held(slow, "old") == [t for t in TICKS if t and (t - 10) % 50 + 10 > 35]
    for type, old in (("stale", True), ("freeze", False), ("delay", False)):  # a delay of 30 ms is no age of 50 ms
        flown = Flown([fault(type, "gauge.imu", from_s=0.2, until_s=0.5, **({"ticks": 3} if type == "delay" else {}))],
                      monitors=watching({"id": "old", "stale": "gauge.imu", "after_s": 0.05}))
        assert held(flown, "old") == ([t for t in TICKS if 200 + 50 < t <= 500] if old else [])
    mute = Flown([fault("crash", "gauge")], monitors=watching({"id": "old", "stale": "gauge.imu", "after_s": 0.25}))
    assert held(mute, "old") == [t for t in TICKS if t > 250]  # never came: as old as the run


def test_an_age_of_a_reader_is_not_that_of_the_topic():
    """A reader that loses its messages does not make the topic silent."""
    flown = Flown([fault("drop", "follower <- imu", from_s=0.2)], monitors=watching({"id": "old", "stale": "gauge.imu", "after_s": 0.02}))
    assert held(flown, "old") == []


# -- actionpoints ------------------------------------------------------------------------------------------------------
BURSTS = {"every_s": 0.2, "for_s": 0.05, "from_s": 0.1}  # five ticks, then fifteen without


@pytest.mark.parametrize("in_a_row, once, each", [
    (1, [110], [110, 310, 510, 710, 910]), (5, [150], [150, 350, 550, 750, 950]), (6, [], [])])
def test_in_a_row_once_and_each(in_a_row, once, each):
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity[0]", value=9.0, **BURSTS)], monitors=watching(
        {"id": "fast", "when": "imu.angular_velocity[0] > 8"}, actionpoints=[
            {"id": "one", "when": "fast", "in_a_row": in_a_row}, {"id": "every", "when": "fast", "in_a_row": in_a_row, "act": "each"},
            {"id": "calm", "when": "not fast", "in_a_row": 15, "act": "each"}]))
    assert held(flown, "fast") == [t + n for t in (110, 310, 510, 710, 910) for n in range(0, 50, 10)]
    assert acts(flown, "one") == once and acts(flown, "every") == each
    assert flown["monitors"]["every"].tolist() == [float(sum(t >= at for at in each)) for t in TICKS]
    assert acts(flown, "calm") == [300, 500, 700, 900]  # eleven ticks in a row at the start are too few


def test_joined_watchpoints():
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity[0]", "a", value=9.0, from_s=0.2, until_s=0.5),
                   fault("stuck", "gauge.imu.angular_velocity[1]", "b", value=9.0, from_s=0.4, until_s=0.7)], monitors=watching(
        {"id": "one", "when": "imu.angular_velocity[0] > 8"}, {"id": "other", "when": "imu.angular_velocity[1] > 8"}, actionpoints=[
            {"id": name, "when": text, "act": "each"} for name, text in (
                ("both", "one and other"), ("either", "one or other"), ("first", "one and not other"), ("late", "one and t > 0.3"), ("two", "one + other > 1"))]))
    assert [acts(flown, name) for name in ("both", "either", "first", "late", "two")] == [[410], [210], [210], [310], [410]]


@pytest.mark.parametrize("rate_hz", [100, 50, 20])
def test_modes_and_parameters_are_asked_for_when_it_acts_and_taken_in_the_tick_after(rate_hz):
    """The request goes out with the act; the manager (50 Hz) reads it in the same tick, the gauge is set before its next one."""
    flown = Flown([fault("stuck", "follower <- imu.angular_velocity[1]", value=9.0, from_s=0.3)], monitors=watching(
        {"id": "fast", "when": "follower.echo.rate[1] > 8"}, rate_hz=rate_hz, actionpoints=[
            {"id": "act", "when": "fast", "mode": {"manager": "rest"}, "set": {"gauge.gain": 3.0, "gauge.offset[2]": 0.5}}]))
    clean = Flown()
    period = 1000 // rate_hz
    acted = (300 // period + 1) * period  # seen in the first look after the message of 0.3 s
    assert acts(flown, "act") == [acted]
    mode = flown["chain/mode"]
    entered = -(-acted // 20) * 20
    assert [t for t, value in zip(flown.ms("chain/mode"), mode["mode"]) if value == 2.0] == list(range(entered, 1000, 20))
    assert mode["cause"].tolist() == [-1.0 if t < entered else 0.0 for t in flown.ms("chain/mode")]
    assert mode["changes"][-1] == 1.0 and abs(mode["entered"][-1] - entered / 1000.0) < 1e-12
    request = flown["chain/mode_request"]
    assert request["requests"].tolist() == [float(t >= acted) for t in flown.ms("chain/mode_request")] and request["mode"][-1] == 2.0
    after = np.array(TICKS) > acted
    expected = clean["chain/imu"]["angular_velocity"] * np.where(after, 3.0, 1.0)[:, None] + np.outer(after, [0.0, 0.0, 0.5])
    np.testing.assert_allclose(flown["chain/imu"]["angular_velocity"], expected, rtol=0, atol=1e-14)


def test_a_parameter_may_be_set_and_broken():
    """What monitors set comes first, then what faults do to it."""
    flown = Flown([fault("scale", "gauge.parameters.gain", value=0.5, from_s=0.6)], monitors=watching(
        {"id": "always", "when": "imu.angular_velocity[0] > -9 and t > 0.3"}, actionpoints=[{"id": "act", "when": "always", "set": {"gauge.gain": 4.0}}]))
    t = np.array(TICKS)
    gain = np.where(t > 310, 4.0, 1.0) * np.where(t >= 600, 0.5, 1.0)
    np.testing.assert_allclose(flown["chain/imu"]["angular_velocity"], Flown()["chain/imu"]["angular_velocity"] * gain[:, None], rtol=0, atol=1e-14)


def test_later_requests_of_several_actionpoints():
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity[0]", value=9.0, **BURSTS)], monitors=watching(
        {"id": "fast", "when": "imu.angular_velocity[0] > 8"}, rate_hz=50, actionpoints=[
            {"id": "there", "when": "fast", "act": "each", "mode": {"manager": "hold"}},
            {"id": "back", "when": "not fast", "in_a_row": 4, "act": "each", "mode": {"manager": "nominal"}}]))
    mode, t = flown["chain/mode"], flown.ms("chain/mode")
    expected, now = [], 0.0
    fast = [f for f in (value > 0 for value in flown["monitors"]["fast"])]
    row = 0
    for one in fast:
        row = 0 if one else row + 1
        now = 1.0 if one else 0.0 if row == 4 else now
        expected.append(now)
    assert mode["mode"].tolist() == expected and t == TICKS[::2]
    assert mode["changes"][-1] == np.count_nonzero(np.diff(expected, prepend=0.0))


def test_long_names_of_actionpoints_and_of_faults_do_not_run_into_each_other():
    """Two that set the same parameter, and a fault there that is called as one of them is inside."""
    names = ["a" * 57 + end for end in ("one", "two")]
    flown = Flown([fault("scale", "gauge.parameters.gain", names[0], value=0.5, when="t > 0.8")], monitors=watching(
        {"id": "first", "when": "imu.angular_velocity[0] > -9 and t > 0.3"}, {"id": "second", "when": "imu.angular_velocity[0] > -9 and t > 0.6"},
        actionpoints=[{"id": name, "when": watch, "set": {"gauge.gain": value}} for name, watch, value in zip(names, ("first", "second"), (2.0, 5.0))]))
    t = np.array(TICKS)
    gain = np.where(t > 610, 5.0, np.where(t > 310, 2.0, 1.0)) * np.where(t > 800, 0.5, 1.0)
    np.testing.assert_allclose(flown["chain/imu"]["angular_velocity"], Flown()["chain/imu"]["angular_velocity"] * gain[:, None], rtol=0, atol=1e-14)


def test_both_engines():
    data = chain.data([fault("stuck", "gauge.imu.angular_velocity[0]", value=9.0, **BURSTS)], monitors=watching(
        {"id": "fast", "when": "imu.angular_velocity[0] > 8"}, {"id": "old", "stale": "gauge.range", "after_s": 0.02}, rate_hz=50, actionpoints=[
            {"id": "there", "when": "fast", "act": "each", "mode": {"manager": "hold"}}, {"id": "set", "when": "old and not fast", "set": {"gauge.gain": 2.0}}]))
    assert plainly(data) == digest(Flown(**data).recording)


def test_monitors_alone_change_nothing():
    """Without a fault and an act, what flies is what flies without monitors, byte for byte."""
    flown, clean = Flown(monitors=watching(NEVER, actionpoints=[
        {"id": "act", "when": "never", "set": {"gauge.gain": 2.0}, "mode": {"manager": "hold"}}])), Flown()
    for topic in ("chain/truth", "chain/imu", "chain/range", "chain/echo", "chain/seen"):
        assert flown[topic].tobytes() == clean[topic].tobytes()
    assert flown["chain/mode"]["mode"].tolist() == clean["chain/mode"]["mode"].tolist()


def test_diagnostics_say_what_acted():
    from flight_graph.recordings.recording import formatted_payload
    from msg_schemas.definitions import deserialize
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity[0]", value=9.0, from_s=0.5)], monitors=watching(
        {"id": "fast", "when": "imu.angular_velocity[0] > 8"}, actionpoints=[{"id": "act", "when": "fast", "level": "warn", "text": "too fast"}]))
    made = flown.scenario.graph.nodes["monitors"].component.formatted[0]
    status = flown["monitors"]
    for row, level, message in ((0, 0, "no actionpoint has acted"), (99, 1, "too fast")):
        said = deserialize(bytes(formatted_payload(made, status[row:row + 1])), made.type_name).status
        assert [(one.level, one.message, [(pair.key, pair.value) for pair in one.values]) for one in said] == [
            (level, message, [("fast", str(int(row == 99)))])]


# -- scores: runs made by hand -----------------------------------------------------------------------------------------
class Hand:
    """A run whose report and status are written by hand: times [ms] at which things begin and end."""

    def __init__(self, faults=(), watches=(), acts=(), blames=(), units=("gauge", "follower"), with_faults=True):
        entries = [fault("bias", "gauge.imu.angular_velocity[0]", f"f{n}", value=1.0, unit=unit) for n, unit in enumerate(units)]
        blames = blames or [[], []]
        self.scenario = chain.scenario(entries if with_faults else None, monitors=watching(
            {**NEVER, "id": "w0"}, {**NEVER, "id": "w1"}, actionpoints=[{"id": f"a{n}", "when": f"w{n}", "act": "each", "blames": one}
                                                                       for n, one in enumerate(blames)]))
        outputs = {name: self.scenario.graph.nodes[name].component.outputs for name in ("monitors",) + (("faults",) if with_faults else ())}
        self.signals = {"monitors": self._records(outputs["monitors"]["status"], {
            **{f"w{n}": [spans for number, spans in watches if number == n] for n in range(2)}})}
        for number, t in acts:
            self.signals["monitors"][f"a{number}"][t // 10:] += 1.0
        if with_faults:
            self.signals["faults"] = self._records(outputs["faults"]["faults"], {f"f{n}": [span for number, span in faults if number == n] for n in range(2)})

    def _records(self, signal, spans):
        records = signal.zeros(100)
        stamps = self.scenario.epoch_ns + np.array(TICKS) * 1_000_000
        records["header"]["stamp"]["sec"], records["header"]["stamp"]["nanosec"] = stamps // 10**9, stamps % 10**9
        for name, found in spans.items():
            for begin, end in found:
                records[name][begin // 10:end // 10] = 1.0
        return records

    @property
    def scores(self) -> dict:
        return fault_scores.scores(self.scenario, self.signals)


def test_detection_isolation_and_recovery():
    found = Hand([(0, (200, 400))], [(0, (250, 600))], [(0, 300), (1, 500)], [["gauge"], ["follower"]]).scores
    assert found == {"fault_onset_s": 0.2, "fault_detected": True, "fault_detection_delay_s": pytest.approx(0.1), "fault_detected_by": "a0",
                     "fault_isolated": True, "false_alarms": 0, "fault_recovery_s": pytest.approx(0.39)}


def test_missed():
    found = Hand([(0, (200, 400))]).scores
    assert (found["fault_detected"], found["fault_detection_delay_s"], found["fault_detected_by"], found["fault_isolated"], found["fault_recovery_s"]) == (
        False, None, None, None, 0.0)


def test_alarms_before_the_fault_are_false_and_detect_nothing():
    found = Hand([(0, (500, 600))], [(0, (100, 200))], [(0, 100), (1, 490)]).scores
    assert found["false_alarms"] == 2 and found["fault_detected"] is False and found["fault_recovery_s"] == 0.0
    found = Hand([(0, (500, 600))], [], [(0, 100), (0, 500)]).scores
    assert found["false_alarms"] == 1 and found["fault_detected"] is True and found["fault_detection_delay_s"] == 0.0


def test_isolation_is_by_the_first_that_blames():
    blamed = [["follower"], ["gauge"]]
    assert Hand([(0, (200, 400))], [], [(0, 300), (1, 400)], blamed).scores["fault_isolated"] is False
    assert Hand([(0, (200, 400))], [], [(1, 300), (0, 400)], blamed).scores["fault_isolated"] is True
    assert Hand([(1, (200, 400))], [], [(0, 300)], blamed).scores["fault_isolated"] is True  # the unit of that fault
    assert Hand([(0, (200, 400))], [], [(0, 300), (1, 400)], [[], ["gauge"]]).scores["fault_isolated"] is True
    assert Hand([(0, (200, 400))], [], [(0, 300)], [["gauge", "follower"], []]).scores["fault_isolated"] is True


def test_never_recovered_and_never_broken():
    assert Hand([(0, (200, 400))], [(1, (900, 1000))]).scores["fault_recovery_s"] is None
    assert Hand([], [(0, (100, 200))], [(0, 150)]).scores == {"fault_onset_s": None, "false_alarms": 1}
    assert Hand(with_faults=False, acts=[(0, 150), (0, 300)]).scores == {"false_alarms": 2}


def test_what_was_not_recorded_is_not_scored():
    hand = Hand([(0, (200, 400))], [], [(0, 300)])
    assert fault_scores.scores(hand.scenario, {"faults": hand.signals["faults"]}) == {"fault_onset_s": 0.2}
    assert fault_scores.scores(hand.scenario, {"monitors": hand.signals["monitors"]}) == {}
    assert fault_scores.scores(chain.scenario(), {}) == {}


def test_the_scores_of_a_run_that_flew():
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity[0]", value=9.0, from_s=0.3, until_s=0.5)], monitors=watching(
        {"id": "fast", "when": "imu.angular_velocity[0] > 8"}, actionpoints=[
            {"id": "act", "when": "fast", "in_a_row": 3, "blames": ["gauge"], "mode": {"manager": "hold"}}]))
    assert fault_scores.scores(flown.scenario, flown.recording) == {
        "fault_onset_s": 0.3, "fault_detected": True, "fault_detection_delay_s": pytest.approx(0.03), "fault_detected_by": "act",
        "fault_isolated": True, "false_alarms": 0, "fault_recovery_s": pytest.approx(0.2), "final_mode": "hold", "mode_changes": 1}
