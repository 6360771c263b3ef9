"""Time: integer nanoseconds since the start of a run; periods that divide it exactly."""

from datetime import UTC, datetime
from fractions import Fraction

from flight_graph.errors import FlightError

SECOND = 1_000_000_000  # [ns]
LONGEST = 1_000_000_000 * SECOND  # [ns] of a duration or period
J2000 = int(datetime(2000, 1, 1, 12, tzinfo=UTC).timestamp()) * SECOND  # [ns] ROS reads time zero as "no clock"


def period_ns(rate_hz: float, where: str) -> int:
    """The period of a rate as whole nanoseconds. Raises FlightError when it is none."""
    rate = _positive(rate_hz, where, "a rate in Hz")
    period = SECOND / rate
    if period.denominator != 1:
        raise FlightError(
            f"{where}: {rate_hz} Hz has a period of {float(period):.3f} ns, which is no whole number of nanoseconds; "
            f"take a rate that divides 1e9, such as {_neighbours(rate)}")
    if period > LONGEST:
        raise FlightError(f"{where}: {rate_hz} Hz is not allowed; allowed: a rate of at least {SECOND / LONGEST:g} Hz")
    return int(period)


def next_checkpoint_ns(t_ns: int, period_ns: int, base_ns: int) -> int:
    """Time of the first checkpoint behind t [ns]: of the first tick at or behind the next multiple of the period."""
    return -(-(t_ns // period_ns + 1) * period_ns // base_ns) * base_ns


def _neighbours(rate: Fraction) -> str:
    """The nearest divisors of 1e9 below and above (of 1, in steps of 1e-9, for a rate below 1 Hz)."""
    unit = Fraction(1) if rate >= 1 else Fraction(1, SECOND)
    rates = [2**a * 5**b * unit for a in range(10) for b in range(10)]
    below = max((other for other in rates if other < rate), default=None)
    above = min((other for other in rates if other > rate), default=None)
    return " or ".join(f"{float(other):.15g}" for other in (below, above) if other is not None)


def duration_ns(seconds: float, where: str) -> int:
    """A duration [s] as whole nanoseconds (rounded), greater than zero. where: for the sentence. Raises FlightError."""
    number = _positive(seconds, where, "a time in seconds") * SECOND
    if number > LONGEST:
        raise FlightError(f"{where}: {seconds} is not allowed; allowed: at most {LONGEST / SECOND:g} s")
    return round(number)


def _positive(value, where, what) -> Fraction:
    try:
        number = Fraction(str(float(value)))
    except (TypeError, ValueError, OverflowError):
        raise FlightError(f"{where}: {value!r} is not {what}; allowed: a finite number > 0") from None
    if number <= 0:
        raise FlightError(f"{where}: {value} is not allowed; allowed: {what} greater than 0")
    return number


def stamp_parts(stamp_ns: int) -> tuple[int, int]:
    """(sec, nanosec) of a ROS stamp."""
    return stamp_ns // SECOND, stamp_ns % SECOND
