"""The fixed part of a campaign's cases: named variants, grids, fractions of grids, one value at a time."""

import itertools
import math

from flight_graph.sampling.distributions import MOST_COMBINATIONS, Spaced

NOMINAL = "nominal"  # name of the case in which nothing deviates


def levels(values) -> list:
    """The values of one key of a grid."""
    return values.values() if isinstance(values, Spaced) else values


def combinations(cases: list[dict], grid: dict, fraction: dict[str, list[str]], alone: dict) -> list[tuple]:
    """(name or None, {key: value}) of each: variants outermost, then the grid, then one value at a time.

    fraction: see `fraction_of`. alone: key -> values, each of which is taken with the other keys of it as they are.
    Raises ValueError.
    """
    variants = [(str(entry.get("name", number)), {key: value for key, value in entry.items() if key != "name"})
                for number, entry in enumerate(cases)] or [(None, {})]
    axes = {key: levels(values) for key, values in grid.items()}
    free = [key for key in axes if key not in fraction]
    singles = [(None, {})] if not alone else [(NOMINAL, {}), *(
        (f"{key} {value}", {key: value}) for key, values in alone.items() for value in levels(values))]
    count = len(variants) * math.prod(len(axes[key]) for key in free) * len(singles)
    if count > MOST_COMBINATIONS:
        raise ValueError(f"{count} combinations; allowed: {MOST_COMBINATIONS}")
    return [(" ".join(word for word in (name, single) if word is not None) or None, {**values, **point, **deviation})
            for name, values in variants for point in fraction_of(axes, fraction) for single, deviation in singles]


def fraction_of(axes: dict[str, list], fraction: dict[str, list[str]]) -> list[dict]:
    """The points of a grid, or of a regular fraction of it (G. E. P. Box and J. S. Hunter, Technometrics 3 (1961) 311-351).

    fraction: key -> other keys of the grid. The number of the key's level is the sum of the numbers of their levels,
    modulo the number of levels (all have the same); two levels give the fractions 2^(k - p), three levels Latin squares.
    A key that is listed twice counts twice. Raises ValueError.
    """
    for key, others in fraction.items():
        for other in (key, *others):
            if other not in axes:
                raise ValueError(f"fraction: '{other}' is no key of the grid")
            if other != key and other in fraction:
                raise ValueError(f"fraction: '{other}' follows from other keys itself; name the keys that it follows from")
        if key in others or not others:
            raise ValueError(f"fraction: '{key}' follows from other keys of the grid: name them")
        if len({len(axes[other]) for other in (key, *others)}) > 1:
            raise ValueError(f"fraction: '{key}' and the keys that it follows from need the same number of values")
    free = [key for key in axes if key not in fraction]
    points = []
    for chosen in itertools.product(*(range(len(axes[key])) for key in free)):
        numbers = dict(zip(free, chosen))
        for key, others in fraction.items():
            numbers[key] = sum(numbers[other] for other in others) % len(axes[key])
        points.append({key: axes[key][numbers[key]] for key in axes})
    return points
