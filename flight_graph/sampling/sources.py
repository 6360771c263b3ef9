"""Where the numbers of a draw come from: each source gives number ``index`` of one key, uniform or standard normal."""

from dataclasses import dataclass

from flight_graph.sampling import normal
from flight_math import noise

LARGEST = 1.0 - 2.0**-53  # below 1


@dataclass(frozen=True)
class Counter:
    """Independent numbers: a function of the stream's key, the draw and the index (`flight_math.noise`)."""

    key: int
    number: int

    def uniform(self, index: int) -> float:
        return float(noise.uniform(self.key, self.number, index))

    def gaussian(self, index: int) -> float:
        return float(noise.gaussian(self.key, self.number, index))


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
