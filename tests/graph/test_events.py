"""Parameters that change while it runs: against an executor written from the rules, in plain Python, and what is wrong is said."""

import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_math.values import view
from tests.faults.engines import fly, plainly
from tests.graph import toy
from tests.graph.reference_executor import ReferenceExecutor
from tests.graph.test_executors import logs

pytestmark = pytest.mark.xdist_group("executors")
EVENTS = [
    {"at_s": 0.0, "set": {"sensor.sigma": 0.002}},
    {"at_s": 1.2345, "set": {"controller.kp": 0.9}},  # on no tick: before the first firing behind it
    {"at_s": 0.5, "set": {"plant.inertia": 3.0, "controller.kd": 0.1}},
    {"at_s": 0.75, "set": {"controller.law": "p"}},
]


class WithEvents(ReferenceExecutor):
    """Before an instant's firings each component takes what was set until then."""

    def _instant(self, t):
        for name, node in self.nodes.items():
            values = dict(node.values)
            for event in sorted(EVENTS, key=lambda event: event["at_s"]):
                if t >= event["at_s"] * 1e9:
                    values |= {key.split(".")[1]: value for key, value in event["set"].items() if key.startswith(f"{name}.")}
            record = node.component.parameters.record(values)
            record["period"] = round(1e9 / node.rate_hz) / 1e9
            self.parameters[name] = view(record[0], node.component.parameters.kinds)
        super()._instant(t)


def test_each_change_is_seen_from_the_first_firing_on():
    scenario = Scenario(toy.scenario(events=EVENTS), "toy")
    assert logs(CompiledRun(scenario).run()) == WithEvents(scenario).run()


def test_faults_act_on_what_events_have_set_and_plain_python_agrees():
    faults = [{"id": "weak", "at": "controller.parameters.kp", "type": "scale", "value": 0.5, "from_s": 1.0, "until_s": 1.5}]
    data = toy.scenario(events=EVENTS, faults=faults)
    halves = [*EVENTS, {"at_s": 1.0, "set": {"controller.kp": 0.25}}, {"at_s": 1.5, "set": {"controller.kp": 0.9}}]
    halves[1] = {"at_s": 1.2345, "set": {"controller.kp": 0.45}}
    found = fly(data)
    assert found == plainly(data)
    found.pop("faults")
    assert found == fly(toy.scenario(events=halves))


@pytest.mark.parametrize("entry, said", [
    ({"at_s": -1, "set": {"controller.kp": 1}}, "greater than or equal to 0"),
    ({"at_s": float("nan"), "set": {"controller.kp": 1}}, "events.0.at_s"),
    ({"at_s": 1, "set": {}}, "events.0.set"),
    ({"at_s": 1, "set": {"controller.kp": 1}, "for_s": 2}, "there is no such key; allowed here: at_s, set"),
    ({"at_s": 1, "set": {"controler.kp": 1}}, "did you mean 'controller'"),
    ({"at_s": 1, "set": {"controller.kpp": 1}}, "did you mean 'kp'"),
    ({"at_s": 1, "set": {"controller.rate_hz": 1}}, "the rates of a graph stay as they are"),
    ({"at_s": 1, "set": {"controller.kd": 11}}, "events[0].set: controller.kd: 11 is not allowed"),
    ({"at_s": 1, "set": {"controller.kp": float("inf")}}, "controller.kp"),
])
def test_what_is_wrong_is_said(entry, said):
    with pytest.raises(FlightError) as caught:
        Scenario(toy.scenario(events=[entry]), "toy")
    assert said in str(caught.value), caught.value


def test_one_parameter_is_set_once_at_a_time():
    twice = [{"at_s": 1, "set": {"controller.kp": 1.0}}, {"at_s": 1.0, "set": {"controller.kp": 2.0}}]
    with pytest.raises(FlightError, match=r"controller.kp is set at 1 s by toy: events\[0\] as well"):
        Scenario(toy.scenario(events=twice), "toy")


def test_an_event_behind_the_end_is_warned_of():
    """The toy flies 2 s: what is set at 2 s is seen by no firing."""
    late = [{"at_s": at_s, "set": {"controller.kp": 1.0}} for at_s in (1.99, 2.0)]
    data = toy.scenario(events=late, duration_s=2.0)
    assert Scenario(data, "toy").warnings() == ["events: the one at 2 s has no effect: the run ends at 2 s"]
