"""Counter-based noise against a pure-integer SplitMix64 and against its distributions."""

import math

import numpy as np
import pytest
import scipy.stats

from flight_math import kernel, noise

MASK = 2**64 - 1


def splitmix_finaliser(word):
    word = ((word ^ (word >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    word = ((word ^ (word >> 27)) * 0x94D049BB133111EB) & MASK
    return word ^ (word >> 31)


def integer_bits(key, tick, index):
    gamma = 0x9E3779B97F4A7C15
    word = splitmix_finaliser((key + gamma) & MASK)
    word = splitmix_finaliser((word + tick * 0xD1B54A32D192ED03 + gamma) & MASK)
    return splitmix_finaliser((word + index * 0x8CB92BA72F3D8DD7 + gamma) & MASK)


@kernel
def fill_gaussian(key, ticks, draws, out):
    for tick in range(ticks):
        for index in range(draws):
            out[tick, index] = noise.gaussian(key, tick, index)


@kernel
def fill_uniform(key, ticks, draws, out):
    for tick in range(ticks):
        for index in range(draws):
            out[tick, index] = noise.uniform(key, tick, index)


CASES = [(0, 0, 0), (1, 2, 3), (2**63 - 1, 2**40, 8), (noise.stream_key(7, "imu"), 599_999, 5)]


@pytest.mark.parametrize("case", CASES)
def test_bits_equal_integer_arithmetic(case):
    with np.errstate(over="ignore"):
        assert int(noise.bits(*case)) == integer_bits(*case)


@pytest.mark.parametrize("case", CASES)
def test_variates_equal_integer_arithmetic(case):
    word = integer_bits(*case)
    first = ((word >> 11) + 0.5) * 2.0**-53
    second = ((splitmix_finaliser((word + 0x9E3779B97F4A7C15) & MASK) >> 11) + 0.5) * 2.0**-53
    with np.errstate(over="ignore"):
        assert noise.uniform(*case) == first
        assert noise.gaussian(*case) == math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)


def test_finaliser_is_splitmix64():
    """First outputs of SplitMix64 seeded with 0 (Vigna's splitmix64.c): its state advances by the golden gamma."""
    gamma = 0x9E3779B97F4A7C15
    expected = (0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F)
    with np.errstate(over="ignore"):
        for i, value in enumerate(expected, start=1):
            assert int(noise.mix(np.uint64(i * gamma & MASK))) == value


def test_stream_key_is_stable_and_fits_int64():
    assert noise.stream_key(0, "imu") == noise.stream_key(np.int64(0), "imu")
    keys = {noise.stream_key(seed, name) for seed in range(200) for name in ("imu", "star_tracker", "wheel")}
    assert len(keys) == 600
    assert all(0 <= key < 2**63 for key in keys)


def test_unit_interval_is_open():
    with np.errstate(over="ignore"):
        assert 0.0 < noise.unit_interval(np.uint64(0)) < 1e-15
        assert 1.0 - 2.0**-52 < noise.unit_interval(np.uint64(MASK)) < 1.0


def test_uniform_distribution():
    values = np.empty((50_000, 4))
    fill_uniform(noise.stream_key(11, "uniform"), 50_000, 4, values)
    assert scipy.stats.kstest(values.ravel(), "uniform").pvalue > 0.01


def test_gaussian_distribution():
    values = np.empty((50_000, 4))
    fill_gaussian(noise.stream_key(3, "gauss"), 50_000, 4, values)
    n = values.size
    assert abs(values.mean()) < 4.0 / math.sqrt(n)
    assert abs(values.var() - 1.0) < 4.0 * math.sqrt(2.0 / n)
    assert scipy.stats.kstest(values.ravel(), "norm").pvalue > 0.01
    assert abs(scipy.stats.kurtosis(values.ravel())) < 4.0 * math.sqrt(24.0 / n)


def test_draws_are_independent_across_index_tick_and_key():
    ticks = 40_000
    values = np.empty((ticks, 6))
    other = np.empty((ticks, 6))
    key = noise.stream_key(5, "a")
    fill_gaussian(key, ticks, 6, values)
    fill_gaussian(key + 1, ticks, 6, other)
    bound = 5.0 / math.sqrt(ticks)
    correlation = np.corrcoef(np.hstack([values, other]).T) - np.eye(12)
    assert np.abs(correlation).max() < bound
    for lag in (1, 2, 3, 64):
        assert np.abs((values[lag:] * values[:-lag]).mean(axis=0)).max() < bound
        assert np.abs((values[lag:, :3] * other[:-lag, 3:]).mean(axis=0)).max() < bound
