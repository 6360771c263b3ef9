"""Faults of whole messages and of components: which messages there are, when, with which stamps, and what readers see."""

import numpy as np
import pytest

from tests.faults.chain import Flown, fault

pytestmark = pytest.mark.xdist_group("faults")
TICKS = list(range(0, 1000, 10))  # [ms] of the gauge
WINDOW = {"from_s": 0.2, "until_s": 0.5}
INSIDE = range(200, 500, 10)


@pytest.fixture(scope="module")
def clean():
    return Flown()


def rates(flown, topic="chain/imu", column="angular_velocity"):
    """Time of a message [ms] -> its numbers."""
    return dict(zip(flown.ms(topic), flown[topic][column].tolist()))


def seen_at(clean, times):
    """What the clean gauge measured at these times [ms]."""
    measured = rates(clean)
    return [measured[t] for t in times]


# -- messages of an output ---------------------------------------------------------------------------------------------
def test_drop_all(clean):
    flown = Flown([fault("drop", "gauge.imu", **WINDOW)])
    assert flown.ms("chain/imu") == [t for t in TICKS if t not in INSIDE] == flown.stamps_ms("chain/imu")
    newest = [190 if t in INSIDE else t for t in TICKS]
    assert flown["chain/seen"]["rate"].tolist() == seen_at(clean, newest)
    assert flown["chain/echo"]["rate"].tolist() == seen_at(clean, newest[::2])
    assert flown["chain/echo"]["fresh"].tolist() == [0.0 if t in INSIDE else 1.0 for t in TICKS[::2]]
    assert flown["chain/echo"]["nano"].tolist() == [t * 1e6 for t in newest[::2]]
    assert flown["chain/range"].tobytes() == clean["chain/range"].tobytes()


@pytest.mark.parametrize("every", [2, 3, 7])
def test_drop_every_kth(every):
    """Counted in the window: the k-th, the 2 k-th, ..."""
    flown = Flown([fault("drop", "gauge.imu", every=every, **WINDOW)])
    lost = list(INSIDE)[every - 1::every]
    assert flown.ms("chain/imu") == [t for t in TICKS if t not in lost]


