"""Where the numbers of a draw come from: each source gives number ``index`` of one key, uniform or standard normal."""

from dataclasses import dataclass

from flight_graph.sampling import normal
from flight_math import noise
from flight_math.uncompiled import uncompiled

# In plain Python: some microseconds a number, where compiling takes each process of a campaign seconds; the same bits.
_UNIFORM, _GAUSSIAN = uncompiled(noise.uniform), uncompiled(noise.gaussian)
LARGEST = 1.0 - 2.0**-53  # below 1


@dataclass(frozen=True)
class Counter:
    """Independent numbers: a function of the stream's key, the draw and the index (`flight_math.noise`).

    Their bits come from words that overflow: ask for them under ``np.errstate(over="ignore")``.
    """

    key: int
    number: int

    def uniform(self, index: int) -> float:
        return float(_UNIFORM(self.key, self.number, index))

    def gaussian(self, index: int) -> float:
        return float(_GAUSSIAN(self.key, self.number, index))


@dataclass(frozen=True)
class Point:
    """The coordinates of a point in the open unit cube, from ``first`` on."""

    coordinates: list
    first: int

    def uniform(self, index: int) -> float:
        return self.coordinates[self.first + index]

    def gaussian(self, index: int) -> float:
        return normal.quantile(self.uniform(index))


@dataclass(frozen=True)
class Normals:
    """Given standard normal numbers, from ``first`` on."""

    numbers: list
    first: int

    def uniform(self, index: int) -> float:
        return min(max(normal.distribution(self.gaussian(index)), 1.0 - LARGEST), LARGEST)

    def gaussian(self, index: int) -> float:
        return self.numbers[self.first + index]
