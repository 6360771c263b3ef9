"""A run that is stepped through stands where the whole run stood: forwards, backwards, in branches, and beside another bag."""

import gc
import os
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from flight_graph import runs
from flight_graph.engines.checkpoint import is_kept
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.recordings.continuation import continued
from flight_graph.recordings.recorded_run import open_recorded
from flight_graph.stepping.difference import first_difference
from flight_graph.stepping.kept import MOST, SPACING, Kept
from flight_graph.stepping.stepper import Stepper
from tests.faults import chain
from tests.faults.everything import FAULTS, MONITORS
from tests.graph.test_stopped_runs import stopping
from tests.stepping.bags import changed

ROOT = Path(__file__).resolve().parents[2]
EVERYTHING = chain.data(FAULTS, monitors=MONITORS)


@pytest.fixture(scope="module")
def scenario():
    return load("cubli_earth", {"duration_s": 0.5})


@pytest.fixture(scope="module")
def whole(scenario):
    return CompiledRun(scenario).run()


def memory(run: Stepper) -> dict:
    """All that the run remembers, as bytes."""
    return {name: array.tobytes() for name, array in run.flight.arrays.items() if is_kept(name)}


def test_until_a_time_shows_what_the_run_recorded(scenario, whole):
    run = Stepper(scenario)
    assert run.until(0.25) and (run.tick, run.t_s, run.upcoming) == (250, 0.25, ("plant", "output"))
    assert run.read("controller.command.effort").tolist() == whole["cubli/wheel_command"]["effort"][249].tolist()
    assert run.read("controller.command")["header"]["stamp"]["nanosec"] == 249_000_000
    assert run.until(tick=100) and run.read("command.effort[1]") == whole["cubli/wheel_command"]["effort"][99, 1]
    assert not run.until(2.0) and run.tick == 500 and run.upcoming is None


def test_until_a_condition(scenario, whole):
    """The first tick before which it holds, as found in the recording."""
    rates = abs(whole["cubli/wheel_state"]["velocity"][:, 0])
    level = float(rates[:400].max()) * 0.5
    first = int(np.flatnonzero(rates > level)[0]) + 1
    run = Stepper(scenario)
    assert run.until(f"abs(plant.wheels.velocity[0]) > {level!r}") and run.tick == first
    assert run.until(f"plant.wheels.velocity[0] < 1e9 and t >= {first / 1000 + 0.0105!r}") and run.tick == first + 11
    assert not run.until("t > 1") and run.tick == 500


def test_until_a_firing_and_one_step(scenario, whole):
    run = Stepper(scenario)
    assert run.until("controller") and (run.tick, run.upcoming) == (0, ("controller", "kernel"))
    assert run.until("controller") and run.tick == scenario.graph.nodes["controller"].period_ns // scenario.graph.base_ns
    before = run.read("controller.command.effort")
    assert run.step()
    after = run.read("controller.command.effort")
    efforts = whole["cubli/wheel_command"]["effort"]
    assert before.tolist() == efforts[0].tolist() and after.tolist() == efforts[1].tolist()
    assert run.state["controller"].dtype.names and run.parameters["controller"].lambda_a[0] > 0
    with pytest.raises(KeyError, match="known: plant"):
        run.state["nobody"]


def test_back_is_bit_for_bit_in_a_graph_full_of_faults():
    """Forwards by firings and by ticks in any mixture, and back: the memory is that of the first time."""
    run, seen, chance = Stepper(chain.Scenario(EVERYTHING, "chain.yaml")), {}, np.random.default_rng(1)
    for _ in range(400):
        seen[run.tick, run.flight.fired] = memory(run)
        run.step()
    straight = Stepper(chain.Scenario(EVERYTHING, "chain.yaml"))
    assert straight.until(tick=run.tick) and memory(straight) == memory(run.until(tick=run.tick) and run)
    for _ in range(60):
        choice = chance.integers(4)
        count = int(chance.integers(1, 60))
        if choice == 0:
            run.back(count)
        elif choice == 1:
            run.step(count)
        elif choice == 2:
            run.back(ticks=count % 20 + 1)
        else:
            run.step(ticks=count % 20 + 1)
        if (run.tick, run.flight.fired) in seen:
            assert memory(run) == seen[run.tick, run.flight.fired], (run.tick, run.flight.fired)
    assert not run.back(10**6) and run.tick == 0 and memory(run) == seen[0, 0]


