"""What the compiler alone finds is one sentence with file and line, too, and never its own pages."""

import sys

import pytest

from flight_graph.components import registry
from flight_graph.engines import part_calls
from flight_graph.engines.compile_errors import translated
from flight_graph.errors import FlightError
from tests.messages.compiler_mistakes import MISTAKES
from tests.messages.conftest import judge
from tests.messages.mistakes import write


def compile_kernel(component):
    """Type and lower the component's kernel."""
    from numba.core import types
    component.kernel.get_compile_result(types.void(*part_calls.compiled_arguments(component, "kernel")))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_one_sentence(tmp_path, monkeypatch, mistake):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, mistake)
    try:
        component = registry.component("my_law.py:Law")
        with pytest.raises(FlightError) as error, translated(component, "kernel"):
            compile_kernel(component)
    finally:
        sys.modules.pop("my_law", None)
    judge(mistake, f"{error.value}\n")


def test_the_compilers_own_words_are_there_when_asked_for(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FLIGHT_DEBUG", "1")
    write(tmp_path, MISTAKES[0])
    try:
        component = registry.component("my_law.py:Law")
        with pytest.raises(FlightError), translated(component, "kernel"):
            compile_kernel(component)
    finally:
        sys.modules.pop("my_law", None)
    assert "Unknown attribute 'foo' of type float64" in capsys.readouterr().err
