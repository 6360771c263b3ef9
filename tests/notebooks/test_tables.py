"""Tables of columns: with pandas a DataFrame, without it the same rows, and a sentence for who asks for a DataFrame."""

import importlib.util
import re

import numpy as np
import pandas
import pyarrow
import pytest

from flight_graph import notebook, tables
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load

COLUMNS = {"case": [4, 7], "rates [rad/s]": np.array([[0.25, -1.0], [0.5, 2.0]]), "name": ["a", None], "angles": [[1.0], [2.0]]}


def test_vectors_become_columns_and_rows_stay():
    frame = tables.table(COLUMNS, index="case")
    assert isinstance(frame, pandas.DataFrame) and list(frame.index) == [4, 7]
    assert list(frame.columns) == ["rates[0] [rad/s]", "rates[1] [rad/s]", "name", "angles[0]"]
    assert frame.loc[7, "rates[1] [rad/s]"] == 2.0 and frame["angles[0]"].tolist() == [1.0, 2.0]
    arrow = tables.table(pyarrow.table({"x": [1.5, None], "v": pyarrow.array([[1.0, 2.0], [3.0, 4.0]], pyarrow.list_(pyarrow.float64(), 2))}))
    assert list(arrow.columns) == ["x", "v[0]", "v[1]"] and arrow["v[1]"].tolist() == [2.0, 4.0] and arrow["x"].isna().tolist() == [False, True]
    assert tables.table([{"a": 1}, {"a": 2, "b": "x"}])["b"].isna().tolist() == [True, False]


def test_columns_are_of_one_length():
    with pytest.raises(FlightError, match="of one length; these are of {'a': 2, 'b': 1}"):
        tables.table({"a": [1, 2], "b": [1]})


@pytest.mark.parametrize(("call", "words"), [
    (lambda: notebook.plot([]), "name one or more of one kind"),
    (lambda: notebook.plot("a/bag", out="p.svg"), "a notebook shows .png"),
    (lambda: notebook.run(load("cubli_asteroid"), {"controller.lambda_a": 0.03}), "this one is loaded already"),
    (lambda: notebook.sweep("cubli_asteroid", "plant.mass"), "does not say what is varied and how"),
])
def test_what_is_wrong_in_a_cell_is_a_sentence(call, words):
    with pytest.raises(FlightError, match=words):
        call()


def test_without_pandas(monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *more: None if name == "pandas" else found(name, *more))
    plain = tables.table(COLUMNS)
    assert len(plain) == 2 and plain["rates[0] [rad/s]"].tolist() == [0.25, 0.5]
    lines = repr(plain).splitlines()
    assert lines[0].split("  ")[0] == "case" and lines[1].split() == ["4", "0.25", "-1", "a", "1"] and lines[-1] == "2 rows"
    long = tables.table({"<n>": list(range(30))})
    assert repr(long).splitlines()[-2:] == ["...", "30 rows"] and "<th>&lt;n&gt;</th>" in long._repr_html_()
    monkeypatch.setattr(tables, "required", lambda *given: __import__("flight_graph.extras", fromlist=["x"]).required(
        "pandas_is_not_here", *given[1:]))
    with pytest.raises(FlightError) as error:
        tables.to_pandas(COLUMNS)
    assert re.match(r"a table as a DataFrame needs .*'pandas>=2.2'.* which is not installed; to install it: ", str(error.value))
