"""`flight view`, `flight serve` and `flight layout` in wrong hands: a sentence, and what to do."""

import socket
import sys

import pytest

from tests.commands import runner

BAG = "bags/cubli_asteroid"


@pytest.fixture
def run(monkeypatch, capsys):
    return runner(monkeypatch, capsys)


@pytest.mark.parametrize("module, extra, arguments", [
    ("rerun", "rerun-sdk", ["view", BAG, "--web"]), ("foxglove", "foxglove-sdk", ["serve", BAG]),
    ("rerun", "rerun-sdk", ["layout", "cubli_asteroid", "--for", "rerun", "--out", "never.rbl"]),
    ("rerun", "rerun-sdk", ["run", "cubli_asteroid", "--live", "--out", "never"])])
def test_what_is_not_installed_is_named_with_the_command_that_installs_it(run, monkeypatch, module, extra, arguments):
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)  # an import of it fails as where it is not installed
    status, _, said = run(*arguments)
    assert status == 2 and "is not installed; to install it: " in said and f"-m pip install '{extra}" in said


@pytest.mark.parametrize("arguments, sentence", [
    (["view", BAG], "no display here"),
    (["view", BAG, "--web", "--save", "x.rrd"], "one at a time"),
    (["view", BAG, "--save", "x.rrd", "--seed", "3"], "--seed: a bag stays as it was recorded"),
    (["view", "nowhere.mcap", "--save", "x.rrd"], "there is no bag at 'nowhere.mcap'"),
    (["view", "cubli_asteroit", "--save", "x.rrd"], "did you mean 'cubli_asteroid'"),
    (["view", BAG, "--save", "README.md"], "--save README.md: it exists already"),
    (["view", BAG, "--save", "no/such/x.rrd"], "cannot be written"),
    (["run", "cubli_asteroid", "--pace", "realtime", "--out", "never"], "a pace is kept with --engine ros, or --live"),
    (["serve"], "needs a bag or a scenario, or --ros"),
    (["serve", BAG, "--ros"], "needs a bag or a scenario, or --ros"),
    (["serve", BAG, "--speed", "-1"], "allowed: simulated seconds a second"),
    (["serve", BAG, "--speed", "nan"], "allowed: simulated seconds a second"),
    (["serve", BAG, "--set", "a.b=1"], "--set: these are for a scenario that flies"),
    (["serve", "cubli_asteroid", "--loop"], "only a bag can begin again"),
    (["serve", "cubli_asteroid", "--out", "docs"], "it exists already"),
    (["layout", "cubli_asteroid", "--for", "excel"], "no viewer called 'excel'"),
    (["layout", "cubli_asteroid", "--for", "rerun"], "--out FILE.rbl says where it goes"),
    (["layout", "cubli_asteroid", "--out", "README.md"], "cannot be written (file exists)")])
def test_wrong_use_is_a_sentence(run, monkeypatch, arguments, sentence):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (RERUN=none, or make viewers brings it)")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    status, _, said = run(*arguments)
    assert status == 2 and sentence in said, said


def test_a_port_that_is_taken(run):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (RERUN=none, or make viewers brings it)")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        for arguments in (["view", BAG, "--web", "--port", port], ["serve", BAG, "--port", port]):
            status, _, said = run(*arguments)
            assert status == 2 and f"--port {port}: nothing can be served there" in said and "another port" in said
