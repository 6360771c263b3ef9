"""A component with everything that lanes can differ in: branches, loops, places in arrays, early ends, rare arguments."""

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, field
from flight_math import Vec, Vec3, atan2, exp, kernel, sin, stack_array, tanh
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from tests.graph.toy import SENSED

ODD = named_vector("toy/odd", "toy", {
    "root": Quantity(None, "1"), "rounds": Quantity(None, "1"), "picked": Quantity(None, "1"), "sorted": Quantity(4, "1"),
    "kept": Quantity(3, "1"), "early": Quantity(None, "1"), "quotient": Quantity(None, "1")}, Role.TELEMETRY)
FIXED = named_vector("toy/fixed", "toy", {"last": Quantity(None, "1")}, Role.TELEMETRY)
VARYING = named_vector("toy/varying", "toy", {"last": Quantity(None, "1")}, Role.TELEMETRY)
_TABLE = (3.0, 1.0, 4.0, 1.5, 9.0, 2.6, 5.0, 3.5)
BROKEN = 1


class OddParameters(Parameters):
    precision: float = field(1e-9, gt=0)
    terms: int = field(3, ge=1, le=8)
    large: float = field(1.0, doc="factor of an angle")
    fault_at: float = field(1e9, unit="s")
    infinite_at: float = field(1e9, unit="s")


class OddState(State):
    count: int
    turned: bool
    ring: Array(8)
    kept: Vec3


@kernel
def converged(p, value):
    """A root by Newton's method and the number of rounds, which the value decides."""
    guess, rounds = 1.0, 0
    while abs(guess * guess - value) > p.precision and rounds < 60:
        guess = 0.5 * (guess + value / guess)
        rounds += 1
        if guess > 1e6:
            break
    return guess, rounds


@kernel
def sort(numbers):
    """Insertion sort: how far a number goes differs from lane to lane."""
    for i in range(1, 4):
        j = i
        while j > 0 and numbers[j - 1] > numbers[j]:
            numbers[j - 1], numbers[j] = numbers[j], numbers[j - 1]
            j -= 1


@kernel
def odd(t_ns, p, x, imu, seen):
    angle, rate = imu.linear_acceleration, imu.angular_velocity
    x.count += 1
    t = 1e-9 * t_ns
    if t >= p.fault_at:
        x.fault = BROKEN
        return
    seen.root, seen.rounds = converged(p, 1.0 + abs(angle[0]) * 40.0)
    place = (x.count + int(abs(rate[1]) * 1000.0)) % 8
    seen.picked = _TABLE[place] * x.ring[place]
    x.ring[place] = rate[2]
    work = stack_array(4)
    for i in range(4):
        work[i] = sin(p.large * angle[i % 3] * (i + 1)) - rate[(i + x.count) % 3]
    sort(work)
    seen.sorted = Vec(4)(work)
    total = 0.0
    for k in range(p.terms):
        for i in range(k):
            if work[i] < 0.0:
                continue
            total += exp(-work[i]) / (k + 1)
    seen.kept = x.kept
    seen.early = total
    seen.quotient = (x.count * 17) // (1 + int(abs(rate[0]) * 100.0))
    if angle[1] < 0.0:
        x.turned = not x.turned
        if x.turned:
            return
    x.kept = Vec3(atan2(rate[0], angle[0]), tanh(rate[1]), x.kept[2] + 0.001)
    if t >= p.infinite_at:
        seen.early = 1.0 / (t - t)


class Odd(Component):
    """Everything that lanes can differ in."""

    parameters, state = OddParameters, OddState
    inputs, outputs = {"imu": SENSED}, {"seen": ODD}
    kernel = odd
    rate_hz = 100.0
    faults = {BROKEN: "it broke after {count} firings"}


class VaryingParameters(Parameters):
    length: int = field(3, ge=1, le=9)


@kernel
def varying(t_ns, p, x, imu, seen):
    work = stack_array(p.length)
    for i in range(p.length):
        work[i] = imu.angular_velocity[i % 3] * i
    seen.last = work[p.length - 1]


class Varying(Component):
    """A work array as long as a parameter says: where it differs between runs, they go one by one."""

    parameters = VaryingParameters
    inputs, outputs = {"imu": SENSED}, {"seen": VARYING}
    kernel = varying
    rate_hz = 100.0


class Fixed(Varying):
    """The same, as long in all runs."""

    outputs = {"seen": FIXED}
