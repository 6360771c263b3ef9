"""The values of a campaign's draws: `Sampler.draw(number)` is a function of plan, seed, keys and the number alone."""

import numpy as np

from flight_graph.sampling.correlated import Correlated
from flight_graph.sampling.distributions import Distribution
from flight_graph.sampling.plan import Points, Sampling
from flight_graph.sampling.sources import Counter, Normals, Point
from flight_math import noise


class Sampler:
    """Draws of a vary block.

    sampling: the plan. random: key -> distribution. correlated: groups of keys that are drawn together.
    seed: of the draws. Keys are drawn in this order; in a Sobol sequence the order says who gets which coordinate, so a
    key that is appended leaves the others' values.

    factors: what a design of Saltelli exchanges, each a tuple of keys (a vector is one factor, a correlated group too).
    dimensions: standard normal (or uniform) numbers behind a draw.
    """

    def __init__(self, sampling: Sampling, random: dict[str, Distribution], correlated: list[Correlated] = (),
                 seed: int = 0):
        self.sampling, self.seed = sampling, seed
        self._parts = [((key,), found, _single(key, found)) for key, found in random.items()]
        self._parts += [(tuple(found.keys), found, _together(found)) for found in correlated]
        self.factors = [keys for keys, _, _ in self._parts]
        self.keys = [key for keys in self.factors for key in keys]
        self._streams = [noise.stream_key(seed, "+".join(keys)) for keys in self.factors]
        self._sizes = [found.dimensions for _, found, _ in self._parts]
        self._firsts = np.concatenate([[0], np.cumsum(self._sizes)]).astype(int).tolist()
        self.dimensions = self._firsts[-1]
        plan = [noise.stream_key(seed, f"{sampling.plan}:{'+'.join(keys)}") for keys in self.factors]
        self._points = Points(sampling, list(zip(plan, self._sizes)))

    def draw(self, number: int) -> dict:
        """The values of draw ``number`` by key, in plain types. Raises IndexError below 0."""
        if number < 0:
            raise IndexError(f"there is no draw {number}; draws are counted from 0")
        if self.sampling.plan == "independent":
            with np.errstate(over="ignore"):
                return self._values((Counter(key, number) for key in self._streams), number)
        if self.sampling.plan == "saltelli":
            return self._exchanged(number)
        return self._at(self._points.row(number), number)

    def draws(self, numbers) -> list[dict]:
        """The values of several draws, in their order."""
        return [self.draw(number) for number in numbers]

    def from_normals(self, numbers, number: int = 0) -> dict:
        """The values that belong to given standard normal numbers, (dimensions,): each independent of the others.

        number: of the draw, for keys that count.
        """
        numbers = [float(value) for value in numbers]
        if len(numbers) != self.dimensions:
            raise ValueError(f"{len(numbers)} numbers; a draw is made of {self.dimensions}")
        return self._values((Normals(numbers, first) for first in self._firsts), number)

    @property
    def rows(self) -> int:
        """Draws that belong together: of a design of Saltelli, A, B and A with each factor from B; of others 1."""
        return len(self.factors) + 2 if self.sampling.plan == "saltelli" else 1

    def _exchanged(self, number):
        """Row k of base sample i: A, B, then A with factor k - 2 from B (Saltelli 2010). Counted keys are a factor too."""
        base, k = divmod(number, self.rows)
        a, b = self._at(self._points.row(base), 2 * base), self._at(self._points.row(base, True), 2 * base + 1)
        if k < 2:
            return b if k else a
        return a | {key: b[key] for key in self.factors[k - 2]}

    def _at(self, coordinates, number):
        return self._values((Point(coordinates, first) for first in self._firsts), number)

    def _values(self, sources, number):
        values = {}
        for (_, _, made), source in zip(self._parts, sources):
            values.update(made(source, number))
        return values


def _single(key, found):
    return lambda source, number: {key: found.value(source, number)}


def _together(found):
    return lambda source, number: found.values(source)
