"""Conditions: every operator against Python's own evaluation, and their sentences."""

import random

import numpy as np
import pytest

from flight_graph.errors import FlightError
from tests.faults import chain
from tests.faults.chain import Flown, fault
from tests.faults.engines import plainly

pytestmark = pytest.mark.xdist_group("faults")
FIELDS = {  # signal -> (topic, column, index)
    "gauge.imu.angular_velocity[0]": ("chain/imu", "angular_velocity", 0), "imu.angular_velocity[1]": ("chain/imu", "angular_velocity", 1),
    "world.truth.angle[2]": ("chain/truth", "angle", 2), "gauge.range.range": ("chain/range", "range", None),
    "follower.echo.count": ("chain/echo", "count", None), "gauge.range.radiation_type": ("chain/range", "radiation_type", None)}
PERIODS = {"chain/imu": 10, "chain/truth": 10, "chain/range": 50, "chain/echo": 20}


class Expressions:
    """Random expressions: every operator, on signals and numbers."""

    def __init__(self, seed):
        self._random = random.Random(seed)

    def number(self, depth):
        kind = self._random.choice(["signal", "t", "constant"] if depth == 0 else ["+", "-", "*", "/", "neg", "abs", "min", "max", "signal"])
        if kind == "signal":
            return self._random.choice(list(FIELDS))
        if kind == "t":
            return "t"
        if kind == "constant":
            return repr(round(self._random.uniform(-2.0, 2.0), 2))
        one, other = self.number(depth - 1), self.number(depth - 1)
        if kind in "+-*/":
            return f"({one} {kind} {other})"
        return {"neg": f"-{one}", "abs": f"abs({one})", "min": f"min({one}, {other}, 0.1)", "max": f"max({one}, {other})"}[kind]

    def truth(self, depth):
        kind = self._random.choice(["compare"] if depth == 0 else ["and", "or", "not", "chain", "compare"])
        if kind == "compare":
            return f"{self.number(2)} {self._random.choice(['<', '<=', '>', '>=', '==', '!='])} {self.number(2)}"
        if kind == "chain":
            return f"{self.number(1)} < {self.number(1)} <= {self.number(1)}"
        if kind == "not":
            return f"not ({self.truth(depth - 1)})"
        return f"({self.truth(depth - 1)} {kind} {self.truth(depth - 1)})"


class Signals:
    """What the names of an expression stand for at a tick [ms]: the newest message stamped before it, or zero."""

    def __init__(self, flown, t_ms):
        self._flown, self._t_ms = flown, t_ms

    def names(self):
        return {name: self._value(*place) for name, place in FIELDS.items()}

    def _value(self, topic, column, index):
        newest = (self._t_ms - 1) // PERIODS[topic] if self._t_ms > 0 else -1
        if newest < 0:
            return 0.0
        value = self._flown[topic][column][newest]
        return float(value if index is None else value[index])


def python_says(text, flown):
    """Ticks [ms] in which Python finds that it holds; None where it divides by zero."""
    found = []
    for t_ms in range(0, 1000, 10):
        expression, names = text, {"abs": abs, "min": min, "max": max, "t": t_ms / 1000.0}
        for number, (name, value) in enumerate(Signals(flown, t_ms).names().items()):
            expression = expression.replace(name, f"s{number}")
            names[f"s{number}"] = value
        try:
            if eval(expression, {"__builtins__": {}}, names):
                found.append(t_ms)
        except ZeroDivisionError:
            found.append(None)
    return found


EXPRESSIONS = [Expressions(seed).truth(2) for seed in range(100)]


@pytest.fixture(scope="module")
def clean():
    return Flown()


def entries():
    return [fault("bias", "gauge.imu.linear_acceleration[0]", f"it{n}", value=0.0, when=text) for n, text in enumerate(EXPRESSIONS)]


