"""Every fault of numbers, at every place that allows it, against what NumPy makes of a run without it.

The chain is open: outside of what a fault changes, and outside of its window, nothing may differ by a bit.
"""

import struct

import numpy as np
import pytest

from tests.faults import chain
from tests.faults.chain import Flown, data, fault

pytestmark = pytest.mark.xdist_group("faults")
T = np.arange(100) * 0.01  # [s] of the gauge
INSIDE = (T >= 0.2) & (T < 0.5)
WINDOW = {"from_s": 0.2, "until_s": 0.5}


@pytest.fixture(scope="module")
def clean():
    return Flown()


def flip(value, bit):
    """A float64 with one bit of its memory flipped."""
    return struct.unpack("<d", struct.pack("<Q", struct.unpack("<Q", struct.pack("<d", value))[0] ^ 1 << bit))[0]


def rounded(values, step):
    """The nearest multiples, halves away from zero."""
    return step * np.sign(values) * np.floor(np.abs(values) / step + 0.5)


TYPES = {  # type and keys -> what is expected of values (n, 3) in the window, by the time [s] since the onset
    "bias": ({"value": 0.25}, lambda v, s: v + 0.25),
    "ramp": ({"type": "bias", "value": 0.25, "ramp_s": 0.1}, lambda v, s: v + 0.25 * np.minimum(s / 0.1, 1.0)),
    "drift": ({"value": -2.0}, lambda v, s: v - 2.0 * s),
    "scale": ({"value": 0.4}, lambda v, s: 0.4 * v),
    "fading": ({"type": "scale", "value": 0.0, "ramp_s": 0.2}, lambda v, s: v * (1.0 - np.minimum(s / 0.2, 1.0))),
    "stuck": ({"value": 5.5}, lambda v, s: np.full_like(v, 5.5)),
    "stuck at onset": ({"type": "stuck"}, lambda v, s: np.broadcast_to(v[:1], v.shape)),
    "quantise": ({"value": 0.05}, lambda v, s: rounded(v, 0.05)),
    "saturate": ({"value": 0.04}, lambda v, s: np.clip(v, -0.04, 0.04)),
    "off": ({}, lambda v, s: np.zeros_like(v)),
}
SIGNALS = {  # place -> topics whose fields it changes, and its rate [Hz]
    "gauge.imu.angular_velocity": ({"chain/imu": "angular_velocity", "chain/seen": "rate", "chain/echo": "rate"}, 100),
    "follower <- imu.angular_velocity": ({"chain/echo": "rate"}, 50),
    "bystander <- imu.angular_velocity": ({"chain/seen": "rate"}, 100),
}


def same_but(flown, clean, changed):
    """All that was recorded is the same, but for the named fields of topics (and the sums of what the follower sees)."""
    for topic in ("chain/truth", "chain/imu", "chain/range", "chain/echo", "chain/seen"):
        assert flown.ms(topic) == clean.ms(topic)
        for name in clean[topic].dtype.names:
            if name not in changed.get(topic, ()):
                assert (flown[topic][name] == clean[topic][name]).all(), (topic, name)


@pytest.mark.parametrize("place", SIGNALS)
@pytest.mark.parametrize("name", TYPES)
def test_signals(clean, name, place):
    keys, law = TYPES[name]
    flown = Flown([fault(keys.get("type", name), place, **{k: v for k, v in keys.items() if k != "type"}, **WINDOW)])
    changed, rate = SIGNALS[place]
    for topic, column in changed.items():
        step = 1 if topic != "chain/echo" else 2
        t, inside, before = T[::step], INSIDE[::step], clean[topic][column]
        found = flown[topic][column]
        assert (found[~inside] == before[~inside]).all()
        np.testing.assert_allclose(found[inside], law(before[inside], t[inside, None] - 0.2), rtol=0, atol=1e-14)
        assert not np.array_equal(found[inside], before[inside])
    sums = {"total", "held"} if "chain/echo" in changed else set()
    same_but(flown, clean, {topic: {column, *sums} for topic, column in changed.items()} | (
        {"chain/echo": {"rate", *sums}} if sums else {}))


