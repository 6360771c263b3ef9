"""Sweeps: a case is the same run wherever it runs; bad runs are rows; nothing that was done is lost."""

import json
import threading

import pyarrow.parquet
import pytest
import yaml
from typer.testing import CliRunner

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.cli.app import app
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import BagSignals
from flight_graph.sweeps import sweep as sweeps
from tests.sweep.sweep_scenarios import RANDOM, digest, swept


def table(folder):
    return (folder / sweeps.TABLE).read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return sweeps.run_sweep(sweeps.Sweep(swept(RANDOM)), folder, jobs=1), folder


@pytest.fixture(scope="module")
def scenario_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "toy.yaml"
    data = swept(RANDOM).file.model_dump(by_alias=True, exclude_none=True)
    path.write_text(yaml.safe_dump(data))
    return path


def test_rows_do_not_depend_on_the_number_of_threads(whole, tmp_path):
    rows, folder = whole
    assert [row.case for row in rows] == list(range(12)) and {row.status for row in rows} == {"ok"}
    assert len({row.metrics["digest"] for row in rows}) == 12
    sweeps.run_sweep(sweeps.Sweep(swept(RANDOM)), tmp_path, jobs=4)
    assert table(tmp_path) == table(folder)


@pytest.mark.parametrize("case", [0, 7])
def test_one_case_alone_to_a_bag_is_the_same_run(whole, scenario_file, tmp_path, case):
    """The digest of every recorded byte: in the sweep, in a run of its own, and read back from its bag."""
    scenario = load(str(scenario_file), case=case)
    outcome = runs.execute(scenario, out=tmp_path / "bag")
    assert outcome.metrics == whole[0][case].metrics
    assert digest(scenario, BagSignals(read_bag(outcome.bag), scenario))["digest"] == outcome.metrics["digest"]
    assert scenario.seed == 50 + case == whole[0][case].seed


def test_handed_on_memory_changes_no_byte():
    logs = {}
    sweep = sweeps.Sweep(swept(RANDOM))
    sweep.run(3, logs=logs)
    kept = CompiledRun(sweep.case(4)).run(logs=logs)
    fresh = CompiledRun(sweep.case(4)).run()
    assert [a.records.tobytes() for a in kept.tracks] == [b.records.tobytes() for b in fresh.tracks]


def test_rates_and_components_are_varied_too(tmp_path):
    vary = {"grid": {"controller.rate_hz": [50, 100], "controller.law": ["pd", "p"], "duration_s": [0.5, 1.0]}}
    rows = sweeps.run_sweep(sweeps.Sweep(swept(vary)), tmp_path, jobs=2)
    assert {row.status for row in rows} == {"ok"} and len({row.metrics["digest"] for row in rows}) == 8
    read = pyarrow.parquet.read_table(tmp_path / sweeps.TABLE).to_pydict()
    assert read["controller.law"] == ["pd", "pd", "p", "p"] * 2 and read["controller.rate_hz"][4] == 100
    assert read["duration_s"] == [0.5, 1.0] * 4


def test_runs_that_end_badly_are_rows(tmp_path):
    cases = [{"name": "good", "plant.inertia": 2.0}, {"name": "fault", "controller.angle_limit": 0.01},
             {"name": "nonfinite", "plant.stiffness": 1e308, "plant.inertia": 1e-3},
             {"name": "refused", "watcher.rate_hz": 25}, {"name": "error", "plant.inertia": 3.0}]
    rows = sweeps.run_sweep(sweeps.Sweep(swept({"cases": cases})), tmp_path, jobs=2)
    assert [row.status for row in rows] == ["ok", "fault", "nonfinite", "refused", "error"]
    words = ["", "the angle left the limit of 0.01 rad", "only finite numbers are published", "no multiple",
             "an inertia of 3 is not judged"]
    for row, text in zip(rows, words):
        assert text in row.sentence
    read = pyarrow.parquet.read_table(tmp_path / sweeps.TABLE).to_pydict()
    assert read["name"] == [case["name"] for case in cases]
    assert read["angle"][0] > 0 and read["angle"][1:] == [None] * 4


