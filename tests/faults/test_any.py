"""Any list of faults and monitors: it is refused with a sentence, or it flies; and both engines fly it alike."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flight_graph.errors import FlightError
from flight_graph.faults.fault_types import TYPES
from flight_graph.graphs.scenario import Scenario
from tests.faults import chain
from tests.faults.engines import fly, plainly

pytestmark = pytest.mark.xdist_group("faults")
SLOW = {"deadline": None, "derandomize": True, "suppress_health_check": list(HealthCheck)}
PLACES = ("gauge.imu.angular_velocity[0]", "gauge.imu.angular_velocity", "gauge.imu.orientation", "gauge.range.range", "gauge.range.radiation_type",
          "follower <- imu.angular_velocity[2]", "follower <- range.range", "follower <- aid.push", "bystander <- imu.linear_acceleration", "follower.state.total",
          "follower.state.held", "follower.state.count", "world.state.angle[0]", "gauge.parameters.gain", "gauge.parameters.offset[1]", "world.parameters.rate",
          "gauge.imu", "gauge.range", "follower.echo", "follower <- imu", "follower <- range", "bystander <- imu", "manager <- request", "gauge", "follower", "bystander",
          "manager", "monitors", "world", "monitors.status.fast", "monitors.status", "gauge.nothing", "world.truth", "", "follower.echo.rate[7]")
CONDITIONS = ("t > 0.05", "imu.angular_velocity[0] > 0.01", "age(gauge.range) > 0.03", "age(follower.echo) > 0.03", "echo.count == 103", "faults.faults.f0 > 0",
              "monitors.status.fast > 0", "range.range / 0 > 1", "gauge.range.radiation_type < 250 and not t < 0.02", "nothing > 1", "abs(follower.echo.total) > 7", "1")
SECONDS = st.sampled_from([0.0, 0.01, 0.013, 0.02, 0.05, 0.1, 0.5, 1e9, -1.0])
NUMBERS = st.one_of(st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, 1e-300, 1e300, -1e300, 1.7e308, float("nan"), float("inf")]), st.floats(-10, 10))
KEYS = {"value": NUMBERS, "ramp_s": SECONDS, "bit": st.integers(-1, 65), "ticks": st.integers(0, 5), "every": st.integers(1, 5),
        "probability": st.sampled_from([0.0, 0.3, 0.9, 1.0, 1.1]), "from_s": SECONDS, "until_s": SECONDS, "for_s": SECONDS, "at_s": SECONDS, "every_s": SECONDS,
        "unit": st.sampled_from(["gauge", "", "a b"]), "when": st.sampled_from(CONDITIONS)}


@st.composite
def sensible(draw, number):
    """An entry with the keys that its type takes, and needs; often one that makes sense."""
    name = draw(st.sampled_from(list(TYPES)))
    kind = TYPES[name]
    keys = {*kind.needs, *draw(st.lists(st.sampled_from(kind.takes), max_size=2))}
    return {"id": f"f{number}", "at": draw(st.sampled_from(PLACES)), "type": name, **{key: draw(KEYS[key]) for key in keys}}


def blocks(most):
    return st.integers(0, most).flatmap(lambda count: st.tuples(*[sensible(number) for number in range(count)]).map(list))


MONITORS = {"rate_hz": 50, "watchpoints": [{"id": "fast", "when": "imu.angular_velocity[0] > 0.02"}, {"id": "old", "stale": "gauge.range", "after_s": 0.04}],
            "actionpoints": [{"id": "act", "when": "fast or old", "in_a_row": 2, "act": "each", "mode": {"manager": "hold"}, "set": {"gauge.gain": 2.0}}]}


def flown(faults, **changes):
    """What becomes of a scenario: a sentence, or its digests."""
    data = chain.data(faults, duration_s=0.15, monitors=MONITORS, **changes)
    try:
        return fly(data)
    except FlightError as error:
        assert str(error).startswith("chain.yaml: faults") and "\n" not in str(error)
        return str(error)


@given(blocks(4))
@settings(max_examples=60, **SLOW)
def test_a_sentence_or_a_run(faults):
    flown(faults)


@given(blocks(6), st.sampled_from([{}, {"max_rate_hz": 30}]))
@settings(max_examples=12, **SLOW)
def test_both_engines_fly_alike(faults, record):
    """Of a block, those faults that are taken by themselves, as far as they do not contradict each other."""
    taken = []
    for one in faults:
        try:
            Scenario(chain.data([*taken, one], monitors=MONITORS), "chain.yaml")
            taken.append(one)
        except FlightError:
            pass
    data = chain.data(taken, duration_s=0.15, monitors=MONITORS, record=record)
    assert fly(data) == plainly(data)


JUNK = st.recursive(st.one_of(st.none(), st.booleans(), st.integers(-3, 10**20), st.floats(), st.text(max_size=8), st.sampled_from(PLACES), st.sampled_from(CONDITIONS)),
                    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=6), inner, max_size=3)), max_leaves=6)


@given(st.one_of(JUNK, st.lists(st.dictionaries(st.sampled_from(["id", "at", "type", *KEYS]), st.one_of(JUNK, st.sampled_from(list(TYPES))), max_size=6), max_size=3)))
@settings(max_examples=60, **SLOW)
def test_junk_is_refused(block):
    data = chain.data()
    data["faults"] = block
    try:
        Scenario(data, "chain.yaml")
    except FlightError as error:
        assert "chain.yaml: faults" in str(error)


@given(st.dictionaries(st.sampled_from(["rate_hz", "watchpoints", "actionpoints", "x"]), st.one_of(
    JUNK, st.lists(st.dictionaries(st.sampled_from(["id", "when", "stale", "after_s", "mode", "set", "in_a_row", "blames"]), JUNK, max_size=4), max_size=2)), max_size=4))
@settings(max_examples=60, **SLOW)
def test_junk_of_monitors_is_refused(block):
    data = chain.data()
    data["monitors"] = block
    try:
        Scenario(data, "chain.yaml")
    except FlightError as error:
        assert "chain.yaml: monitors" in str(error)


@given(st.text(st.sampled_from("tagemuir.[]()0123456789+-*/<>=! andornoabsx_,'\"\\\n"), max_size=40))
@settings(max_examples=80, **SLOW)
def test_any_text_is_a_condition_or_refused(text):
    try:
        chain.scenario([chain.fault("bias", PLACES[0], value=1.0, when=text)])
    except FlightError as error:
        assert str(error).startswith("chain.yaml: faults.it.when: ")


@given(st.text(st.sampled_from("gaufolwer.imustp[]0129<- _"), max_size=30))
@settings(max_examples=80, **SLOW)
def test_any_text_is_a_place_or_refused(text):
    try:
        chain.scenario([chain.fault("stuck", text, value=1.0)])
    except FlightError as error:
        assert str(error).startswith("chain.yaml: faults.it")
