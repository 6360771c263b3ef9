"""The declaration of a metric: name, unit, meaning, and what it means that a run has none."""

from dataclasses import dataclass

NUMBER, FLAG, WORD = "number", "flag", "word"


@dataclass(frozen=True)
class Alarm:
    """When a metric makes a person wary, and what is said then: {value} stands for it.

    above, below: limits of a number; is_: the value that rings (of flags, and of numbers that stand for words). Without any
    of them every value rings that is there."""

    text: str
    above: float | None = None
    below: float | None = None
    is_: object = None

    def rings(self, value) -> bool:
        """Whether it does."""
        if value is None:
            return False
        if self.is_ is not None:
            return value == self.is_
        if self.above is not None or self.below is not None:
            return (self.above is not None and value > self.above) or (self.below is not None and value < self.below)
        return True

    def sentence(self, value) -> str:
        """What is said."""
        return self.text.format(value=f"{value:.5g}" if isinstance(value, float) else value)


@dataclass(frozen=True)
class MetricEntry:
    """One metric. unit: "1" of a pure number, "" of flags and words; missing: why a run has none (``None``), "" where each
    has one; headline: among the few that a report shows first; smallest_is_worst: of the ends of the values; alarm: what a
    run warns of."""

    name: str
    unit: str
    meaning: str
    missing: str = ""
    kind: str = NUMBER
    headline: bool = False
    smallest_is_worst: bool = False
    alarm: Alarm | None = None


def number(name: str, unit: str, meaning: str, missing: str = "", headline: bool = False,
           smallest_is_worst: bool = False, alarm: Alarm | None = None) -> MetricEntry:
    """A metric that is a number."""
    return MetricEntry(name, unit, meaning, missing, NUMBER, headline, smallest_is_worst, alarm)


def flag(name: str, meaning: str, missing: str = "", headline: bool = False, alarm: Alarm | None = None) -> MetricEntry:
    """A metric that is true or false."""
    return MetricEntry(name, "", meaning, missing, FLAG, headline, alarm=alarm)


def word(name: str, meaning: str, missing: str = "", headline: bool = False, alarm: Alarm | None = None) -> MetricEntry:
    """A metric that is one of a few words."""
    return MetricEntry(name, "", meaning, missing, WORD, headline, alarm=alarm)
