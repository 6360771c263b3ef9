"""Advice that can be followed, and options that are not passed over."""

import re
import shlex

import numpy as np
import pytest

from flight_graph.engines.compiled import LONGEST_CHUNK, CompiledRun
from flight_graph.engines.flight import Flight
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from tests.bag.sample_bags import write_bag


def test_recover_into_a_folder_that_is_there(flight, tmp_path):
    bag = write_bag(tmp_path / "hop").folder
    (tmp_path / "there").mkdir()
    done = flight("recover", bag, "--out", tmp_path / "there")
    assert done.status == 2 and "exists already; name a folder that is not there yet" in done.err and "overwrit" not in done.err


def test_advice_with_a_path_can_be_pasted(flight, tmp_path):
    made = write_bag(tmp_path / "a bag; $(touch x)")
    made.mcap.write_bytes(made.mcap.read_bytes()[:-100])
    done = flight("info", made.folder)
    command = re.search(r"`(flight recover .*?)`", done.err)[1]
    assert done.status == 2 and shlex.split(command) == ["flight", "recover", str(made.folder)]
    assert flight(*shlex.split(command)[1:]).status == 0


@pytest.mark.parametrize("command", [("plot", "BAG"), ("export", "BAG"), ("recover", "BAG"), ("design", "cubli", "--gravity", "8e-5")])
@pytest.mark.parametrize("place", ["file/below", "x" * 300 + "/y", "file"])
def test_a_place_that_cannot_be_written(flight, tmp_path, earth, command, place):
    (tmp_path / "file").write_text("")
    done = flight(*[earth if part == "BAG" else part for part in command], "--out", place)
    assert done.status == 2 or (command[0], place) == ("plot", "file"), done.err
    assert done.err.startswith("error: ") or done.status == 0, done.err


@pytest.mark.parametrize("engine", ["compiled", "python"])
@pytest.mark.parametrize("pace", ["realtime", "realtime:2"])
def test_a_pace_is_of_the_ros_engine(flight, monkeypatch, tmp_path, engine, pace):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "0")
    done = flight("run", "cubli_asteroid", "--engine", engine, "--pace", pace)
    assert done.status == 2 and f"--pace {pace.partition(':')[0]}" in done.err and "--engine ros" in done.err, done.err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("name", ["a\nb", "\x1b[31m", "x" * 250, "y" * 300, "/".join(["z" * 200] * 30)])
def test_out_that_no_disk_has(flight, tmp_path, name):
    done = flight("run", "cubli_asteroid", "--out", name)
    assert done.status == 2 and "this is no name of a folder" in done.err and "\x1b" not in done.err, done.err
    assert list(tmp_path.iterdir()) == []


def test_numbers_of_set_as_people_write_them(flight):
    for text, number in (("1e-3", 1e-3), ("1E-3", 1e-3), (".001", 1e-3), ("1.e-3", 1e-3)):
        from flight_graph.graphs.overrides import parse_settings
        assert parse_settings([f"controller.k_a={text}"]) == {"controller.k_a": number}
    assert load("cubli_asteroid", {"controller.k_a": 1e-3}).graph.nodes["controller"].values["k_a"]


def test_no_gain_is_advised_where_none_helps():
    """At rest e_u = -v_a grows with lambda_a, so one is small enough; at speed beyond the bound none is."""
    at_rest = {"plant.rate_hz": 100, "controller.rate_hz": 100, "duration_s": 0.1, "controller.lambda_a": 0.06}
    with pytest.raises(FlightError, match="take a lambda_a below") as caught:
        CompiledRun(load("cubli_asteroid_paper", at_rest)).run()
    named = [float(number) for number in re.search(r"below \[(.*?)\]", str(caught.value))[1].split(",")]
    assert (np.array(named) > 0.0).all()
    spinning = {**at_rest, "plant.initial_rates": [1.0, 1.0, 1.0]}
    with pytest.raises(FlightError, match="whatever lambda_a; widen rho_u0, start more slowly") as caught:
        CompiledRun(load("cubli_asteroid_paper", spinning)).run()
    assert "below [0" not in str(caught.value)


