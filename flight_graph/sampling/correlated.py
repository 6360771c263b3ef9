"""Normal values of several parameters that hang together by a covariance."""

import math
from functools import cached_property

import numpy as np
from pydantic import Field, model_validator

from flight_graph.sampling.distributions import MOST_NUMBERS, Numbers, Strict, finite

ROUNDING = 1e-12  # [-] of a pivot, relative to the largest variance


class Correlated(Strict):
    """Parameters drawn together: mean and covariance of their values, one behind the other (a vector's entries too).

    covariance: (n, n), symmetric and positive semidefinite; n numbers in all of mean.
    """

    keys: list[str] = Field(min_length=1)
    mean: list[Numbers] = Field(min_length=1)
    covariance: list[list[float]] = Field(min_length=1, max_length=MOST_NUMBERS)

    @model_validator(mode="after")
    def _check(self):
        finite(self.mean)
        finite(self.covariance)
        if len(self.keys) != len(self.mean):
            raise ValueError(f"{len(self.keys)} keys and {len(self.mean)} means; allowed: one mean (a number or a vector) "
                             "for each key")
        if len(set(self.keys)) != len(self.keys):
            raise ValueError("a key stands twice among 'keys'")
        n = len(self._centre)
        if [len(row) for row in self.covariance] != [n] * n:
            raise ValueError(f"allowed: a covariance of {n} rows with {n} numbers, as many as 'mean' has")
        if any(self.covariance[i][j] != self.covariance[j][i] for i in range(n) for j in range(i)):
            raise ValueError("a covariance is symmetric")
        self._factor  # noqa: B018 refuses what is no covariance
        return self

    @cached_property
    def _centre(self) -> list[float]:
        return [float(value) for entry in self.mean for value in (entry if isinstance(entry, list) else [entry])]

    @cached_property
    def _factor(self) -> list[list[float]]:
        """Lower triangular, times its transpose the covariance (Cholesky), by the same operations on every machine."""
        given, n = self.covariance, len(self.covariance)
        small = ROUNDING * max(given[i][i] for i in range(n))
        factor = [[0.0] * n for _ in range(n)]
        for j in range(n):
            for i in range(j, n):
                rest = given[i][j]
                for k in range(j):
                    rest -= factor[i][k] * factor[j][k]
                if i == j:
                    if not rest >= -small:
                        raise ValueError("this is no covariance: it is not positive semidefinite")
                    factor[j][j] = math.sqrt(rest) if rest > small else 0.0
                elif factor[j][j] > 0.0:
                    factor[i][j] = rest / factor[j][j]
                elif abs(rest) > math.sqrt(ROUNDING) * math.sqrt(abs(given[i][i] * given[j][j])):
                    raise ValueError("this is no covariance: it is not positive semidefinite")
        return factor

    @property
    def dimensions(self) -> int:
        """How many numbers of a source the values are made of."""
        return len(self._centre)

    def values(self, source) -> dict:
        """The values by key: mean + factor z, z standard normal; source: `flight_graph.sampling.sources`."""
        z = [source.gaussian(i) for i in range(self.dimensions)]
        numbers = []
        for centre, row in zip(self._centre, self._factor):
            for weight, number in zip(row, z):
                centre += weight * number
            numbers.append(centre)
        found, first = {}, 0
        for key, mean in zip(self.keys, self.mean):
            length = np.size(mean)
            found[key] = numbers[first:first + length] if isinstance(mean, list) else numbers[first]
            first += length
        return found
