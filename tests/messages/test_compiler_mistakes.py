"""What the compiler alone finds is one sentence with file and line, too, and never its own pages."""

import sys

import pytest

from flight_graph.components import registry
from flight_graph.engines.compile_errors import translated
from flight_graph.errors import FlightError
from tests.messages.compiler_mistakes import MISTAKES
from tests.messages.mistakes import write


def compile_part(component):
    """Type and lower the component's kernel."""
    from numba.core import types
    from numba.np.numpy_support import from_dtype

    from flight_graph.components.component import kinds_of
    from flight_math.values.compiled_views import ViewType
    records = [(component.parameters.dtype, component.parameters.kinds), (component.state.dtype, component.state.kinds)]
    records += [(signal.dtype, kinds_of(signal)) for signal in (*component.inputs.values(), *component.outputs.values())]
    component.kernel.get_compile_result(types.void(
        types.int64, *(ViewType(from_dtype(dtype), kinds) for dtype, kinds in records)))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_one_sentence(tmp_path, monkeypatch, mistake):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, mistake)
    try:
        component = registry.component("my_law.py:Law")
        with pytest.raises(FlightError) as error, translated(component, "kernel"):
            compile_part(component)
    finally:
        sys.modules.pop("my_law", None)
    text = str(error.value)
    assert text.startswith(f"my_law.py:{mistake.line_number}: Law.kernel: "), text
    assert "\n" not in text and "Record(" not in text and "numba" not in text and len(text) < 400
    for part in mistake.said:
        assert part in text