@pytest.mark.parametrize(("options", "words"), [
    (["run", "lander_monte_carlo", "--case", 10**30], "there is no case"), (["run", "lander_monte_carlo", "--case", -1], "there is no case"),
    (["sweep", "lander_monte_carlo", "--runs", 10**12], "--runs 1000000000000: allowed: 1 to 1000000 in one sweep"),
    (["sweep", "lander_monte_carlo", "--runs", 0], "--runs 0: allowed"), (["run", "cubli_asteroid", "--seed", 2**70], "seed: "),
    (["run", "cubli_asteroid", "--duration", 1e300], "duration_s: 1e+300 is not allowed; allowed: at most 1e+09 s"),
    (["run", "cubli_asteroid", "--set", "plant.gravity=1e400"], "gravity: inf is not allowed"),
    (["run", "cubli_asteroid", "--set", "plant.gravity_sign=" + "9" * 30], "gravity_sign"),
    (["run", "cubli_asteroid", "--set", "plant.gravity=" + "[" * 2000], "is no value"),
    (["run", "cubli_asteroid", "--set", "plant.rate_hz=1e-12"], "plant.rate_hz"),
    (["run", "cubli_asteroid", "--set", "plant.rate_hz=1e300"], "plant.rate_hz"),
    (["run", "cubli_asteroid", "--set", "controller.use=.relative:Law"], "controller.use"),
    (["run", "cubli_asteroid", "--set", "controller.use=:Law"], "controller.use"),
    (["run", "cubli_asteroid", "--set", "controller.use=os:kill"], "is not a component"),
    (["run", "cubli_asteroid", "--set", "metrics=os:kill"], "metrics: 'os:kill' is of Python's own library"),
    (["run", "cubli_asteroid", "--set", "name=../up"], "name: '../up' is not allowed; allowed: letters, digits and _ - ."),
    (["run", "lander_bennu_polyhedral", "--set", "plant.gravity_model=mesh", "--set", "plant.mesh=" + "x" * 5000], "mesh"),
    (["run", "lander_bennu_polyhedral", "--set", "plant.gravity_model=mesh", "--set", "plant.mesh=" + "x" * 300], "mesh"),
    (["run", "lander_bennu_polyhedral", "--set", "plant.gravity_model=mesh", "--set", "plant.mesh=/dev/zero"], "no ordinary file"),
    (["node", "../x/y"], "no package called '..'"), (["node", "cubli_ros/../x"], "no executable called '../x'"),
])
def test_values_beyond_reason(flight, tmp_path, options, words):
    done = flight(*options)
    assert done.status == 2 and done.err.startswith("error: ") and words in done.err and len(done.err) < 3000, done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", ["{", "[]", "[" * 100_000, "1", ""])
def test_a_sweep_that_is_continued_from_something_else(flight, tmp_path, content):
    (tmp_path / "campaign.json").write_text(content)
    for words in (["lander_monte_carlo", "--resume", "--out", tmp_path], [tmp_path, "--resume"]):
        done = flight("sweep", *words)
        assert done.status == 2 and "campaign.json: this is no " in done.err, done.err


def test_a_run_without_end_can_be_interrupted(monkeypatch):
    """Also one that records nothing, and that nobody watches."""
    loaded = load("cubli_asteroid", {"duration_s": 1e7, "record": {"topics": []}})
    advance, ends = Flight.advance, []

    def watched(flight, tick):
        ends.append(tick)
        advance(flight, min(tick, 100))  # the ticks themselves are not the point
        if len(ends) == 3:
            raise KeyboardInterrupt
    monkeypatch.setattr(Flight, "advance", watched)
    with pytest.raises(KeyboardInterrupt):
        CompiledRun(loaded).run()
    assert max(ends) <= 3 * LONGEST_CHUNK