def test_a_step_back_counts_firings(scenario):
    run = Stepper(scenario)
    run.until(0.1)
    places = []
    for _ in range(30):
        places.append((run.tick, run.upcoming))
        run.step()
    for place in reversed(places):
        assert run.back() and (run.tick, run.upcoming) == place


def test_few_checkpoints_are_kept_however_long_the_run():
    kept = Kept(type("First", (), {"tick": 0})())
    for tick in range(0, 3_000_000, SPACING):
        kept.add(tick, lambda tick=tick: tick)
    assert len(kept) <= MOST and kept.before(1_700_000) <= 1_700_000 < kept.before(1_700_000) + kept.spacing
    assert kept.spacing <= 4 * 3_000_000 / MOST


def test_a_branch_leaves_its_parent_alone(scenario, whole):
    run = Stepper(scenario)
    run.until(0.2)
    other = run.branch(set={"controller.lambda_a": 0.05})
    same = run.branch()
    for one in (run, other, same):
        assert one.until(0.4)
    effort = whole["cubli/wheel_command"]["effort"][399].tolist()
    assert run.read("controller.command.effort").tolist() == same.read("controller.command.effort").tolist() == effort
    assert other.read("controller.command.effort").tolist() != effort
    assert not other.back(10**7) and other.tick == 200
    with pytest.raises(FlightError, match="lambda_a"):
        run.branch(set={"controller.lambda_a": float("nan")})


def test_history_is_what_the_run_recorded(scenario, whole):
    run = Stepper(scenario)
    run.until(0.4)
    times, values = run.history("plant.wheels.velocity", 0.2)
    assert times[0] == 0.2 and times[-1] == 0.4 and len(times) == 201
    assert values[1:].tolist() == whole["cubli/wheel_state"]["velocity"][200:400].tolist()


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags")
    runs.execute(load("cubli_earth", {"duration_s": 0.5, "record": {"checkpoint_period_s": 0.1}}), out=folder / "one")
    branch = continued(f"{folder / 'one'}@0.1", {"controller.lambda_a": 0.05})
    runs.execute(branch.scenario, out=folder / "other", begin=branch.begin)
    return folder


def test_a_bag_is_stepped_through_from_itself(bags, whole):
    run = Stepper(f"{bags / 'one'}@0.45")
    assert run.tick == 450 and len(run._kept) == 1  # from the bag's checkpoint of tick 400
    assert run.read("plant.wheels.velocity").tolist() == whole["cubli/wheel_state"]["velocity"][449].tolist()
    assert run.back(ticks=300) and run.read("wheels.velocity[2]") == whole["cubli/wheel_state"]["velocity"][149, 2]


def test_the_first_difference_from_another_bag(bags, whole):
    """Where the branch begins: the controller's first answer with another gain."""
    run = Stepper(bags / "one")
    assert first_difference(run, open_recorded(bags / "one")) is None and run.tick == 500
    run.until(0)
    found = first_difference(run, open_recorded(bags / "other"))
    assert (found.component, found.tick) == ("controller", 100) and run.upcoming[0] != "controller"
    value = run.read(f"controller.{found.port}.{found.field}")
    assert value == found.here != found.there
    late = Stepper(f"{bags / 'one'}@0.497")  # no message of the slow topics is behind it
    assert first_difference(late, open_recorded(bags / "one")) is None and late.tick == 500
    with pytest.raises(FlightError, match="there is no t = 0.6 s in this bag: the run goes from 0 to 0.5 s"):
        Stepper(f"{bags / 'one'}@0.6")


def test_a_single_flipped_bit_is_found(bags, tmp_path):
    """One bit of one message: the field is named, and the tick."""
    def flip(topic, number, payload):
        return bytes([*payload[:-8], payload[-8] ^ 1, *payload[-7:]]) if (topic, number) == ("/cubli/wheel_state", 321) else payload
    bag = changed(bags / "one", tmp_path / "bag", change=flip)
    run = Stepper(bags / "one")
    found = first_difference(run, open_recorded(bag))
    assert (found.component, found.tick, found.field) == ("plant", 321, "effort[2]"), str(found)


