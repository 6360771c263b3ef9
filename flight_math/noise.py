"""Counter-based random numbers: a draw is a pure function of (stream key, tick, index).

There is no generator state, so a draw does not depend on who drew before it: the compiled loop, a node in its own
process and a replay get the same bits. Mixing is SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number
generators", OOPSLA 2014; finaliser constants of Stafford's variant 13); normal variates are Box-Muller.

Unsigned 64-bit overflow is wanted here. In plain Python NumPy warns of it; run such code under
``np.errstate(over="ignore")``.
"""

import hashlib
import math

import numpy as np

from flight_math.elementary import cos, log
from flight_math.kernel import kernel

GOLDEN_GAMMA = np.uint64(0x9E3779B97F4A7C15)  # [-] 2^64 / golden ratio, odd
TICK_GAMMA = np.uint64(0xD1B54A32D192ED03)  # [-] odd, sets the tick apart from the key
INDEX_GAMMA = np.uint64(0x8CB92BA72F3D8DD7)  # [-] odd, sets the index apart from the tick
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
SHIFT_1 = np.uint64(30)
SHIFT_2 = np.uint64(27)
SHIFT_3 = np.uint64(31)
SHIFT_TO_53_BITS = np.uint64(11)
UNIT = 1.0 / 9007199254740992.0  # [-] 2^-53
TWO_PI = 2.0 * math.pi  # [rad]


def stream_key(seed: int, name: str) -> int:
    """Key of the noise stream `name` of a run with this seed: 0 <= key < 2^63, the same on every machine."""
    digest = hashlib.sha256(f"{int(seed)}:{name}".encode()).digest()
    return int.from_bytes(digest[:8], "little") >> 1


@kernel
def mix(word):
    """SplitMix64 finaliser: a bijection of the 64-bit words (uint64 -> uint64)."""
    word = (word ^ (word >> SHIFT_1)) * MIX_1
    word = (word ^ (word >> SHIFT_2)) * MIX_2
    return word ^ (word >> SHIFT_3)


@kernel
def bits(key, tick, index):
    """64 random bits (uint64) of stream `key` at `tick`, draw number `index` (integers, non-negative)."""
    word = mix(np.uint64(key) + GOLDEN_GAMMA)
    word = mix(word + np.uint64(tick) * TICK_GAMMA + GOLDEN_GAMMA)
    return mix(word + np.uint64(index) * INDEX_GAMMA + GOLDEN_GAMMA)


@kernel
def uniform(key, tick, index):
    """Uniform on the open interval (0, 1): midpoints of 2^53 equal cells (top cells round to at most 1 - 2^-53)."""
    return unit_interval(bits(key, tick, index))


@kernel
def unit_interval(word):
    """The top 53 bits of a uint64 as a float in (0, 1)."""
    value = (float(word >> SHIFT_TO_53_BITS) + 0.5) * UNIT
    if value >= 1.0:
        value = 1.0 - UNIT
    return value


@kernel
def gaussian(key, tick, index):
    """Standard normal variate (mean 0, variance 1): Box-Muller on the draw's word and on its successor's mix."""
    word = bits(key, tick, index)
    radius = math.sqrt(-2.0 * log(unit_interval(word)))
    return radius * cos(TWO_PI * unit_interval(mix(word + GOLDEN_GAMMA)))
