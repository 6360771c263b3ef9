"""The command line called in this process: status, standard output, standard error."""

import sys
from dataclasses import dataclass

from flight_graph.cli import main


@dataclass
class Called:
    status: int
    out: str
    err: str


class CommandLine:
    """flight("verify", bag) as a shell would call it."""

    def __init__(self, monkeypatch, capsys):
        self._monkeypatch, self._capsys = monkeypatch, capsys

    def __call__(self, *arguments) -> Called:
        self._monkeypatch.setattr(sys, "argv", ["flight", *map(str, arguments)])
        self._capsys.readouterr()
        try:
            status = main()
        except SystemExit as end:
            status = end.code or 0
        out, err = self._capsys.readouterr()
        return Called(status, out, err)