# -- the command -------------------------------------------------------------------------------------------------------
def flight(*arguments, text=None, cwd=ROOT):
    return subprocess.run([sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())", "step",
                           *map(str, arguments)], input=text, capture_output=True, text=True, cwd=cwd, timeout=300,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})


def test_the_command_does_what_its_lines_say(bags, tmp_path, whole):
    lines = ["until 0.2", "until controller", "where", "step", "print controller.command.effort[0]", "back", "step 3", "back 2 ticks",
             "step 2 ticks", "plot controller.command.effort 0.1 effort.png", f"diff {bags / 'other'}", "list controller",
             "print controller.parameters.lambda_a", "branch controller.lambda_a=0.05", "p controller.parameters.lambda_a", "help", "q", "no"]
    done = flight(bags / "one", text="\n".join(lines) + "\n", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = done.stdout
    assert f"controller.command.effort[0] = {float(whole['cubli/wheel_command']['effort'][200, 0])!r}" in said
    assert "1 of its firings are over" in said and "controller.state.adaptive_a" in said and "effort.png" in said
    assert re.search(r"plant at tick 20[01] \(t = 0.20?1? s\): truth.* here, .* there", said)
    assert "lambda_a = [0.05, 0.05, 0.05] [rad/s]" in said
    assert (tmp_path / "effort.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("line, sentence", [
    ("until", "until what"), ("until nobody", "no component called 'nobody'"), ("until nan", "no time"),
    ("until plant.nothing > 1", "nothing"), ("step many", "write step, step N or step N ticks"), ("back 0", "write back"),
    ("print plant", "what of plant"), ("print plant.wheels.velocity[9]", "has 3 entries"), ("plot plant.wheels", "is a record"),
    ("branch lambda=1", "write component.parameter=value"), ("diff", "diff with which bag"), ("pdb", "--engine python"),
    ("jump", "no command called 'jump'"), ("until tick -4", "until")])
def test_a_wrong_line_is_answered_with_a_sentence(line, sentence, scenario):
    from flight_graph.stepping.debugger import Debugger
    debugger = Debugger(Stepper(scenario), print)
    with pytest.raises(FlightError, match=sentence):
        debugger.do(line)


def test_pdb_in_plain_python():
    """Into the kernel, a look at its arguments, out again; left before the end, the firing is taken back."""
    done = flight("cubli_earth", "--set", "duration_s=0.5", "--engine", "python",
                  text="until controller\npdb\np t_ns + 42\nq\nwhere\npdb\nc\nwhere\n")
    assert done.returncode == 0, done.stderr
    said = done.stdout
    assert said.count("appc_kernel()") == 2 and "42" in said and "is taken back" in said
    assert said.index("1 of its firings are over") < said.index("2 of its firings are over")


def test_a_run_that_stops_can_be_gone_back_from():
    """The stop is where the run has it; one step back, and the firing that stopped it comes next."""
    run = Stepper(Scenario(stopping(), "toy.yaml"))
    assert not run.until(1.0) and "controller stopped at t = 0.06 s" in run.stopped and run.upcoming is None
    assert run.read("controller.state.fault") == 1 and run.tick == 12
    assert run.back() and (run.tick, run.upcoming, run.stopped) == (12, ("controller", "kernel"), "")
    assert run.read("controller.state.fault") == 0
    assert not run.step() and "controller stopped" in run.stopped
    assert run.back(ticks=2) and run.tick == 10 and not run.until("t > 0.5") and run.tick == 12


def test_a_thousand_resets_leave_nothing_behind(scenario):
    run = Stepper(scenario)
    run.until(tick=300)
    there, held = run.flight.checkpoint().digest, []
    tracemalloc.start()
    for count in (100, 1000):
        for _ in range(count):
            run.until(tick=0)
            run.until(tick=20)
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert held[1] - held[0] < 20_000  # [bytes] less than a checkpoint in ten resets
    run.until(tick=300)
    assert run.flight.checkpoint().digest == there
