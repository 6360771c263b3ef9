"""A mistake in the file, in a declaration or in plain Python is one sentence with its line, wherever it is met."""

import sys

import pytest

from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.graphs import scenario as scenarios
from tests.messages.class_mistakes import MISTAKES, OWN_PYTHON
from tests.messages.mistakes import write


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("my_law", None)


def judge(mistake, text):
    assert f"my_law.py:{mistake.line_number}: {mistake.where}" in text, text
    assert "\n" not in text and "Traceback" not in text and len(text) < 500
    for part in mistake.said:
        assert part in text, text


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_file_is_refused_when_it_is_loaded(folder, mistake):
    write(folder, mistake)
    with pytest.raises(FlightError) as error:
        registry.component("my_law.py:Law")
    judge(mistake, str(error.value))
    assert "my_law" not in sys.modules


@pytest.mark.parametrize("mistake", OWN_PYTHON, ids=lambda mistake: mistake.name)
def test_an_exception_of_own_code_is_a_sentence(folder, mistake):
    _, scenario = write(folder, mistake)
    with pytest.raises(FlightError) as error:
        loaded = scenarios.load(str(scenario))
        loaded.warnings()
        node = loaded.graph.nodes["controller"]
        node.component.initial_state(node.values)
    judge(mistake, str(error.value))


def test_a_scenario_names_the_component_that_uses_the_file(folder):
    _, scenario = write(folder, MISTAKES[0])
    with pytest.raises(FlightError, match=r"^my_law.yaml: components.controller.use: my_law.py:\d+: this is no Python"):
        scenarios.load(str(scenario))


def test_an_unknown_class_names_the_nearest(folder):
    from tests.messages.mistakes import CORRECT
    (folder / "my_law.py").write_text(CORRECT)
    with pytest.raises(FlightError, match="no component called 'Lav'; did you mean 'Law'?"):
        registry.component("my_law.py:Lav")
    with pytest.raises(FlightError, match="'my_law.py:LawState' is not a component .*; my_law.py has Law"):
        registry.component("my_law.py:LawState")
    with pytest.raises(FlightError, match="there is no file '.*my_low.py'"):
        registry.component("my_low.py:Law")
