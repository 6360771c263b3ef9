"""The declaration of a metric: name, unit, meaning, and what it means that a run has none."""

from dataclasses import dataclass

NUMBER, FLAG, WORD = "number", "flag", "word"


@dataclass(frozen=True)
class MetricEntry:
    """One metric. unit: "1" of a pure number, "" of flags and words; missing: why a run has none (``None``), "" where each
    has one; headline: among the few that a report shows first; smallest_is_worst: of the ends of the values."""

    name: str
    unit: str
    meaning: str
    missing: str = ""
    kind: str = NUMBER
    headline: bool = False
    smallest_is_worst: bool = False


def number(name: str, unit: str, meaning: str, missing: str = "", headline: bool = False,
           smallest_is_worst: bool = False) -> MetricEntry:
    """A metric that is a number."""
    return MetricEntry(name, unit, meaning, missing, NUMBER, headline, smallest_is_worst)


def flag(name: str, meaning: str, missing: str = "", headline: bool = False) -> MetricEntry:
    """A metric that is true or false."""
    return MetricEntry(name, "", meaning, missing, FLAG, headline)


def word(name: str, meaning: str, missing: str = "", headline: bool = False) -> MetricEntry:
    """A metric that is one of a few words."""
    return MetricEntry(name, "", meaning, missing, WORD, headline)