def test_one_number_of_a_vector(clean):
    flown = Flown([fault("bias", "gauge.imu.angular_velocity[1]", value=1.0)])
    expected = clean["chain/imu"]["angular_velocity"] + [0.0, 1.0, 0.0]
    assert (flown["chain/imu"]["angular_velocity"] == expected).all()
    flown = Flown([fault("stuck", "gauge.imu.angular_velocity_covariance[4]", value=2.0, from_s=0.5)])
    assert (flown["chain/imu"]["angular_velocity_covariance"] == np.where(T >= 0.5, 2.0, 0.0)[:, None] * (np.arange(9) == 4)).all()


def test_readers_sum_what_they_see(clean):
    """The follower's state sums up the broken number, so it keeps what the fault did to it."""
    flown = Flown([fault("spike", "follower <- imu.angular_velocity[0]", value=3.0, at_s=0.4)])
    seen = clean["chain/echo"]["rate"][:, 0] + 3.0 * (np.arange(50) == 20)
    np.testing.assert_allclose(flown["chain/echo"]["total"], 7.0 + np.cumsum(seen), rtol=0, atol=1e-12)
    assert (flown["chain/seen"]["rate"] == clean["chain/seen"]["rate"]).all()


# -- noise -------------------------------------------------------------------------------------------------------------
def noise(seed=3, id="it", place="gauge.imu.angular_velocity", **keys):
    return Flown([fault("noise", place, id, value=0.2, **keys)], duration_s=20.0, seed=seed)


def test_noise_is_white_gaussian_and_follows_seed_and_name():
    clean = Flown(duration_s=20.0)["chain/imu"]["angular_velocity"]
    draws = (noise()["chain/imu"]["angular_velocity"] - clean) / 0.2
    count = draws.size  # 6000
    assert abs(draws.mean()) < 4.0 / np.sqrt(count)
    assert abs(draws.var() - 1.0) < 4.0 * np.sqrt(2.0 / count)
    assert abs((draws**4).mean() - 3.0) < 4.0 * np.sqrt(96.0 / count)
    for lagged in (draws[1:] * draws[:-1], draws[:, 0] * draws[:, 1]):  # neither in time nor between axes
        assert abs(lagged.mean()) < 4.0 / np.sqrt(lagged.size)
    again, seed, name = noise(), noise(seed=4), noise(id="other")
    assert again["chain/imu"].tobytes() == noise()["chain/imu"].tobytes()
    for other in (seed, name):
        assert not np.isin(other["chain/imu"]["angular_velocity"], again["chain/imu"]["angular_velocity"]).any()


def test_noise_of_an_input_is_that_of_its_reader_alone():
    clean, flown = Flown(duration_s=20.0), noise(place="bystander <- imu.angular_velocity[2]")
    draws = (flown["chain/seen"]["rate"] - clean["chain/seen"]["rate"])
    assert abs(draws[:, 2].std() - 0.2) < 0.02 and not draws[:, :2].any()
    assert (flown["chain/imu"]["angular_velocity"] == clean["chain/imu"]["angular_velocity"]).all()


# -- float32, whole numbers, bits --------------------------------------------------------------------------------------
SLOW = np.arange(20) * 0.05  # [s] of the distance


@pytest.mark.parametrize("name", TYPES)
def test_float32_at_a_slow_output(clean, name):
    """Computed in float64 and rounded once."""
    keys, law = TYPES[name]
    flown = Flown([fault(keys.get("type", name), "gauge.range.range", **{k: v for k, v in keys.items() if k != "type"}, **WINDOW)])
    before, inside = clean["chain/range"]["range"], (SLOW >= 0.2) & (SLOW < 0.5)
    assert before.dtype == np.float32 and inside.sum() == 6
    found = flown["chain/range"]["range"]
    assert (found[~inside] == before[~inside]).all()
    expected = law(before[inside].astype(float), SLOW[inside] - 0.2)
    np.testing.assert_allclose(found[inside], expected.astype(np.float32), rtol=1.2e-7, atol=0)
    height = flown["chain/echo"]["height"]  # at 50 Hz, by the newest distance
    newest = np.searchsorted(flown.ms("chain/range"), flown.ms("chain/echo"), "right") - 1
    assert (height == found[newest].astype(float)).all()


@pytest.mark.parametrize("bit", [0, 22, 23, 30, 31])
def test_bits_of_float32(clean, bit):
    flown = Flown([fault("bit_flip", "gauge.range.range", bit=bit, at_s=0.3)])
    expected = clean["chain/range"]["range"].copy()
    expected.view("<u4")[6] ^= np.uint32(1 << bit)
    assert flown["chain/range"]["range"].tobytes() == expected.tobytes()


