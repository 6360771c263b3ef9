"""A mistake in the file, in a declaration or in plain Python is one sentence with its line, wherever it is met."""

import json
import sys

import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs import scenario as scenarios
from tests.messages.class_mistakes import MISTAKES, OWN_PYTHON
from tests.messages.conftest import judge
from tests.messages.mistakes import CORRECT, write


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_check_and_run_say_one_sentence(flight, tmp_path, mistake):
    _, scenario = write(tmp_path, mistake)
    status, out, err = flight("check", "my_law.py:Law")
    assert (status, err) == (1, "")
    judge(mistake, out)
    assert "my_law" not in sys.modules
    status, out, err = flight("run", scenario)
    assert (status, out) == (2, "")
    judge(mistake, err, "error: my_law.yaml: components.controller.use: ")


@pytest.mark.parametrize("mistake", OWN_PYTHON, ids=lambda mistake: mistake.name)
def test_an_exception_of_own_code_is_a_sentence(flight, tmp_path, mistake):
    _, scenario = write(tmp_path, mistake)
    if "warnings" not in mistake.where:
        status, out, err = flight("check", "my_law.py:Law")
        assert (status, err) == (1, "")
        judge(mistake, out)
    with pytest.raises(FlightError) as error:
        loaded = scenarios.load(str(scenario))
        loaded.warnings()
        node = loaded.graph.nodes["controller"]
        node.component.initial_state(node.values)
    judge(mistake, f"{error.value}\n")


def test_an_unknown_class_names_the_nearest(flight, tmp_path):
    (tmp_path / "my_law.py").write_text(CORRECT)
    for target, said in (("my_law.py:Lav", "error: my_law.py: no component called 'Lav'; did you mean 'Law'?"),
                         ("my_law.py:LawState", "error: my_law.py: no component called 'LawState'"),
                         ("my_low.py:Law", "error: there is no file 'my_low.py'"),
                         ("cubli_ros/appc_controler", "did you mean 'appc_controller'")):
        status, out, err = flight("check", target)
        assert (status, out, err.count("\n")) == (2, "", 1) and said in err, err


def test_json_holds_file_line_and_part(flight, tmp_path):
    from tests.messages.kernel_mistakes import FIELDS
    write(tmp_path, FIELDS[0])
    status, out, _ = flight("check", "my_law.py", "--json")
    found = json.loads(out)
    assert status == 1 and not found["correct"]
    mistake = found["components"][0]["mistakes"][0]
    assert mistake["line"] == FIELDS[0].line_number and mistake["file"].endswith("my_law.py")
    assert (mistake["component"], mistake["part"]) == ("Law", "kernel") and mistake["what"] in mistake["sentence"]


def test_a_file_that_is_no_utf_8_is_a_sentence(flight, tmp_path):
    (tmp_path / "my_law.py").write_bytes(b"# caf\xe9\n" + CORRECT.encode())
    status, out, err = flight("check", "my_law.py")
    assert (status, err) == (1, "") and out.startswith("my_law.py:1: this is no ")
