"""A mistake in a kernel is one sentence: file, line, component, part, what is wrong, what is allowed; before compiling."""

import pytest

from tests.messages.conftest import judge
from tests.messages.kernel_mistakes import MISTAKES
from tests.messages.mistakes import write


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_check_and_run_say_one_sentence(flight, tmp_path, mistake):
    _, scenario = write(tmp_path, mistake)
    status, out, err = flight("check", "my_law.py")
    assert (status, err) == (1, "")
    judge(mistake, out)
    status, out, err = flight("run", scenario)
    assert (status, out) == (2, "")
    judge(mistake, err, "error: my_law.yaml: components.controller.use: ")
