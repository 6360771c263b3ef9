"""Bodies that are put elsewhere by events: what is told is so then, the rest stays, every engine agrees, wrong ones are refused."""

import math
import warnings

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.stepping.stepper import Stepper
from tests.commands import runner
from tests.faults.engines import fly, plainly
from tests.graph import toy

pytestmark = pytest.mark.xdist_group("executors")
MOVABLE = {**toy.scenario()["components"], "plant": {"use": f"{toy.__file__}:Drifter", "rate_hz": 200}}
TURN, SPIN = [0.3, -0.4, 0.0, math.sqrt(0.75)], [0.02, 0.03, -0.01]
PLACES = {"orientation": TURN, "angular_velocity": SPIN, "position": [120.0, -40.0, 300.0], "velocity": [0.1, 0.2, -0.3]}


def movable(events, **more) -> dict:
    return toy.scenario(components=MOVABLE, events=events, **more)


def motion(run: Stepper):
    """What the plant says of its motion in its next firing, and that firing's outputs."""
    run.step()
    component = run.scenario.graph.nodes["plant"].component
    outputs = {port: run.read(f"plant.{port}") for port in component.outputs}
    records = {port: run.flight.arrays[f"O_plant.{port}"].view(np.recarray)[0] for port in component.outputs}
    return component.motion(records), outputs


@pytest.mark.parametrize("name, rest", [("cubli_asteroid", ("truth", "wheel_speed")), ("cubli_bennu", ("truth", "wheel_speed")),
                                        ("spacerobot_harmonic", ("truth", "joint_rates")), ("lander_nominal", ("truth", "mass"))])
def test_what_is_told_is_so_and_all_else_stays(name, rest):
    run = Stepper(load(name))
    run.until(1.0)
    put, before = run.branch(place={"plant": PLACES}), run.branch()
    found, outputs = motion(put)
    assert found.orientation == pytest.approx(TURN, abs=1e-12)
    assert found.angular_velocity == pytest.approx(SPIN, abs=1e-12)
    turned = Rotation.from_quat(TURN)
    position, velocity = np.array(PLACES["position"]), np.array(PLACES["velocity"])
    if name.startswith("cubli"):  # on its corner: place and velocity of the centre follow
        position = turned.apply(np.full(3, 0.5 * run.scenario.graph.nodes["plant"].values["length"]))
        velocity = np.cross(SPIN, position)
    assert found.position == pytest.approx(position, abs=1e-12) and found.velocity == pytest.approx(velocity, abs=1e-12)
    port, field = rest
    assert np.array_equal(outputs[port][field], motion(before)[1][port][field])
    assert put.step(ticks=20)


@pytest.mark.parametrize("name", ["cubli_asteroid", "cubli_bennu", "spacerobot_harmonic"])
def test_velocities_and_accelerations_are_the_slopes_of_the_pose(name):
    """In the frame of the pose; accelerations are those at the end of the interval before."""
    run = Stepper(load(name))
    run.until(0.6)
    found = []
    for _ in range(3):
        found.append(motion(run)[0])
        run.step(ticks=1)
    base_s = run.scenario.graph.base_ns / 1e9
    before, here, after = found

    def slope(quantity, begin, end):
        return (np.array(getattr(end, quantity)) - np.array(getattr(begin, quantity))) / base_s

    turned = Rotation.from_quat(after.orientation) * Rotation.from_quat(before.orientation).inv()
    assert here.velocity == pytest.approx(0.5 * slope("position", before, after), abs=3e-4)
    assert here.angular_velocity == pytest.approx(turned.as_rotvec() / (2.0 * base_s), abs=3e-4)
    assert here.acceleration == pytest.approx(slope("velocity", before, here), abs=2e-3)
    assert here.angular_acceleration == pytest.approx(slope("angular_velocity", before, here), abs=2e-2)


def test_engines_agree_behind_what_is_set_and_under_faults():
    """At no tick, twice at one time, with a parameter that the placement reads and a fault on it."""
    events = [{"at_s": 0.4999, "place": {"plant": {"position": [0.3, 0.2, 0.1]}}, "set": {"plant.stiffness": 2.0}},
              {"at_s": 1.0, "place": {"plant": {"position": [1.0, 0.0, 0.0], "velocity": [0.0, 0.0, 1.0]}}},
              {"at_s": 1.0, "place": {"plant": {"velocity": [0.0, 0.5, 0.0]}}}]
    faults = [{"id": "soft", "at": "plant.parameters.stiffness", "type": "scale", "value": 0.5, "from_s": 0.9}]
    data = movable(events, faults=faults)
    assert fly(data) == plainly(data)
    truth = CompiledRun(Scenario(data, "toy")).run()["toy/truth"]
    assert truth["angle"][100].tolist() == [0.6, 0.4, 0.2]  # behind the parameter of the same time
    assert truth["angle"][200].tolist() == [1.0, 0.0, 0.0] and truth["rate"][200].tolist() == [0.0, 0.5, 0.0]


