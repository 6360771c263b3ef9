"""Commands in this process, as a person types them."""

import sys

from flight_graph.cli import main


def runner(monkeypatch, capsys):
    """A function that runs a command and returns (status, standard output, standard error); no traceback is ever said."""
    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["flight", *map(str, arguments)])
        try:
            status = main()
        except SystemExit as end:
            status = end.code or 0
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err + captured.out
        return status, captured.out, captured.err
    return run
