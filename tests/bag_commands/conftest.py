import dataclasses

import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import write_recording
from tests.bag_commands.command_line import CommandLine


@pytest.fixture
def flight(monkeypatch, capsys):
    return CommandLine(monkeypatch, capsys)


def recorded(name, overrides, folder, change=None):
    """Run a scenario and write its bag. change(recording) may alter what is written; it returns a recording."""
    recording = CompiledRun(load(name, overrides)).run()
    write_recording(recording if change is None else change(dataclasses.replace(recording)), folder, "compiled")
    return folder


@pytest.fixture(scope="session")
def asteroid(tmp_path_factory):
    """Four seconds of the rover with sensors, filter and noise: six components at two rates."""
    return recorded("cubli_asteroid", {"duration_s": 4}, tmp_path_factory.mktemp("runs") / "asteroid")


@pytest.fixture(scope="session")
def earth(tmp_path_factory):
    return recorded("cubli_earth", {"duration_s": 0.5}, tmp_path_factory.mktemp("runs") / "earth")