def test_every_operator_as_python_evaluates_it(clean):
    """One run with all expressions: the report says when each holds."""
    flown, compared = Flown(entries()), 0
    times = np.searchsorted(flown.ms("faults"), range(0, 1000, 10), "right") - 1
    for number, text in enumerate(EXPRESSIONS):
        expected = python_says(text, clean)
        if None in expected:
            continue
        holds = flown["faults"][f"it{number}"][times] > 0.0
        assert np.flatnonzero(holds).tolist() == [t // 10 for t in expected], text
        compared += 0 < len(expected) < 100
    assert compared > 15  # of those that neither always nor never hold


def test_the_plain_engine_comes_to_the_same():
    assert plainly(chain.data(entries()[:50], 0.3))["faults"] == plainly.digest(Flown(entries()[:50], 0.3).recording)["faults"]


@pytest.mark.parametrize("text, holds", [
    ("1 / 0 > 0 or 1 / 0 < 0 or 1 / 0 == 0", False),  # x / 0 is no number
    ("1 / 0 != 0", True), ("not 0", True), ("3", True), ("0.0", False), ("-0.0", False), ("0 < 1 < 2 < 3", True), ("0 < 2 < 1 < 3", False),
    ("min(3, 2, 1) == 1 and max(1, 2, 3) == 3", True), ("abs(-2.5) == 2.5", True), ("1 - 2 - 3 == -4", True), ("2 * 3 + 4 * 5 == 26", True),
    ("(1 > 2) + (2 > 1) == 1", True), ("1e3 == 1000", True), ("not 1 == 2", True), ("1 or 0 and 0", True)])
def test_constants(text, holds):
    assert Flown([fault("bias", "gauge.imu.angular_velocity[0]", value=0.0, when=text)], duration_s=0.02)["faults"]["it"][0] == holds


@pytest.mark.parametrize("text, said", [
    ("", "'' is no expression; allowed: numbers"),
    ("gauge.imu.angular_velocity[0] >", "is no expression"),
    ("import os", "is no expression"),
    ("__import__('os').system('true')", "is not allowed in a condition; allowed: numbers"),
    ("open('x')", "is not allowed in a condition"),
    ("[1][0]", "no signal called '[1][0]'"),
    ("t ** 2 > 1", "'t ** 2' is not allowed in a condition"), ("t % 2", "is not allowed"), ("t // 2", "is not allowed"),
    ("t << 2", "is not allowed"), ("~t", "is not allowed"), ("+t", "is not allowed"), ("t is 1", "is not allowed"), ("t in [1]", "is not allowed"),
    ("1 if t else 2", "is not allowed"), ("(x := 3) > 1", "is not allowed"), ("'a' > 'b'", "is not allowed"), ("1j > 0", "is not allowed"),
    ("True", "'True' is not allowed"), ("None", "is not allowed"), ("speed > 1", "'speed' is not allowed"),
    ("gauge > 1", "'gauge' is not allowed"), ("sin(t) > 0", "is not allowed"), ("abs(x=1) > 0", "is not allowed"),
    ("abs() > 0", "abs takes one value"), ("abs(1, 2) > 0", "abs takes one value"), ("min(1) > 0", "min takes two or more values"),
    ("1e999 > 0", "inf is no finite number"), ("1" * 400 + " > 0", "is no finite number"),
    ("gaug.imu.angular_velocity[0] > 1", "no signal called 'gaug'; did you mean 'gauge'?"),
    ("gauge.inu.angular_velocity[0] > 1", "gauge: no output called 'inu'; did you mean 'imu'?"),
    ("gauge.imu.angular_velocty[0] > 1", "gauge.imu: no field called 'angular_velocty'; did you mean 'angular_velocity'"),
    ("gauge.imu.angular_velocity > 1", "angular_velocity has 3 numbers; name one: angular_velocity[0]"),
    ("gauge.imu.angular_velocity[3] > 1", "angular_velocity[3] is not there: angular_velocity has 3 entries"),
    ("gauge.imu.angular_velocity[-1] > 1", "is no field"), ("gauge.imu.angular_velocity[0:1] > 1", "is no field"),
    ("gauge.imu > 1", "this is a message; name a number of it"), ("gauge.imu.header > 1", "header is no number; name one of it: stamp"),
    ("age(gauge.imu.angular_velocity) > 1", "age is of messages; write age(gauge.imu)"), ("age(gauge) > 1", "is not allowed"),
    ("age(gauge.imu, 2) > 1", "is not allowed"), ("age(t) > 1", "is not allowed"), ("age(gauge.bmu) > 1", "no output called 'bmu'"),
    ("-" * 900 + "1", "takes more than 200 steps"), ("not " * 240 + "1", "takes more than 200 steps"),
    (" + ".join(["t"] * 150), "takes more than 200 steps"), ("(" * 400 + "1" + ")" * 400, "is no expression"),
    ("t > 1\n", None), (" t > 1 ", None), ("(t\n> 1)", None), ("t > 1 # why", None)], ids=lambda text: str(text)[:40])
def test_sentences(text, said):
    entry = [fault("bias", "gauge.imu.angular_velocity[0]", value=1.0, when=text)]
    if said is None:
        chain.scenario(entry)
        return
    with pytest.raises(FlightError) as error:
        chain.scenario(entry)
    assert str(error.value).startswith("chain.yaml: faults.it.when: ") and said in str(error.value)
    assert len(str(error.value)) < 700


def test_an_output_that_two_components_have_is_named_in_full():
    data = chain.data([fault("bias", "gauge.imu.angular_velocity[0]", value=1.0, when="y.level[0] > 1")])
    for name, topic in (("one", "Spare"), ("other", "Other")):
        data["components"][name] = {"use": f"{chain.__file__}:{topic}"}
    chain.Scenario(data, "chain.yaml")  # one component alone has an output y
    data["components"]["third"] = {"use": f"{chain.__file__}:Third"}
    with pytest.raises(FlightError, match=r"other and third have an output y; write other.y.level\[0\]"):
        chain.Scenario(data, "chain.yaml")
