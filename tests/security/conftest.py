import pytest

from tests.bag_commands.command_line import CommandLine


@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """The command line in a folder of its own, without a terminal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    return CommandLine(monkeypatch, capsys)
