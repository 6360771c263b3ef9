"""The commands as a user gives them, in this process, in a folder of one's own."""

import sys

import pytest

from flight_graph.cli import main


@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """Run a command; return (status, standard output, standard error). The file my_law.py is loaded anew each time."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments):
        sys.modules.pop("my_law", None)
        monkeypatch.setattr(sys, "argv", ["flight", *map(str, arguments)])
        try:
            status = main()
        except SystemExit as end:
            status = end.code or 0
        captured = capsys.readouterr()
        return status, captured.out, captured.err
    yield run
    sys.modules.pop("my_law", None)


def judge(mistake, text: str, before: str = "") -> None:
    """A mistake is told in one line that names file and line, and holds what the mistake says."""
    assert text.startswith(f"{before}my_law.py:{mistake.line_number}: {mistake.where}"), text
    assert text.count("\n") == 1 and len(text) < 500, text
    for noise in ("Traceback", "numba", "Record(", "nopython"):
        assert noise not in text, text
    for part in mistake.said:
        assert part in text, text