@pytest.mark.parametrize("bit", range(8))
def test_bits_of_a_byte(clean, bit):
    flown = Flown([fault("bit_flip", "gauge.range.radiation_type", bit=bit, at_s=0.3)])
    assert flown["chain/range"]["radiation_type"].tolist() == [200 ^ (1 << bit) if n == 6 else 200 for n in range(20)]


@pytest.mark.parametrize("bit", [0, 7, 8, 31, 51, 52, 60, 63])
@pytest.mark.parametrize("place", ["gauge.imu.angular_velocity[2]", "bystander <- imu.angular_velocity[2]"])
def test_bits_of_float64(clean, place, bit):
    flown = Flown([fault("bit_flip", place, bit=bit, at_s=0.37)])
    topic, column = ("chain/imu", "angular_velocity") if "gauge" in place else ("chain/seen", "rate")
    expected = clean[topic][column].copy()
    expected[37, 2] = flip(expected[37, 2], bit)
    assert flown[topic][column].tobytes() == expected.tobytes()


# -- state -------------------------------------------------------------------------------------------------------------
def state(place, type, **keys):
    return Flown([fault(type, f"follower.state.{place}", **keys)])["chain/echo"]


def test_state_spike_stays_where_nothing_takes_it_back(clean):
    before = clean["chain/echo"]["total"]
    found = state("total", "spike", value=3.0, at_s=0.4)["total"]
    assert (found[:20] == before[:20]).all()
    np.testing.assert_allclose(found[20:], before[20:] + 3.0, rtol=0, atol=1e-12)


def test_state_bit_flip_of_a_real_and_of_a_whole_number(clean):
    count = clean["chain/echo"]["count"]
    assert count.tolist() == list(range(101, 151))
    found = state("count", "bit_flip", bit=40, at_s=0.4)["count"]  # 120 is in memory then
    assert found.tolist() == [value + (2**40 if n >= 20 else 0) for n, value in enumerate(count)]
    rate = clean["chain/echo"]["rate"][:, 0]
    total = np.float64(clean["chain/echo"]["total"][19])
    found = state("total", "bit_flip", bit=55, at_s=0.4)["total"]
    np.testing.assert_allclose(found[20:], flip(total, 55) + np.cumsum(rate[20:]), rtol=1e-13, atol=0)


def test_state_stuck_off_and_saturate(clean):
    """The kernel sees the altered state, and adds to it."""
    rate = clean["chain/echo"]["rate"]
    inside = np.arange(50) >= 20
    for keys, held in (({"type": "stuck", "value": 1.5}, 1.5), ({"type": "off"}, 0.0)):
        found = state("total", from_s=0.4, **keys)["total"]
        np.testing.assert_allclose(found[inside], held + rate[inside, 0], rtol=0, atol=1e-14)
    found = state("held", "stuck", from_s=0.4)["held"]
    onset = clean["chain/echo"]["held"][19]
    np.testing.assert_allclose(found[inside], onset + rate[inside], rtol=0, atol=1e-14)
    limited, expected = 7.0, []
    for number, one in enumerate(rate[:, 0]):
        limited = (min(limited, 7.1) if number >= 20 else limited) + one
        expected.append(limited)
    np.testing.assert_allclose(state("total", "saturate", value=7.1, from_s=0.4)["total"], expected, rtol=0, atol=1e-12)


def test_one_entry_of_a_vector_in_a_state(clean):
    found = state("held[1]", "spike", value=-1.0, at_s=0.4)["held"]
    expected = clean["chain/echo"]["held"] - np.outer(np.arange(50) >= 20, [0.0, 1.0, 0.0])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


# -- parameters --------------------------------------------------------------------------------------------------------
def test_parameters_come_back_as_they_were(clean):
    wave = clean["chain/imu"]["angular_velocity"]
    for keys, gain in (({"type": "bias", "value": 0.5}, 1.5), ({"type": "scale", "value": 0.2}, 0.2), ({"type": "off"}, 0.0),
                       ({"type": "stuck", "value": 3.0}, 3.0), ({"type": "stuck"}, 1.0),
                       ({"type": "drift", "value": 2.0}, 1.0 + 2.0 * (T - 0.2))):
        found = Flown([fault(at="gauge.parameters.gain", **keys, **WINDOW)])["chain/imu"]["angular_velocity"]
        expected = np.where(INSIDE[:, None], wave * np.reshape(np.broadcast_to(gain, 100), (100, 1)), wave)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
        assert (found[~INSIDE] == wave[~INSIDE]).all()


