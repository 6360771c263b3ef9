"""Sampling plans: where the points of a campaign's draws lie in the unit cube.

    sampling: independent                             # every number for itself (the default)
    sampling: {plan: latin_hypercube, block: 100}     # each block of 100 draws has each value's range evenly covered
    sampling: sobol                                   # scrambled Sobol sequence
    sampling: saltelli                                # what Sobol indices are estimated from

A point is a function of plan, seed, keys and the draw's number, so a campaign that is extended keeps its draws.
"""

from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from flight_graph.sampling.distributions import Strict
from flight_graph.sampling.sources import LARGEST
from flight_math import noise
from flight_math.uncompiled import uncompiled

BLOCK = 100  # draws of a block of a Latin hypercube
STRETCH = 1024  # points that are made at a time of a sequence
BITS = 32  # of a coordinate of a Sobol sequence
MOST_DIMENSIONS = 21_201  # of SciPy's Sobol sequence


class Sampling(Strict):
    """The key ``sampling`` of a vary block. block: draws of a block, of a Latin hypercube only."""

    plan: Literal["independent", "latin_hypercube", "sobol", "saltelli"] = "independent"
    block: int | None = Field(None, ge=2, le=1_000_000)

    @model_validator(mode="after")
    def _check(self):
        if self.block is not None and self.plan != "latin_hypercube":
            raise ValueError(f"'block' has no meaning with {self.plan}; it goes with latin_hypercube")
        return self


SamplingKey = Annotated[Sampling, BeforeValidator(lambda given: {"plan": given} if isinstance(given, str) else given)]


def bits(key: int, tick: int, index: np.ndarray) -> np.ndarray:
    """`flight_math.noise.bits` of many indices at once."""
    with np.errstate(over="ignore"):
        return uncompiled(noise.bits)(key, tick, index)


def latin_hypercube(key: int, dimension: int, block: int, size: int) -> np.ndarray:
    """One coordinate of a block's points, (size,) in (0, 1): one in each of ``size`` equal cells, in random order.

    M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21 (1979) 239-245. key: of the stream.
    """
    index = 2 * (dimension * size + np.arange(size))
    order = np.argsort(bits(key, block, index), kind="stable")
    inside = ((bits(key, block, index + 1) >> noise.SHIFT_TO_53_BITS) + 0.5) * noise.UNIT
    cells = np.empty(size)
    cells[order] = np.arange(size)
    return np.minimum((cells + inside) / size, LARGEST)


def sobol(first: int, count: int, words: np.ndarray) -> np.ndarray:
    """Points ``first`` to ``first + count - 1`` of a scrambled Sobol sequence, (count, dimensions) in (0, 1).

    words: (dimensions, BITS + 1) of `scrambling`. The scrambling is J. Matousek's (Journal of Complexity 14 (1998)
    527-556): a random linear map of a coordinate's bits, then a digital shift; it keeps the sequence's nets.
    """
    from scipy.stats import qmc  # half a second of a command that draws no such points
    engine = qmc.Sobol(len(words), scramble=False, bits=BITS)
    if first:
        engine.fast_forward(first)
    digits = (engine.random(count) * 2.0**BITS).astype(np.uint64)
    scrambled = np.repeat(words[None, :, BITS], count, axis=0)
    for place in range(BITS):
        present = (digits >> np.uint64(BITS - 1 - place)) & np.uint64(1)
        scrambled ^= present * words[:, place]
    return (scrambled + 0.5) / 2.0**BITS


def scrambling(keys: list[tuple[int, int]]) -> np.ndarray:
    """The words that scramble each dimension, (dimensions, BITS + 1) uint64: where each bit goes, and the shift.

    keys: of each dimension (key of the stream, index in it).
    """
    places = np.arange(BITS + 1)
    words = np.array([bits(key, index, places) for key, index in keys], dtype=np.uint64) >> np.uint64(64 - BITS)
    tops = np.uint64(1) << np.arange(BITS - 1, -1, -1, dtype=np.uint64)  # a bit stays, and reaches those below it
    words[:, :BITS] = words[:, :BITS] & (tops - np.uint64(1)) | tops
    return words


class Points:
    """The points of a plan. streams: (key of the stream, dimensions) of each key that is drawn, in order."""

    def __init__(self, sampling: Sampling, streams: list[tuple[int, int]]):
        """Raises ValueError when a Sobol sequence has not so many dimensions."""
        self._plan, self._size = sampling.plan, sampling.block or BLOCK
        self._dimensions = [(key, index) for key, count in streams for index in range(count)]
        wanted = len(self._dimensions) * {"sobol": 1, "saltelli": 2}.get(self._plan, 0)
        if wanted > MOST_DIMENSIONS:
            raise ValueError(f"{self._plan}: {wanted} dimensions; allowed: {MOST_DIMENSIONS}")
        self._stretch = lru_cache(maxsize=4)(self._made)

    def row(self, number: int, second: bool = False) -> list[float]:
        """The coordinates of point ``number``; second: of another, independent one (the design of Saltelli has two)."""
        if not self._dimensions:
            return []
        size = self._size if self._plan == "latin_hypercube" else STRETCH
        both = self._stretch(number // size)[number % size].tolist()
        width = len(self._dimensions)
        return both[width:] if second else both[:width]

    def _made(self, block: int) -> np.ndarray:
        if self._plan == "latin_hypercube":
            return np.column_stack([latin_hypercube(key, index, block, self._size)
                                    for key, index in self._dimensions])
        again = [(key ^ 1, index) for key, index in self._dimensions] if self._plan == "saltelli" else []
        words = self._words(tuple(self._dimensions + again))
        return sobol(block * STRETCH, STRETCH, words)

    _words = staticmethod(lru_cache(maxsize=16)(lambda keys: scrambling(list(keys))))
