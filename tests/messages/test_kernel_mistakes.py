"""A mistake in a kernel is one sentence: file, line, component, part, what is wrong, what is allowed; before compiling."""

import importlib.util
import sys

import pytest

from flight_graph.components.kernel_rules import findings
from tests.messages.kernel_mistakes import MISTAKES
from tests.messages.mistakes import CORRECT


def found_in(folder, name, text):
    """The findings in a file's component Law."""
    path = folder / f"{name}.py"
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
        return findings(module.Law)
    finally:
        del sys.modules[name]


def test_a_correct_file_has_no_mistake(tmp_path):
    assert found_in(tmp_path, "correct_law", CORRECT) == ()


@pytest.mark.parametrize("number", range(len(MISTAKES)), ids=[mistake.name for mistake in MISTAKES])
def test_one_sentence(tmp_path, monkeypatch, number):
    mistake = MISTAKES[number]
    monkeypatch.chdir(tmp_path)
    found = found_in(tmp_path, f"mistaken_law_{number}", mistake.text)
    assert len(found) == 1, [str(finding) for finding in found]
    text = str(found[0])
    assert text.startswith(f"mistaken_law_{number}.py:{mistake.line_number}: {mistake.where}"), text
    assert "\n" not in text and "numba" not in text and len(text) < 400
    for part in mistake.said:
        assert part in text