def test_a_checkpoint_at_the_tick_of_a_placement_is_before_it():
    scenario = Scenario(movable([{"at_s": 0.5, "place": {"plant": {"velocity": [1.0, 2.0, 3.0]}}}]), "toy")
    run, again = CompiledRun(scenario, plan={}).start(0), CompiledRun(scenario, plan={})
    run.advance(100)
    flight = again.start(0, begin=run.checkpoint())
    run.advance(150)
    flight.advance(150)
    assert not flight.checkpoint().difference(run.checkpoint())


def test_a_body_that_refuses_stops_the_run_with_its_sentence():
    data = movable([{"at_s": 0.5, "place": {"plant": {"position": [4.0, 0.0, 0.0]}}}])
    assert fly(data) == plainly(data) and fly(data)["stopped"] == "plant stopped at t = 0.5 s: it was put beyond 3 rad"


def test_the_rover_is_not_put_into_the_ground_nor_anywhere_once_its_run_is_decided():
    run = Stepper(load("cubli_bennu"))
    put = run.branch(place={"plant": {"orientation": [1.0, 0.0, 0.0, 0.0]}})
    assert not put.step() and "a corner in the ground" in put.stopped


def test_the_lander_does_not_land_by_being_put_into_the_ground():
    run = Stepper(load("lander_nominal"))
    for depth in (0.0, 10.0):
        put = run.branch(place={"plant": {"position": [0.0, 0.0, -depth]}})
        assert not put.step() and "where its contact trigger fires" in put.stopped


def test_metrics_of_a_body_out_of_all_reach_are_no_warnings():
    """A square that overflows is no number of the run; where in NumPy it did is of no use to anybody."""
    data = load("spacerobot_step").resolved() | {"duration_s": 0.2, "vary": None, "events": [
        {"at_s": 0.1, "place": {"plant": {"position": [1e300, 0.0, 0.0]}}}]}
    run = Scenario(data, "far")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert metrics.compute(run, CompiledRun(run).run())["base_drift_max_m"] is None


def test_a_list_shows_what_is_put_where(tmp_path, monkeypatch, capsys):
    data = movable([{"at_s": 0.25, "place": {"plant": {"velocity": [0.0, 0.5, 0.0]}}}])
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(data))
    status, out, _ = runner(monkeypatch, capsys)("list", tmp_path / "toy.yaml", "--trust")
    assert status == 0 and "plant, put: velocity" in out and "[0.0, 0.5, 0.0]" in out


@pytest.mark.parametrize("place, said", [
    ({}, "events.0.place"),
    ({"plant": {}}, "some of position, orientation, velocity, angular_velocity"),
    ({"plannt": {"position": [0, 0, 0]}}, "did you mean 'plant'"),
    ({"sensor": {"position": [0, 0, 0]}}, "sensor cannot be put elsewhere"),
    ({"plant": {"positon": [0, 0, 0]}}, "did you mean 'position'"),
    ({"plant": {"position": [0, 0]}}, "plant.position: [0, 0] is not allowed; allowed: 3 finite numbers"),
    ({"plant": {"position": [0, 0, float("nan")]}}, "3 finite numbers"),
    ({"plant": {"velocity": "123"}}, "3 finite numbers"),
    ({"plant": {"velocity": None}}, "3 finite numbers"),
    ({"plant": {"velocity": [True, 0, 0]}}, "3 finite numbers"),
    ({"plant": {"velocity": [10**400, 0, 0]}}, "3 finite numbers"),
    ({"plant": {"orientation": [0, 0, 0, 0.9]}}, "has norm 0.9; allowed: a unit quaternion"),
    ({"plant": 3}, "events.0.place"),
])
def test_what_is_wrong_is_said(place, said):
    with pytest.raises(FlightError) as caught:
        Scenario(movable([{"at_s": 1.0, "place": place}]), "toy")
    assert said in str(caught.value), caught.value
    with pytest.raises(FlightError, match="an event has set, or place, or both"):
        Scenario(movable([{"at_s": 1.0}]), "toy")
