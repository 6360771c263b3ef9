"""A run that a component stops keeps its bag up to there; what `resolve` may return; compiling ahead."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.components import declared
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, field
from flight_graph.errors import FlightError, RunStopped
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recorded_run import open_recorded
from tests.graph import toy

pytestmark = pytest.mark.xdist_group("executors")
ROOT = Path(__file__).resolve().parents[2]


def stopping(duration_s=1.0) -> dict:
    """The toy with a controller that is too stiff for its rate: the angle swings beyond where it began, and that is a fault."""
    data = toy.scenario(duration_s=duration_s)
    data["components"]["controller"]["parameters"] = {"angle_limit": 0.3, "kp": 4000.0, "kd": 0.0}
    return data


def test_the_bag_is_kept_up_to_the_fault(tmp_path):
    scenario = Scenario(stopping(), "toy.yaml")
    with pytest.raises(RunStopped, match="controller stopped at t = .* the angle left the limit of 0.3 rad") as stop:
        runs.execute(scenario, out=tmp_path / "bag")
    t_ns = stop.value.t_ns
    assert 0 < t_ns < scenario.duration_ns
    bag, run = read_bag(tmp_path / "bag"), open_recorded(tmp_path / "bag", trust=True)
    assert bag.metadata["flight_graph.outcome"] == {"complete": "false", "lost": "0", "stopped": str(stop.value)}
    assert bag.stamps_ns("/toy/imu")[-1] - scenario.epoch_ns == t_ns  # the sensor fires before the controller
    assert bag.stamps_ns("/toy/command")[-1] - scenario.epoch_ns == t_ns - 10_000_000
    assert not run.complete
    result = runs.verify(tmp_path / "bag", trust=True)
    assert result.verdict == "equal" and "controller stopped" in result.sentences[-1]
    replayed = runs.replay(tmp_path / "bag", "controller", trust=True)
    assert replayed.comparison.verdict == "equal"


def test_plain_python_leaves_the_same_bag(tmp_path):
    """All messages before the fault, and the sentence."""
    with pytest.raises(RunStopped) as stop:
        runs.execute(Scenario(stopping(), "toy.yaml"), out=tmp_path / "compiled")
    code = ("import sys\nfrom pathlib import Path\nfrom flight_graph import runs\nfrom flight_graph.graphs.scenario import "
            "Scenario\nfrom tests.graph.test_stopped_runs import stopping\n"
            "try:\n    runs.execute(Scenario(stopping(), 'toy.yaml'), 'python', out=Path(sys.argv[1]))\n"
            "except ValueError as error:\n    print(error)\n")
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "python")], cwd=ROOT, capture_output=True, text=True,
                          env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}, check=True)
    assert done.stdout.strip() == str(stop.value)
    one, other = read_bag(tmp_path / "compiled"), read_bag(tmp_path / "python")
    for topic in one.topics:
        assert list(one.messages([topic])) == list(other.messages([topic])), topic


def flight(*arguments, **environment):
    return subprocess.run([sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())",
                           *arguments], capture_output=True, text=True, cwd=environment.pop("cwd", ROOT),
                          env={**os.environ, "PYTHONPATH": str(ROOT), **environment})


def test_the_command_line_names_the_bag(tmp_path):
    path = tmp_path / "toy.yaml"
    path.write_text(yaml.safe_dump(stopping()))
    done = flight("run", str(path), "--trust", "--out", str(tmp_path / "bag"))
    assert done.returncode == 2
    assert "the angle left the limit of 0.3 rad; the bag up to here is" in done.stderr
    assert (tmp_path / "bag/metadata.yaml").is_file()


def test_compiling_ahead(tmp_path):
    path, cache = tmp_path / "toy.yaml", str(tmp_path / "cache")
    data = toy.scenario()
    data["components"] = {name: data["components"][name] for name in ("plant", "sensor", "controller")}
    path.write_text(yaml.safe_dump({**data, "connect": {}}))
    first = json.loads(flight("compile", str(path), "--trust", "--json", FLIGHT_CACHE_DIR=cache).stdout)
    assert first["compiled"] == len(first["components"]) == 3
    again = json.loads(flight("compile", str(path), "--trust", "--json", FLIGHT_CACHE_DIR=cache).stdout)
    assert again["compiled"] == 0 and again["components"] == first["components"]
    assert "name scenarios, or write --all" in flight("compile").stderr
    assert "add --trust to run it" in flight("compile", str(path), FLIGHT_CACHE_DIR=cache).stderr


# -- resolve -------------------------------------------------------------------------------------------------------------
class ResolvedParameters(Parameters):
    vector: Array(3) = field(1.0)
    matrix: Array(2, 2) = field(0.0)
    number: float = field(0.0, le=10.0)
    count: int = field(0)
    wanted: bool = field(False)


class Resolved(Component):
    """Gives NumPy's values for all."""

    parameters = ResolvedParameters
    outputs = {"truth": toy.TRUTH}
    kernel = toy.plant_output

    @classmethod
    def resolve(cls, values, where, folder=None):
        """Arrays and NumPy scalars, of kinds that JSON does not know."""
        return {**values, "vector": np.arange(3), "matrix": (np.array([1, 2]), [np.int64(3), np.float32(0.5)]),
                "number": np.float32(2.5), "count": np.int64(7), "wanted": np.bool_(True)}


def test_what_resolve_returns_is_made_plain():
    found = declared.resolved(Resolved, Resolved.parameters.defaults(), "part", None)
    assert json.loads(json.dumps(found)) == {"vector": [0.0, 1.0, 2.0], "matrix": [[1.0, 2.0], [3.0, 0.5]], "number": 2.5,
                                             "count": 7, "wanted": True}
    assert declared.resolved(Resolved, found, "part", None) == found


def test_what_resolve_returns_is_checked():
    class Wrong(Resolved):
        @classmethod
        def resolve(cls, values, where, folder=None):
            return {**values, "number": 11.0}

    with pytest.raises(FlightError, match="part.number: 11.0 is not allowed"):
        declared.resolved(Wrong, Wrong.parameters.defaults(), "part", None)


def test_a_kernel_without_end_can_be_interrupted(tmp_path):
    """Ctrl-C is heard while machine code runs, and the run ends with a sentence."""
    (tmp_path / "law.py").write_text("""
from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_math import kernel
from msg_schemas import cubli


class LawParameters(Parameters):
    go: bool = field(True)


class LawState(State):
    count: int


@kernel
def law(t_ns, p, x, attitude, command):
    while p.go:
        x.count += 1


class Law(Component):
    parameters, state, kernel = LawParameters, LawState, law
    inputs, outputs = {"attitude": cubli.ATTITUDE}, {"command": cubli.COMMAND}
""")
    data = {"name": "endless", "title": "t", "duration_s": 1, "components": {
        "plant": {"use": "sim_nodes/cubli_plant"}, "law": {"use": f"{tmp_path / 'law.py'}:Law"}},
            "connect": {"law.attitude": "plant.attitude"}}
    code = f"""
import os, signal, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # a test run in the background ignores it
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
run = CompiledRun(Scenario({data!r}, "endless.yaml"))
run.compile()
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    run.run()
except ValueError as error:
    print(error, flush=True)
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert "interrupted, and a kernel does not come to its end" in done.stdout, done.stderr
