"""flight check and flight run from a terminal: a correct component, and mistakes that take the compiler or a run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.messages.compiler_mistakes import MISTAKES as COMPILER_MISTAKES
from tests.messages.conftest import judge
from tests.messages.kernel_mistakes import MISTAKES
from tests.messages.mistakes import CORRECT, Mistake, inserted, write

pytestmark = pytest.mark.xdist_group("flight check")  # what all commands compile is compiled once

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = [
    inserted("index that depends on the state", "x.count += int(p.table[x.count + 4, 0])", "an index is outside"),
    inserted("loop that depends on the state", "for i in range(x.count + 5):\n    x.count += int(torque[i])",
             "an index is outside", line="torque[i]"),
    inserted("fault without a sentence", "x.fault = 9", "it sets the fault 9", "have no sentence", line="def law("),
    inserted("fault among the codes of errors", "x.fault = -4611686018427387904 + 5", "it sets the fault -46116",
             "have no sentence", line="def law("),
]


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def terminal(tmp_path, cache):
    """Run a command in a process of its own; return (status, standard output, standard error)."""
    def run(*arguments):
        done = subprocess.run(
            [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())", *map(str, arguments)],
            cwd=tmp_path, capture_output=True, text=True, timeout=200,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", "FLIGHT_CACHE_DIR": str(cache)})
        return done.returncode, done.stdout, done.stderr
    return run


def test_a_correct_component_is_called_correct(terminal, tmp_path):
    (tmp_path / "my_law.py").write_text(CORRECT)
    assert terminal("check", "my_law.py:Law") == (0, "my_law.py:Law: correct (kernel)\n", "")


def test_a_loop_without_end_is_found(terminal, tmp_path):
    mistake = inserted("endless", "while x.count < 1:\n    command.effort = torque", "does not come to its end on empty inputs",
                       line="def law(")
    write(tmp_path, mistake)
    status, out, _ = terminal("check", "my_law.py")
    assert status == 1
    judge(mistake, out)


@pytest.mark.parametrize("mistake", [MISTAKES[0], COMPILER_MISTAKES[0], *OUTSIDE], ids=lambda mistake: mistake.name)
def test_check_says_one_sentence(terminal, tmp_path, mistake: Mistake):
    write(tmp_path, mistake)
    status, out, err = terminal("check", "my_law.py")
    assert (status, err) == (1, "")
    judge(mistake, out)


def test_run_compiles_the_own_file_first(terminal, tmp_path):
    """The other components are not in the cache; the sentence comes long before they would be."""
    _, scenario = write(tmp_path, COMPILER_MISTAKES[1])
    status, out, err = terminal("run", scenario)
    assert (status, out) == (2, "")
    judge(COMPILER_MISTAKES[1], err, "error: ")
    assert err.endswith("; nothing was recorded\n")
