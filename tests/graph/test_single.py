"""One component fired from Python, as nodes and replays do: against the run of a graph; names of ports; slower outputs."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_graph.engines.compiled import CompiledRun
from flight_graph.engines.single import SingleComponent
from flight_graph.graphs.scenario import Scenario
from flight_math import kernel
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from tests.graph import toy

pytestmark = pytest.mark.xdist_group("executors")
ROOT = Path(__file__).resolve().parents[2]


class AwkwardParameters(Parameters):
    limit: float = field(3.0)


class AwkwardState(State):
    count: float


@kernel
def count(t_ns, p, x, inputs, outputs):
    x.count += 1.0
    outputs.parameters.value = x.count + inputs.state.angle.x
    outputs.slow.value = 1.0 / (x.count - 2.0)
    if x.count > p.limit:
        x.fault = 1


class Awkward(Component):
    """Ports that are called like what every component has."""

    parameters, state = AwkwardParameters, AwkwardState
    inputs = {"state": toy.TRUTH}
    outputs = {"parameters": named_vector("a/b", "a", {"value": Quantity(None, "1")}, Role.TELEMETRY),
               "slow": named_vector("a/c", "a", {"value": Quantity(None, "1")}, Role.TELEMETRY)}
    output_rate_hz = {"slow": 50.0}
    faults = {1: "{count} is more than {limit}"}
    kernel = count


def awkward():
    """The component, its input record and its output records."""
    inputs = {port: signal.new()[1] for port, signal in Awkward.inputs.items()}
    outputs = {port: signal.new()[1] for port, signal in Awkward.outputs.items()}
    machine = SingleComponent("it", f"{__file__}:Awkward", Awkward, Awkward.parameters.record(), Awkward.state.record(),
                              inputs, outputs, {"parameters": 10_000_000, "slow": 20_000_000}, 5_000_000_000)
    return machine, inputs["state"], outputs


def flown() -> list:
    """What four firings say and leave."""
    machine, given, made = awkward()
    said = [machine.call("start", 0)]
    for tick in range(4):
        given["angle"] = 10.0 * tick
        said.append(machine.call("kernel", tick * 10_000_000))
        stamp = made["slow"]["header"]["stamp"]
        said.append([made["parameters"]["value"].tolist(), stamp["sec"].tolist(), stamp["nanosec"].tolist()])
    return said


EXPECTED = ["", "", [[1.0], [5], [0]], "", [[12.0], [5], [10_000_000]], "", [[23.0], [5], [20_000_000]],
            "it stopped at t = 0.03 s: 4.0 is more than 3.0", [[34.0], [5], [30_000_000]]]


def test_firings_by_hand():
    """The second firing makes the slow output infinite, but publishes it not: it is looked at at 0, 20, 40 ms."""
    assert flown() == EXPECTED


def test_firings_by_hand_in_plain_python():
    done = subprocess.run([sys.executable, "-c", "from tests.graph.test_single import flown\nprint(flown())"], cwd=ROOT,
                          capture_output=True, text=True, env={**os.environ, "NUMBA_DISABLE_JIT": "1",
                                                               "PYTHONPATH": str(ROOT)}, check=True)
    assert done.stdout.strip() == str(EXPECTED)


def test_the_toy_plant_by_hand_is_the_plant_of_the_graph():
    scenario = Scenario(toy.scenario(duration_s=0.2), "toy.yaml")
    run = CompiledRun(scenario).run()
    node = scenario.graph.nodes["plant"]
    parameters = toy.Plant.parameters.record(node.values)
    parameters["period"] = node.period_ns / 1e9
    command, truth = toy.COMMAND.new()[1], toy.TRUTH.new()[1]
    plant = SingleComponent("plant", node.use, toy.Plant, parameters, toy.Plant.state.record(), {"command": command},
                            {"truth": truth}, {"truth": node.period_ns}, scenario.epoch_ns)
    assert plant.call("start", 0) == "" and plant.call("kernel", 0) == ""
    for tick, (expected, given) in enumerate(zip(run["toy/truth"], np.repeat(run["toy/command"], 2))):
        t_ns = tick * node.period_ns
        assert plant.call("output", t_ns) == "" and truth[0].tobytes() == expected.tobytes()
        command[0] = given
        assert plant.call("update", t_ns) == ""