@pytest.mark.parametrize("probability", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("place, topic", [("gauge.imu", "chain/imu"), ("bystander <- imu", "chain/seen")])
def test_drop_by_chance(place, topic, probability):
    clean, flown = (Flown(faults, duration_s=40.0) for faults in (None, [fault("drop", place, probability=probability)]))
    if topic == "chain/imu":
        lost = 4000 - len(flown[topic])
    else:
        lost = 4000 - int((flown[topic]["rate"][:, 0] == clean[topic]["rate"][:, 0]).sum())
    assert abs(lost - 4000 * probability) < 4.0 * np.sqrt(4000 * probability * (1.0 - probability))


def test_delay(clean):
    """Nothing comes for so many firings, then old messages with their old stamps; what is on its way at the end is lost."""
    flown = Flown([fault("delay", "gauge.imu", ticks=3, **WINDOW)])
    assert flown.ms("chain/imu") == [t for t in TICKS if t not in (200, 210, 220)]
    assert flown.stamps_ms("chain/imu") == [t - 30 if t in INSIDE else t for t in flown.ms("chain/imu")]
    assert flown["chain/imu"]["angular_velocity"].tolist() == seen_at(clean, flown.stamps_ms("chain/imu"))
    newest = [190 if t in (200, 210, 220) else t - 30 if t in INSIDE else t for t in TICKS]
    assert flown["chain/seen"]["rate"].tolist() == seen_at(clean, newest)


def test_delay_of_a_slow_output_counts_its_own_messages():
    flown = Flown([fault("delay", "gauge.range", ticks=2, from_s=0.3)])
    assert flown.ms("chain/range") == [t for t in range(0, 1000, 50) if t not in (300, 350)]
    assert flown.stamps_ms("chain/range") == [*range(0, 300, 50), *range(300, 900, 50)]


def test_a_delay_begins_with_an_empty_queue_each_time():
    flown = Flown([fault("delay", "gauge.imu", ticks=2, from_s=0.2, every_s=0.4, for_s=0.1)])
    lost = (200, 210, 600, 610)
    assert flown.ms("chain/imu") == [t for t in TICKS if t not in lost]
    late = {*range(220, 300, 10), *range(620, 700, 10)}
    assert flown.stamps_ms("chain/imu") == [t - 20 if t in late else t for t in flown.ms("chain/imu")]


def test_duplicate(clean):
    flown = Flown([fault("duplicate", "gauge.imu", **WINDOW)])
    assert flown.ms("chain/imu") == sorted([*TICKS, *INSIDE]) == flown.stamps_ms("chain/imu")
    assert flown["chain/imu"]["angular_velocity"].tolist() == seen_at(clean, flown.ms("chain/imu"))
    assert flown["chain/seen"].tobytes() == clean["chain/seen"].tobytes()  # readers hold the newest one
    flown = Flown([fault("duplicate", "gauge.imu", every=5, **WINDOW)])
    assert flown.ms("chain/imu") == sorted([*TICKS, *list(INSIDE)[4::5]])


def test_two_duplicates_at_once_are_one(clean):
    """A message is sent once or twice: the log has no room for more."""
    flown = Flown([fault("duplicate", "gauge.imu", f"it{n}") for n in range(5)])
    assert flown.ms("chain/imu") == sorted([*TICKS, *TICKS])
    assert flown["chain/range"].tobytes() == clean["chain/range"].tobytes()


def test_freeze_and_stale(clean):
    for type in ("freeze", "stale"):
        flown = Flown([fault(type, "gauge.imu", **WINDOW)])
        old = [200 if t in INSIDE else t for t in TICKS]
        assert flown.ms("chain/imu") == TICKS
        assert flown["chain/imu"]["angular_velocity"].tolist() == seen_at(clean, old)
        assert flown["chain/seen"]["rate"].tolist() == seen_at(clean, old)
        stamps = TICKS if type == "freeze" else old
        assert flown.stamps_ms("chain/imu") == stamps
        assert flown["chain/echo"]["nano"].tolist() == [t * 1e6 for t in stamps[::2]]
        assert flown["chain/echo"]["fresh"].tolist() == [float(t == stamp) for t, stamp in zip(TICKS, stamps)][::2]


def test_numbers_and_messages_of_one_output_act_in_the_order_of_the_file(clean):
    bias = fault("bias", "gauge.imu.angular_velocity[0]", "b", value=1.0, from_s=0.3)
    freeze = fault("freeze", "gauge.imu", "f", **WINDOW)
    wave = clean["chain/imu"]["angular_velocity"][:, 0]
    frozen = np.where([t in INSIDE for t in TICKS], wave[20], wave)
    late = np.array(TICKS) >= 300
    assert (Flown([freeze, bias])["chain/imu"]["angular_velocity"][:, 0] == frozen + late).all()
    inside = np.array([t in INSIDE for t in TICKS])
    found = Flown([bias, freeze])["chain/imu"]["angular_velocity"][:, 0]
    assert (found == np.where(inside, wave[20], wave + late)).all()


# -- messages of one input ---------------------------------------------------------------------------------------------
def test_input_drop_delay_freeze_stale_concern_one_reader(clean):
    for type, keys, newest in (
            ("drop", {}, [190 if t in INSIDE else t for t in TICKS]),
            ("delay", {"ticks": 3}, [190 if t in (200, 210, 220) else t - 30 if t in INSIDE else t for t in TICKS]),
            ("freeze", {}, [200 if t in INSIDE else t for t in TICKS]),
            ("stale", {}, [200 if t in INSIDE else t for t in TICKS])):
        flown = Flown([fault(type, "bystander <- imu", **keys, **WINDOW)])
        assert flown["chain/seen"]["rate"].tolist() == seen_at(clean, newest), type
        for topic in ("chain/imu", "chain/echo", "chain/truth"):
            assert flown[topic].tobytes() == clean[topic].tobytes()


def test_a_frozen_input_has_new_stamps_a_stale_one_has_not():
    for type in ("freeze", "stale"):
        echo = Flown([fault(type, "follower <- imu", **WINDOW)])["chain/echo"]
        assert echo["fresh"].tolist() == [float(type == "freeze" or t == 200 or t not in INSIDE) for t in TICKS[::2]]


def test_a_message_that_an_input_has_lost_stays_lost(clean):
    """The distance comes every 50 ms, the follower reads every 20 ms: each message is lost or not, once."""
    def heights(**keys):
        return Flown([fault("drop", "follower <- range", **keys)])["chain/echo"]["height"].tolist()

    def held(times):
        came = dict(zip(clean.ms("chain/range"), clean["chain/range"]["range"].astype(float).tolist()))
        return [came[t] for t in times]

    newest = [t // 50 * 50 for t in TICKS[::2]]
    assert clean["chain/echo"]["height"].tolist() == held(newest)
    assert heights(from_s=0.25, until_s=0.27) == held([200 if t == 250 else t for t in newest])  # to be read at 0.26 s
    seen, last, order = [], 0, sorted(set(newest))
    for t in newest:
        last = last if (order.index(t) + 1) % 3 == 0 else t
        seen.append(last)
    assert heights(every=3) == held(seen)


# -- components --------------------------------------------------------------------------------------------------------
def test_hang_of_a_sensor(clean):
    flown = Flown([fault("hang", "gauge", **WINDOW)])
    assert flown.ms("chain/imu") == [t for t in TICKS if t not in INSIDE]
    assert flown.ms("chain/range") == [t for t in range(0, 1000, 50) if t not in INSIDE]
    assert flown["chain/seen"]["rate"].tolist() == seen_at(clean, [190 if t in INSIDE else t for t in TICKS])
    assert flown["chain/truth"].tobytes() == clean["chain/truth"].tobytes()


def test_hang_keeps_the_state_and_restart_begins_anew(clean):
    rate = clean["chain/echo"]["rate"][:, 0]
    times = [t for t in TICKS[::2] if t not in INSIDE]
    for type, keys in (("hang", WINDOW), ("restart", {"from_s": 0.2, "for_s": 0.3})):
        flown = Flown([fault(type, "follower", **keys)])
        echo = flown["chain/echo"]
        assert flown.ms("chain/echo") == times == flown.stamps_ms("chain/echo")
        after = 25  # 0.5 s
        began = (110, 7.0 + rate[:10].sum()) if type == "hang" else (100, 7.0)
        assert echo["count"].tolist() == [*range(101, 111), *range(began[0] + 1, began[0] + 26)]
        np.testing.assert_allclose(echo["total"][10:], began[1] + np.cumsum(rate[after:]), rtol=0, atol=1e-13)
        assert flown["chain/imu"].tobytes() == clean["chain/imu"].tobytes()


def test_restart_again_and_again():
    flown = Flown([fault("restart", "follower", for_s=0.1, every_s=0.4, from_s=0.2)])
    assert flown["chain/echo"]["count"].tolist() == [*range(101, 111), *range(101, 116), *range(101, 116)]


def test_restart_at_the_start():
    flown = Flown([fault("restart", "follower", for_s=0.1)])
    assert flown.ms("chain/echo") == TICKS[10::2] and flown["chain/echo"]["count"][0] == 101


def test_a_state_that_is_stuck_is_stuck_after_a_restart_too():
    flown = Flown([fault("restart", "follower", "r", from_s=0.2, for_s=0.1), fault("stuck", "follower.state.total", "s", value=1.5)])
    echo = flown["chain/echo"]
    np.testing.assert_allclose(echo["total"] - echo["rate"][:, 0], 1.5, rtol=0, atol=1e-14)


def test_crash_is_for_good():
    flown = Flown([fault("crash", "follower", from_s=0.2)])
    assert flown.ms("chain/echo") == TICKS[:20:2]
    flown = Flown([fault("crash", "gauge", when="truth.angle[0] > 0.061 and truth.angle[0] < 0.07")])  # for a moment
    assert flown.ms("chain/imu") == [t for t in TICKS if t < 220]  # 0.3 rad/s: seen at 0.21 s, before the tick of 0.22 s
    assert flown.ms("faults")[1:] == [220]


def test_hang_of_a_component_with_other_faults():
    """While it hangs, nothing is counted; its parameters are broken again when it goes on."""
    flown = Flown([fault("hang", "gauge", "h", **WINDOW), fault("drop", "gauge.imu", "d", every=2),
                   fault("scale", "gauge.parameters.gain", "s", value=2.0)])
    fired = [t for t in TICKS if t not in INSIDE]
    assert flown.ms("chain/imu") == fired[::2]


def test_monitors_may_hang_too():
    watching = {"rate_hz": 50, "watchpoints": [{"id": "late", "when": "age(gauge.imu) > -1"}]}
    flown = Flown([fault("hang", "monitors", "late", **WINDOW)], monitors=watching)  # a watchpoint and a fault of one name
    assert flown.ms("monitors") == [t for t in TICKS[::2] if t not in INSIDE]
    assert set(flown["monitors"]["late"]) == {1.0}


# -- recordings --------------------------------------------------------------------------------------------------------
def test_thinned_recordings_take_the_messages_of_their_ticks():
    faults = [fault("drop", "gauge.imu", every=3), fault("duplicate", "gauge.range", "twice", from_s=0.5)]
    whole, thin = Flown(faults), Flown(faults, record={"max_rate_hz": 50})
    kept = [(t, row.tobytes()) for t, row in zip(whole.ms("chain/imu"), whole["chain/imu"]) if t % 20 == 0]
    assert [(t, row.tobytes()) for t, row in zip(thin.ms("chain/imu"), thin["chain/imu"])] == kept
    assert thin.ms("chain/range") == whole.ms("chain/range") == sorted([*range(0, 1000, 50), *range(500, 1000, 50)])


def test_the_report_of_faults_is_never_thinned():
    """It speaks at changes alone, and between the ticks of a thinned recording."""
    flown = Flown([fault("bias", "gauge.imu.angular_velocity[0]", value=1.0, from_s=0.21, until_s=0.23)],
                  record={"max_rate_hz": 1})
    assert flown.ms("faults") == [0, 210, 230] and flown["faults"]["it"].tolist() == [0.0, 1.0, 0.0]
    assert len(flown["chain/imu"]) == 1


def test_topics_that_are_not_recorded_change_nothing():
    faults = [fault("drop", "gauge.imu", every=3, when="bystander.seen.rate[0] > 0.05"), fault("hang", "gauge", "h", **WINDOW)]
    whole, part = Flown(faults), Flown(faults, record={"topics": ["chain/echo"]})
    assert [track.topic for track in part.recording.tracks] == ["chain/echo"]
    assert part["chain/echo"].tobytes() == whole["chain/echo"].tobytes()
