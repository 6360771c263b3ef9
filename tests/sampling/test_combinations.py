"""Fractions of grids, one value at a time, and what the words of --vary mean."""

import itertools

import numpy as np
import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs.named_code import foreign_code
from flight_graph.graphs.vary import Vary
from flight_graph.sampling.combinations import fraction_of
from flight_graph.sampling.distributions import Distribution, Spaced
from flight_graph.sampling.specifications import Besides, parse_vary, with_varied


def test_an_eighth_of_seven_factors_is_balanced_and_orthogonal():
    """2^(7-4), resolution III (Box and Hunter 1961): each value equally often, no two factors alike."""
    axes = {name: [-1, 1] for name in "ABCDEFG"}
    points = fraction_of(axes, {"D": ["A", "B"], "E": ["A", "C"], "F": ["B", "C"], "G": ["A", "B", "C"]})
    table = np.array([[point[name] for name in axes] for point in points])
    assert (table.T @ table == 8 * np.eye(7)).all() and (table.sum(axis=0) == 0).all()


def test_a_latin_square_holds_each_pair_once():
    points = fraction_of({"a": [1, 2, 3], "b": ["x", "y", "z"], "c": [0.1, 0.2, 0.3]}, {"c": ["a", "b"]})
    for one, other in itertools.combinations("abc", 2):
        assert len({(point[one], point[other]) for point in points}) == len(points) == 9


@pytest.mark.parametrize(("fraction", "words"), [
    ({"c": ["a", "c"]}, "name them"), ({"c": []}, "name them"), ({"c": ["d"]}, "'d' is no key of the grid"),
    ({"c": ["a"], "b": ["c"]}, "'c' follows from other keys itself"), ({"c": ["e"]}, "the same number of values")])
def test_fractions_that_are_refused(fraction, words):
    with pytest.raises(ValueError, match=words):
        fraction_of({"a": [1, 2], "b": [1, 2], "c": [1, 2], "e": [1, 2, 3]}, fraction)


def test_one_value_at_a_time():
    vary = Vary({"cases": [{"name": "pd", "c.law": "pd"}, {"name": "p", "c.law": "p"}],
                 "one_at_a_time": {"p.mass": [1.9, 2.1], "p.g": {"linear": [1, 3, 2]}},
                 "random": {"p.x": {"uniform": [0, 1]}}, "runs": 2}, "test")
    assert len(vary.combinations) == 10 and vary.count == 20
    assert vary.name(0) == "pd nominal" and vary.combinations[0][1] == {"c.law": "pd"}
    assert vary.combinations[7] == ("p p.mass 2.1", {"c.law": "p", "p.mass": 2.1})
    assert vary.overrides(4) == {"c.law": "pd", "p.g": 3.0, "p.x": vary.overrides(0)["p.x"]}


def test_code_that_is_varied_one_at_a_time_needs_consent():
    data = {"vary": {"one_at_a_time": {"controller.use": ["/elsewhere/law.py:Law"]}}}
    assert [code.source for code in foreign_code(data, None)] == ["/elsewhere/law.py"]


@pytest.mark.parametrize(("word", "key", "how"), [
    ("controller.lambda_a=0.01:0.046:19", "controller.lambda_a", Spaced(linear=(0.01, 0.046, 19))),
    ("plant.g=geometric:1e-5,1e-3,3", "plant.g", Spaced(geometric=(1e-5, 1e-3, 3))),
    ("controller.law=explicit,implicit", "controller.law", ["explicit", "implicit"]),
    ("plant.on=true", "plant.on", [True]),
    ("controller.use=law.py:Law,cubli_ros/pd_controller", "controller.use", ["law.py:Law", "cubli_ros/pd_controller"]),
    ("plant.mass=normal:2,0.04", "plant.mass", Distribution(normal=(2.0, 0.04))),
    ("plant.mass=normal:2,0.04,1.9,", "plant.mass", Distribution(normal=(2.0, 0.04), truncated=(1.9, None))),
    ("plant.mass=uniform:-1,1", "plant.mass", Distribution(uniform=(-1.0, 1.0))),
    ("plant.angles=3xuniform:-1,1", "plant.angles", Distribution(uniform=(-1.0, 1.0), size=3)),
    ("plant.axes=2xchoice:a,b,c,d", "plant.axes", Distribution(choice=["a", "b", "c", "d"], size=2)),
    ("plant.law=choice:a,b", "plant.law", Distribution(choice=["a", "b"])), ("seed=count:5", "seed", Distribution(count=5))])
def test_words_of_the_command_line(word, key, how):
    assert parse_vary(word) == (key, how)


@pytest.mark.parametrize(("word", "words"), [
    ("plant.mass", "does not say what is varied"), ("=1", "does not say what"), ("plant.mass=", "does not say what"),
    ("a.b=1:2", "FROM:TO:COUNT"), ("a.b=gauss:1,2", "no distribution 'gauss'"), ("a.b=normal:1", "takes 2 or 4 numbers"),
    ("a.b=normal:1,-2", "standard deviation >= 0"), ("a.b=uniform:2,1", "from < to"), ("a.b=1:x:3", "valid number"),
    ("a.b=nan:1:3", "finite"), ("a.b=1:2:1e9", "valid integer|at most"), ("a.b=count:x", "valid integer"),
    ("a.b=normal:inf,1", "finite"), ("a.b=3xcount:1", "count has no size"), ("a.b=0xuniform:1,2", "greater than or equal to 1"),
    ("a.b=3xgauss:1,2", "no distribution 'gauss'")])
def test_words_that_are_refused(word, words):
    with pytest.raises(FlightError, match=words):
        parse_vary(word)


def test_words_take_the_place_of_what_the_file_varies():
    block = {"grid": {"a.b": [1, 2], "a.c": [3]}, "random": {"a.d": {"uniform": [0, 1]}}, "runs": 5}
    found = with_varied(block, ["a.b=normal:1,2", "a.d=0:1:3"])
    assert found == {"grid": {"a.c": [3], "a.d": {"linear": [0.0, 1.0, 3]}}, "random": {"a.b": {"normal": [1.0, 2.0]}}, "runs": 5}
    assert Vary(found, "test").count == 15 and block["grid"]["a.b"] == [1, 2]
    assert with_varied(None, ["a.b=1,2"]) == {"grid": {"a.b": [1, 2]}}
    besides = Besides(("a.b=normal:1,2",), 5, "latin_hypercube:20").of(None)
    assert besides == {"random": {"a.b": {"normal": [1.0, 2.0]}}, "seed": 5, "sampling": {"plan": "latin_hypercube", "block": 20}}
    assert Vary(besides, "test").file.sampling.block == 20 and Besides().of(None) is None
    for plan, words in (("sobl", "input should be 'independent'"), ("sobol:5", "no meaning with sobol"), ("latin_hypercube:x", "valid integer")):
        with pytest.raises(FlightError, match=words):
            Besides(plan=plan).of({"runs": 2})
    with pytest.raises(FlightError, match="varied twice"):
        with_varied(None, ["a.b=1", "a.b=2"])
    with pytest.raises(FlightError, match="cases set 'a.b' themselves"):
        with_varied({"cases": [{"a.b": 1}]}, ["a.b=2"])
    with pytest.raises(FlightError, match="together with others"):
        with_varied({"correlated": [{"keys": ["a.b"]}]}, ["a.b=2"])