def test_interrupted_and_continued(whole, tmp_path):
    sweep = sweeps.Sweep(swept(RANDOM))

    def stop(done, total):
        if done >= 3:
            raise KeyboardInterrupt

    slow = threading.Event()
    original = sweep.run
    sweep.run = lambda *given: (slow.wait(0.1), original(*given))[1]
    with pytest.raises(KeyboardInterrupt):
        sweeps.run_sweep(sweep, tmp_path, jobs=1, progress=stop)
    done = pyarrow.parquet.read_table(tmp_path / sweeps.TABLE).num_rows
    assert 3 <= done < 12
    assert not list(tmp_path.glob("*.tmp"))
    again = sweeps.Sweep(swept(RANDOM))
    rerun = []
    again.run = lambda number, *given: (rerun.append(number), sweeps.Sweep(swept(RANDOM)).run(number))[1]
    sweeps.run_sweep(again, tmp_path, jobs=2, resume=True)
    assert len(rerun) == 12 - done and table(tmp_path) == table(whole[1])


def test_only_the_same_sweep_is_continued(whole, tmp_path):
    other = sweeps.Sweep(swept({**RANDOM, "seed": 1}))
    with pytest.raises(FlightError, match="is another one"):
        sweeps.run_sweep(other, whole[1], resume=True)
    with pytest.raises(FlightError, match="holds no sweep"):
        sweeps.run_sweep(other, tmp_path, resume=True)


def test_command_line(scenario_file, whole, tmp_path):
    done = CliRunner().invoke(app, ["sweep", str(scenario_file), "--trust", "--runs", "5", "--jobs", "2", "--json", "--out",
                                    str(tmp_path / "a")], catch_exceptions=False)
    found = json.loads(done.stdout)
    assert (found["runs"], found["ok"], found["failed"]) == (5, 5, [])
    angles = [row.metrics["angle"] for row in whole[0][:5]]
    assert found["metrics"]["angle"]["largest"] == max(angles)
    assert found["metrics"]["angle"]["largest_case"] == angles.index(max(angles))
    assert found["metrics"]["angle"]["median"] == sorted(angles)[2]
    again = CliRunner().invoke(app, ["run", str(scenario_file), "--trust", "--case", "4", "--json", "--out",
                                     str(tmp_path / "b")],
                               catch_exceptions=False)
    assert json.loads(again.stdout)["metrics"] == whole[0][4].metrics
    shown = CliRunner().invoke(app, ["sweep", str(scenario_file), "--trust", "--out", str(tmp_path / "a"), "--resume"],
                               catch_exceptions=False)
    assert "12 runs" in shown.stdout and table(tmp_path / "a") == table(whole[1])


@pytest.mark.parametrize(("arguments", "words"), [
    (["sweep", "cubli_asteroid"], "nothing to sweep"),
    (["run", "cubli_asteroid", "--case", "0"], "it has no case 0"),
    (["sweep", "FILE", "--runs", "0"], "--runs 0"),
    (["sweep", "FILE", "--set", "seed=3"], "'seed' is varied by the sweep"),
    (["run", "FILE", "--case", "1", "--seed", "3"], "'seed' is varied"),
    (["run", "FILE", "--case", "-1"], "there is no case -1"),
    (["sweep", "FILE", "--resume"], "name the sweep's folder"),
])
def test_command_line_refusals(scenario_file, arguments, words):
    trusted = ["--trust"] if "FILE" in arguments else []  # the toy's components lie in another folder than its scenario
    arguments = [str(scenario_file) if text == "FILE" else text for text in arguments] + trusted
    failed = CliRunner().invoke(app, arguments)
    assert isinstance(failed.exception, FlightError) and words in str(failed.exception)


def test_more_runs_than_cases_need_a_draw():
    sweep = sweeps.Sweep(swept({"grid": {"plant.inertia": [1.0, 2.0]}}))
    with pytest.raises(FlightError, match="1 to 2"):
        sweep.cases(3)
    assert len(sweeps.Sweep(swept(RANDOM)).cases(1000)) == 1000
