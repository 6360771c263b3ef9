"""Workers and coordinators that are killed: nothing is lost but the chunk in work, and the files are those of a calm day.

The full numbers (50 tasks, 25 kills) are those of benchmarks/campaign_kills.py.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flight_graph.campaigns import opening
from flight_graph.campaigns.dask_workers import DaskWorkers
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.workers import Threads
from flight_graph.components.foreign import agree
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.sampling.specifications import Besides
from tests.sweep.sweep_scenarios import RANDOM, campaign_file
from tests.sweep.test_campaign import parts

ROOT = Path(__file__).parents[2]
RUNS = 60
pytestmark = [pytest.mark.skipif(os.name != "posix", reason="kill -9 is of Unix"), pytest.mark.xdist_group("kills")]


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """A scenario file, and its campaign that nothing disturbed."""
    file = campaign_file(tmp_path_factory.mktemp("scenario") / "toy.yaml", {**RANDOM, "runs": RUNS}, duration_s=30.0)
    return file, opening.run_here(load(str(file), consent=agree), file.parent / "calm", chunk=2)


def flight(*words):
    """A process of the command line."""
    program = "import sys; from flight_graph.cli import main; sys.exit(main())"
    return subprocess.Popen([sys.executable, "-c", program, "sweep", *map(str, words), "--trust"], cwd=ROOT,
                            env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def until(condition, what, process, seconds=300.0):
    """Wait for something that a process does."""
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, f"{what} did not happen: {process.communicate()[0]}"
        assert time.monotonic() < end, f"{what} did not happen within {seconds:g} s"
        time.sleep(0.01)


def count(folder):
    return len(list(folder.glob("part-*.parquet")))


def planned(calm, folder):
    """The campaign of the scenario file, not run yet, and its scenario."""
    return opening.of_scenario(str(calm[0]), {}, Besides(), None, 2, lambda scenario: folder, False, agree)


def test_a_killed_coordinator_loses_the_chunks_in_work(calm, tmp_path):
    file, whole = calm
    process = flight(file, "--out", tmp_path / "c", "--chunk-size", 2, "--workers", 2)
    until(lambda: count(tmp_path / "c") > 0, "a first chunk", process)
    process.kill()
    process.communicate()
    left = parts(Campaign.at(tmp_path / "c"))
    assert 1 <= len(left) < RUNS // 2 and left.items() <= parts(whole).items()
    campaign, scenario = opening.existing(tmp_path / "c", None, agree)
    opening.fill(campaign, scenario, lambda *given: Threads(*given, 1))
    assert parts(campaign) == parts(whole)


def test_array_tasks_killed_repeated_and_twice_at_once(calm, tmp_path):
    campaign, scenario = planned(calm, tmp_path / "c")
    numbers = f"0-{RUNS // 2 - 1}"
    victim, other = (flight(campaign.path, "--chunk", numbers) for _ in range(2))
    until(lambda: count(campaign.path) > 0, "a first chunk", victim)
    victim.kill()
    victim.communicate()
    again = opening.run_chunks(campaign, scenario, opening.chunk_numbers(numbers, campaign.manifest), True, print)
    said = other.communicate()[0]
    assert (victim.returncode, other.returncode) == (-signal.SIGKILL, 0), said
    outcomes = {row["outcome"] for row in again}
    assert "there already" in outcomes <= {"there already", "done", "done again, equal", "completed"}, outcomes
    assert parts(campaign) == parts(calm[1]) and campaign.missing() == []


def test_dask_workers_that_are_killed(calm, tmp_path):
    """A cluster of two worker processes, of which one dies in the middle of its work."""
    distributed = pytest.importorskip("distributed")
    campaign, scenario = planned(calm, tmp_path / "c")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as cluster:
        killed = []

        def kill(rows, _):
            if rows > 4 and not killed:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        opening.fill(campaign, scenario, lambda manifest, _: DaskWorkers(manifest, cluster.scheduler_address), kill)
    assert killed and parts(campaign) == parts(calm[1])


def test_nobody_answers(calm, tmp_path):
    pytest.importorskip("distributed")
    with pytest.raises(FlightError, match="no Dask scheduler answers there"):
        DaskWorkers(calm[1].manifest, "tcp://127.0.0.1:9", answer_s=0.5)
    with pytest.raises(FlightError, match="no Dask scheduler answers there"):
        DaskWorkers(calm[1].manifest, "no address at all", answer_s=0.5)