def test_one_entry_of_a_vector_parameter_and_a_ramp(clean):
    found = Flown([fault("bias", "gauge.parameters.offset[2]", value=0.5, ramp_s=0.1, **WINDOW)])["chain/imu"]["angular_velocity"]
    expected = clean["chain/imu"]["angular_velocity"].copy()
    expected[INSIDE, 2] += 0.5 * np.minimum((T[INSIDE] - 0.2) / 0.1, 1.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_parameters_of_both_parts_of_a_plant(clean):
    """The world's rate: its output says it, and its update turns by it, in the same ticks."""
    flown = Flown([fault("scale", "world.parameters.rate[0]", value=3.0, **WINDOW)])
    rate = np.where(INSIDE, 0.9, 0.3)
    np.testing.assert_allclose(flown["chain/truth"]["rate"][:, 0], rate, rtol=1e-15)
    angle = np.concatenate([[0.0], np.cumsum(0.01 * rate)[:-1]])
    np.testing.assert_allclose(flown["chain/truth"]["angle"][:, 0], angle, rtol=0, atol=1e-14)
    assert (flown["chain/truth"]["angle"][:, 1:] == clean["chain/truth"]["angle"][:, 1:]).all()


def test_state_of_a_plant():
    flown = Flown([fault("spike", "world.state.angle[1]", value=1.0, at_s=0.5)])
    np.testing.assert_allclose(flown["chain/truth"]["angle"][:, 1], -0.2 * T + (T >= 0.5), rtol=0, atol=1e-13)


def test_an_input_that_nobody_feeds(clean):
    found = Flown([fault("stuck", "follower <- aid.push", value=4.0, **WINDOW)])["chain/echo"]
    assert found["push"].tolist() == [4.0 if 0.2 <= t < 0.5 else 0.0 for t in T[::2]]


# -- several at a place ------------------------------------------------------------------------------------------------
def test_faults_of_one_number_act_in_the_order_of_the_file(clean):
    wave = clean["chain/imu"]["angular_velocity"][:, 0]
    bias = fault("bias", "gauge.imu.angular_velocity[0]", "b", value=1.0)
    scale = fault("scale", "gauge.imu.angular_velocity[0]", "s", value=2.0)
    assert (Flown([bias, scale])["chain/imu"]["angular_velocity"][:, 0] == 2.0 * (wave + 1.0)).all()
    assert (Flown([scale, bias])["chain/imu"]["angular_velocity"][:, 0] == 2.0 * wave + 1.0).all()


def test_a_fault_of_an_output_comes_before_one_of_its_reader(clean):
    wave = clean["chain/seen"]["rate"][:, 0]
    one = fault("scale", "bystander <- imu.angular_velocity[0]", "reader", value=2.0)
    other = fault("bias", "gauge.imu.angular_velocity[0]", "sender", value=1.0)
    flown = Flown([one, other])
    assert (flown["chain/seen"]["rate"][:, 0] == 2.0 * (wave + 1.0)).all()
    assert (flown["chain/echo"]["rate"][:, 0] == wave[::2] + 1.0).all()


def test_names_that_run_into_each_other_are_two():
    """Node ``n`` with an output ``x_y`` and a fault ``x_it``, beside node ``n_x`` with an output ``y`` and a fault ``it``."""
    found = data([fault("stuck", "n.x_y.level[0]", "x_it", from_s=0.2, value=7.0),
                  fault("stuck", "n_x.parameters.level", "it", value=9.0, from_s=0.6)])
    found["components"] |= {"n": {"use": f"{chain.__file__}:Spare"}, "n_x": {"use": f"{chain.__file__}:Other"}}
    flown = Flown(**found)
    np.testing.assert_array_equal(flown["chain/spare"]["level"], np.where(T[:, None] >= 0.2, [7.0, 2.0, 3.0], [1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(flown["chain/other"]["level"], np.where(T[:, None] >= 0.6, [9.0] * 3, [1.0, 2.0, 3.0]))
