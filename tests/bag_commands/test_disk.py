"""Recording to disk: how often, and to one that is full or read-only (a real one, in a mount namespace of its own)."""

import shutil
import subprocess
import time

import numpy as np
import pytest

from flight_graph.bags.reader import read_bag
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import RunBag
from tests.graph import toy
from tests.ros.processes import FLIGHT, environment, until

DISK = ("unshare", "--mount", "--map-root-user", "sh", "-c")


@pytest.fixture
def on_disk(tmp_path):
    """on_disk(options of the mount, command, ...): run flight commands, one after another, on a small disk at ./disk;
    return [(status, standard error)]."""
    if shutil.which("unshare") is None or subprocess.run([*DISK, "true"], capture_output=True).returncode:
        pytest.skip("a mount namespace is not allowed here")
    (tmp_path / "disk").mkdir()

    def run(options, *commands):
        (tmp_path / "flight").write_text(f"#!/bin/sh\nexec '{FLIGHT[0]}' -c '{FLIGHT[2]}' \"$@\"\n")
        (tmp_path / "flight").chmod(0o755)
        lines = [f"./flight {command} 2>err{number}; echo $?" for number, command in enumerate(commands)]
        done = subprocess.run([*DISK, "\n".join([f"mount -t tmpfs -o {options} tmpfs disk || exit 9", *lines])],
                              cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stderr
        statuses = [int(word) for word in done.stdout.split() if word.isdigit()]
        return [(status, " ".join((tmp_path / f"err{number}").read_text().split()))
                for number, status in enumerate(statuses)]
    return run


@pytest.mark.parametrize("engine", ["compiled", pytest.param("ros", marks=pytest.mark.ros)])
def test_a_full_disk(on_disk, tmp_path, engine):
    """300 kB are there, the run needs some 900: a sentence, a mark, and recover saves what was written."""
    if engine == "ros":
        pytest.importorskip("rclpy")
    run, info, recover = on_disk(
        "size=300k", f"run cubli_asteroid --engine {engine} --duration 8 --out disk/bag > log",
        "info disk/bag > log", "recover disk/bag --out saved > log")
    assert run[0] == 2 and "no space left on device" in run[1] and "Traceback" not in run[1], run
    assert info[0] == 2 and "flight recover" in info[1], info
    assert recover[0] == 0, recover
    stamps = read_bag(tmp_path / "saved").stamps_ns("/cubli/imu")
    assert len(stamps) > 50 and (np.diff(stamps) == 10_000_000).all()


def test_a_read_only_disk(on_disk, tmp_path):
    (run,) = on_disk("ro", "run cubli_earth --duration 0.5 --out disk/bag > log")
    assert run[0] == 2 and "cannot be written" in run[1] and "read-only" in run[1], run


def test_the_scenario_says_how_often_messages_reach_the_disk(tmp_path):
    for period, reaches in ((0.02, True), (60.0, False)):
        bag = RunBag(tmp_path / f"every {period}", Scenario(toy.scenario(record={"flush_period_s": period}), "t"), "ros", "lockstep")
        journal = tmp_path / f"every {period}" / "RECORDING"
        bag.write(bag.topics[0], 0, bag.topics[0].signal.template)
        if reaches:
            until(lambda: bag.topics[0].signal.template[4:] in journal.read_bytes(), 10.0, "the message in RECORDING")
        else:
            time.sleep(0.3)  # many times the default
            assert bag.topics[0].signal.template[4:] not in journal.read_bytes()
        bag.close({"complete": "false", "lost": "0"})
    with pytest.raises(FlightError, match="record.flush_period_s"):
        Scenario(toy.scenario(record={"flush_period_s": 0}), "t")
