"""Realtime: processes that stop, die and begin anew; the graph goes into its safe state, or the run ends and says who failed."""

import json
import os
import signal

import numpy as np
import pytest
import yaml

from flight_graph.bags.reader import read_bag
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import open_run
from flight_graph.ros.patience import at_least
from tests.ros import toy_modes
from tests.ros.processes import alive, children, flight, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("watchdog")]

PERIOD_S = 0.01  # [s] of control
NODES = {"plant", "sensor", "controller", "watcher", "modes", "monitors", "recorder"}
WATCHDOG = {"gap_s": at_least(1.5), "restart": {"limit": 3, "window_s": 600}}


def write(folder, **overrides):
    path = folder / "toy.yaml"
    path.write_text(yaml.safe_dump(toy_modes.scenario(**overrides)))
    return "run", path, "--trust", "--engine", "ros", "--pace", "realtime", "--out", folder / "bag", "--json"


def entered_s(bag) -> float:
    """When the graph went into its safe state [s]."""
    _, scenario, signals = open_run(bag, trust=True)
    mode = signals["toy/mode"]
    return float(mode["entered"][mode["mode"] == 1.0][0])


def last_command_s(bag, before: float) -> float:
    """Stamp of the last command before the longest silence that begins before a time [s]."""
    found, scenario, _ = open_run(bag, trust=True)
    stamps = (found.stamps_ns("/toy/command") - scenario.epoch_ns) / 1e9
    begins = stamps[:-1][stamps[:-1] < before]
    return float(begins[np.argmax(np.diff(stamps)[:len(begins)])])


def test_a_scenario_with_a_watchdog_is_checked():
    assert Scenario(toy_modes.scenario(watchdog=WATCHDOG), "toy").file.watchdog.restart.limit == 3
    for wrong, said in (({"gap_s": 0}, "greater than 0"), ({"restarts": 3}, "gap_s, restart")):
        with pytest.raises(ValueError, match=said):
            Scenario(toy_modes.scenario(watchdog=wrong), "toy")


def test_faults_of_components_stop_kill_and_start_processes(tmp_path):
    """A law that hangs makes the graph safe within two periods of the monitor's deadline; a crash is for good; a restart joins."""
    faults = [{"id": "law", "at": "controller", "type": "hang", "from_s": 2, "for_s": 1},
              {"id": "eye", "at": "watcher", "type": "crash", "from_s": 3},
              {"id": "again", "at": "controller", "type": "restart", "from_s": 4, "for_s": 0.5}]
    done = flight(*write(tmp_path, duration_s=at_least(20.0), faults=faults), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said, bag = json.loads(done.stdout), read_bag(tmp_path / "bag")
    assert [text.partition(": ")[2] for text in said["watchdog"]] == [
        "law: the node controller is stopped", "law: the node controller goes on", "eye: the node watcher is killed",
        "again: the node controller is killed", "again: the node controller is started again"]
    assert list(bag.metadata["flight_graph.watchdog"].values()) == said["watchdog"]
    assert bag.metadata["flight_graph.outcome"]["complete"] == "true"
    deadline = last_command_s(tmp_path / "bag", 2.5) + toy_modes.STALE_S
    assert deadline - 1e-9 <= entered_s(tmp_path / "bag") <= deadline + 2.0 * PERIOD_S + 1e-9
    stamps = (bag.stamps_ns("/toy/command") - bag.stamps_ns("/toy/truth")[0]) / 1e9
    assert stamps[-1] > 4.6, "the restarted controller answers"
    watched = (bag.stamps_ns("/toy/watch") - bag.stamps_ns("/toy/truth")[0]) / 1e9
    assert watched[-1] <= 3.1, "the crashed watcher is gone"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_node_that_is_lost_is_started_again(tmp_path, number):
    with running(*write(tmp_path, duration_s=at_least(20.0), watchdog=WATCHDOG), cwd=tmp_path) as process:
        pids = until(lambda: there if NODES <= (there := children(process.pid)).keys() else None, 60.0, "the nodes")
        until(lambda: sum(path.stat().st_size for path in (tmp_path / "bag").glob("*.mcap")) > 100_000
              if (tmp_path / "bag").exists() else False, 60.0, "messages in the bag")
        os.kill(pids["controller"], number)
        out, err = process.communicate(timeout=at_least(90.0))
    assert process.returncode == 0, err
    said = json.loads(out)["watchdog"]
    assert any("controller" in text and "started again" in text for text in said), said
    assert not any(map(alive, pids.values()))
    bag = read_bag(tmp_path / "bag")
    assert bag.metadata["flight_graph.outcome"]["complete"] == "true"
    entered = entered_s(tmp_path / "bag")
    deadline = last_command_s(tmp_path / "bag", entered) + toy_modes.STALE_S
    assert deadline - 1e-9 <= entered <= deadline + 2.0 * PERIOD_S + 1e-9
    assert (bag.stamps_ns("/toy/command")[-1] - bag.stamps_ns("/toy/truth")[-1]) / 1e9 > -0.5, "it answers to the end"


@pytest.mark.parametrize(("number", "said"), [
    (signal.SIGKILL, "the node controller ended by itself (signal SIGKILL)"),
    (signal.SIGSTOP, "the node controller is silent: it has come to t = ")])
def test_without_a_restart_the_run_ends_and_names_the_node(tmp_path, number, said):
    watchdog = {"gap_s": WATCHDOG["gap_s"]}
    with running(*write(tmp_path, duration_s=600.0, watchdog=watchdog), cwd=tmp_path) as process:
        pids = until(lambda: there if NODES <= (there := children(process.pid)).keys() else None, 60.0, "the nodes")
        until(lambda: sum(path.stat().st_size for path in (tmp_path / "bag").glob("*.mcap")) > 100_000
              if (tmp_path / "bag").exists() else False, 60.0, "messages in the bag")
        os.kill(pids["controller"], number)
        _, err = process.communicate(timeout=at_least(90.0))
    assert process.returncode == 2
    assert f"error: {said}" in err and "Traceback" not in err, err
    assert not any(map(alive, pids.values()))
    assert read_bag(tmp_path / "bag").metadata["flight_graph.outcome"]["complete"] == "false"
