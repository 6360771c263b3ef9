"""Parameters: declared once, checked strictly, refused with a sentence that says what is allowed."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies

from flight_graph.components.records import Array, Choice, Integers, Parameters, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load


class Example(Parameters):
    gain: float = field(0.5, unit="N m/rad", gt=0, le=10, source="Table 7", doc="a gain")
    count: int = field(3, ge=0, le=9)
    on: bool = field(False)
    law: Choice("explicit", "implicit") = field("implicit")
    vector: Vec3 = field(0.25, unit="rad", ge=-1)
    matrix: Array(2, 3) = field((1, 2, 3, 4, 5, 6))
    parents: Integers(3) = field([0, 0, 1], ge=0)


def test_defaults_and_record():
    assert Example.defaults() == {"gain": 0.5, "count": 3, "on": False, "law": "implicit", "vector": [0.25] * 3,
                                  "matrix": [[1, 2, 3], [4, 5, 6]], "parents": [0, 0, 1]}
    record = Example.record({"vector": [1, 2, 3], "law": "explicit"})
    assert record.shape == (1,) and record["vector"].tolist() == [[1, 2, 3]] and record["law"][0] == 0
    assert record["parents"].tolist() == [[0, 0, 1]] and record["parents"].dtype == np.int64
    assert record.dtype["gain"] == np.float64 and record.dtype["count"] == np.int64 and "period" in record.dtype.names


@pytest.mark.parametrize("name, value, stored", [
    ("gain", 10, 10.0), ("gain", np.float64(1e-300), 1e-300), ("count", 0, 0), ("count", np.int64(9), 9), ("on", True, True),
    ("law", "explicit", "explicit"), ("vector", 2, [2.0] * 3), ("vector", (1, 2, 3), [1.0, 2.0, 3.0]),
    ("vector", np.arange(3.0), [0.0, 1.0, 2.0]), ("matrix", [[1, 2, 3], [4, 5, 6]], [[1, 2, 3], [4, 5, 6]]),
    ("matrix", [1, 2, 3, 4, 5, 6], [[1, 2, 3], [4, 5, 6]]), ("matrix", 0.5, [[0.5] * 3] * 2),
    ("parents", np.array([2, 1, 0]), [2, 1, 0]), ("parents", 4, [4, 4, 4]),
])
def test_allowed(name, value, stored):
    assert Example.validate({name: value}, "node") == {name: stored}


@pytest.mark.parametrize("name, value, allowed", [
    ("parents", [0, 0.5, 1], "3 whole numbers, >= 0"), ("parents", [0, -1, 1], "3 whole numbers"),
    ("gain", 0.0, "a finite number, > 0 and <= 10 [N m/rad]"), ("gain", 10.000001, "<= 10"), ("gain", math.nan, "finite"),
    ("gain", math.inf, "finite"), ("gain", "0.5", "finite"), ("gain", True, "finite"), ("gain", None, "finite"),
    ("gain", [1.0], "finite"), ("gain", {}, "finite"), ("count", 1.5, "a whole number, >= 0 and <= 9"), ("count", 10, "<= 9"),
    ("count", -1, ">= 0"), ("count", True, "whole"), ("count", "1", "whole"), ("on", 1, "true or false"),
    ("on", "yes", "true or false"), ("law", "implict", "one of explicit, implicit"), ("law", 0, "one of"),
    ("law", ["explicit"], "one of"), ("vector", [1, 2], "3 numbers, >= -1 [rad]"), ("vector", [1, 2, 3, 4], "3 numbers"),
    ("vector", [0, 0, math.nan], "3 numbers"), ("vector", [0, 0, -1.5], ">= -1"), ("vector", "abc", "3 numbers"),
    ("vector", [[1, 2, 3]], "3 numbers"), ("vector", [0, "1", 2], "3 numbers"), ("vector", None, "3 numbers"),
    ("matrix", [[1, 2], [3, 4], [5, 6]], "2 x 3 numbers"), ("matrix", [1, 2, 3], "2 x 3 numbers"),
    ("matrix", [[1, 2, 3], [4, 5, math.inf]], "2 x 3 numbers"),
])
def test_refused(name, value, allowed):
    with pytest.raises(FlightError) as refused:
        Example.validate({name: value}, "node")
    text = str(refused.value)
    assert text.startswith(f"node.{name}: ") and "is not allowed" in text and allowed in text, text


def test_unknown_names_come_with_the_nearest():
    with pytest.raises(FlightError, match=r"node: no parameter called 'gian'; did you mean 'gain'\?"):
        Example.validate({"gian": 1}, "node")
    with pytest.raises(FlightError, match="known: count, gain, law, matrix, on, parents, vector"):
        Example.validate({"zzzzzz": 1}, "node")


@given(strategies.floats(allow_nan=True, allow_infinity=True))
def test_a_float_is_taken_exactly_or_refused(value):
    allowed = math.isfinite(value) and 0.0 < value <= 10.0
    try:
        stored = Example.record({"gain": value})["gain"][0]
    except FlightError:
        assert not allowed
    else:
        assert allowed and stored == value


def test_declarations_that_cannot_be_are_refused():
    with pytest.raises(FlightError, match="reserved"):
        type("Bad", (Parameters,), {"__annotations__": {"period": float}})
    with pytest.raises(FlightError, match="reserved"):
        type("Bad", (State,), {"__annotations__": {"sum": float}})
    with pytest.raises(FlightError, match="Bad.speed: complex is not allowed; allowed: float"):
        type("Bad", (Parameters,), {"__annotations__": {"speed": complex}})


@pytest.mark.parametrize(("scenario", "settings", "said"), [
    ("cubli_asteroid", {"controller.smoothing": 0.01}, "smoothing is given and has no effect with law implicit"),
    ("cubli_asteroid_paper", {"controller.smoothing": 0.02}, None),
    ("cubli_asteroid", {"controller.smoothing": 0.0}, None),  # the default changes nothing either way
    ("spacerobot_harmonic_lyapunov", {"estimator.adaptation_diagonal": 2.0}, "it follows from other parameters"),
    ("spacerobot_harmonic_rls", {"estimator.covariance_diagonal": 2.0}, "it follows from other parameters"),
    ("spacerobot_harmonic_rls", {"estimator.covariance_diagonal": 2.0, "estimator.covariance": "given"}, None),
])
def test_a_parameter_without_effect_warns(scenario, settings, said):
    found = [text for text in load(scenario, settings).warnings() if "has no effect" in text]
    assert (found == []) if said is None else (len(found) == 1 and said in found[0])


def test_what_a_bag_carries_warns_of_nothing_that_follows():
    resolved = load("spacerobot_harmonic_lyapunov").resolved()
    assert [text for text in Scenario(resolved, "bag").warnings() if "has no effect" in text] == []
