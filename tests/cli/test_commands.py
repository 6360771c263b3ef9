"""The command line as a user meets it: tables, help, JSON, and a sentence with status 2 for everything that is wrong."""

import io
import json
import re
from pathlib import Path

import pytest
import typer
import yaml
from rich.table import Table

from flight_graph.cli import show
from flight_graph.cli.app import app
from tests.commands import runner
from tests.graph import toy
from tests.reports.campaigns import made

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.xdist_group("executors")


@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """Run a command in a new folder; return (status, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))

    return runner(monkeypatch, capsys)


@pytest.fixture
def toy_file(tmp_path):
    path = tmp_path / "toy.yaml"
    path.write_text(yaml.safe_dump(toy.scenario()))
    return path


def test_help_of_every_command_names_an_example_and_can_be_read_at_80_columns(flight, monkeypatch):
    """No line is longer, and nothing is left out for want of room."""
    monkeypatch.setenv("COLUMNS", "80")
    for command in ([], *([name] for name in typer.main.get_command(app).commands)):
        status, out, _ = flight(*command, "--help")
        assert status == 0 and re.search(r"Examples?: flight ", out), command
        assert max(map(len, out.splitlines())) <= 80 and "\u2026" not in out, command


def test_help_keeps_units_in_brackets(flight):
    for command, unit in (("fault", "How long it lasts [s]"), ("design", "Surface gravity [m/s^2]")):
        assert unit in flight(command, "--help")[1]


def test_a_table_that_is_too_wide_for_a_pipe_loses_nothing(capsys, monkeypatch):
    monkeypatch.setattr(show.console, "width", 60)
    table = Table(*(f"column {number}" for number in range(9)))
    show.add(table, *(f"{number}-value-{number}" for number in range(9)))
    show.console.print(table)
    out = capsys.readouterr().out
    assert all(f"{number}-value-{number}" in out for number in range(9)) and "column 8" in out, out


def test_list_shows_scenarios_by_vehicle_and_components(flight):
    status, out, _ = flight("list")
    assert status == 0 and "cubli_ros/appc_controller" not in out
    places = [out.index(word) for word in ("rover\n", "flight run NAME", "cubli_asteroid_paper", "flight sweep NAME",
                                           "cubli_gains", "faults:", "cubli_faults", "space robot\n", "lander\n")]
    assert places == sorted(places)
    shown = flight("list", "--components")[1]
    for name in ("cubli_ros/appc_controller", "sim_nodes/cubli_plant"):
        assert name in shown
    found = json.loads(flight("list", "--json")[1])
    assert {"cubli_asteroid", "cubli_earth_paper"} <= found["scenarios"].keys() and "sim_nodes/imu" in found["components"]
    assert found["groups"]["lander_faults"] == ["lander", "faults"]


def test_tables_can_be_read_at_80_columns(flight, toy_file, monkeypatch, tmp_path):
    """No line is longer, and no name is broken: what does not fit beside each other stands below each other."""
    monkeypatch.setattr(show.console, "width", 80)
    monkeypatch.setattr(show.console, "soft_wrap", False)
    flight("run", str(toy_file), "--trust", "--out", "bag")
    study = str(made(tmp_path / "study").path)
    bag = str(ROOT / "bags/lander_nominal")
    for command, names in ((["list"], ["spacerobot_harmonic_rls_same_sample"]),
                           (["list", "cubli_asteroid"], ["sim_nodes/star_tracker", "plant.initial_angles"]),
                           (["list", "cubli_asteroid", "--topics"], ["geometry_msgs/msg/QuaternionStamped"]),
                           (["list", "lander_faults"], ["lose_star_tracker"]),
                           (["list", "--components"], ["spacerobot_ros/adaptive_controller"]),
                           (["info", bag], ["/lander/truth/summary", "sensor_msgs/msg/JointState"]),
                           (["diff", bag, "bag"], ["/toy/truth"]),
                           (["plot", bag, "--fields"], ["/lander/cmd_wrench.wrench.force"]),
                           (["plot", study, "--fields"], ["plant.inertia"]),
                           (["report", study], ["angle_max"]),
                           (["report", study, "--worst", "angle_max", "--sensitivity", "angle_max"], ["plant.inertia"]),
                           (["design", "cubli", "--gravity", "8e-5", "--out", "made.yaml"], ["made.yaml"]),
                           (["run", "cubli_earth", "--duration", "0.1"], ["adaptive_a_x", "normal_force_min"])):
        status, out, err = flight(*command)
        assert status in (0, 1), err
        assert max(map(len, out.splitlines())) <= 80 or command[0] == "run", max(out.splitlines(), key=len)
        assert "\u2026" not in out, command
        for name in names:
            assert name in out, (command, name)


def test_progress_says_what_is_known_and_names_are_no_markup(monkeypatch):
    """An end that nobody knows is not told, and brackets in the name of a file stand for themselves."""
    screen = io.StringIO()
    monkeypatch.setattr(show, "_errors", show._Console(file=screen, force_terminal=True, width=80))
    with show.working("reading [/bold]", True):
        pass
    with show.steps("verify [/red]", True) as advance:
        advance(3.25, None, "s [/dim]")
        advance(7.0, 60.0, "s simulated")
    told = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    for part in ("reading [/bold]", "verify [/red]", "7 of 60"):
        assert part in told, told
    assert "None" not in told
    table = show.fields_table([])
    table.title, table.columns[0].header = "[/bold]x", "delay [s]"
    with show.console.capture() as shown:
        show.console.print(table)
    assert "[/bold]x" in shown.get() and "delay [s]" in shown.get()


def test_list_of_a_scenario_shows_units_in_brackets(flight):
    """Brackets are no markup: [rad] and [N m] stand in the table."""
    status, out, _ = flight("list", "cubli_asteroid")
    assert status == 0
    for part in ("[rad]", "[kg m^2]", "[N m]", "[-0.3, 0.3, 0.3]", "truth <- plant.truth", "/cubli/star_tracker",
                 "one of explicit, implicit", "Table 2"):
        assert part in out, part


def test_run_prints_metrics_and_the_bag(flight, toy_file, tmp_path):
    status, out, err = flight("run", toy_file, "--trust", "--out", tmp_path / "a b" / "bag")
    assert status == 0 and out.splitlines()[-1] == str(tmp_path / "a b" / "bag")
    assert (tmp_path / "a b" / "bag" / "metadata.yaml").is_file()
    status, out, err = flight("run", toy_file, "--trust", "--json", "--seed", 3, "--duration", 0.5, "--set", "controller.kp=0.25")
    made = json.loads(out)
    assert {"bag", "engine", "wall_s", "metrics", "seed"} <= made.keys() and made["seed"] == 3
    assert made["bag"] == "runs/toy-compiled-1"
    assert json.loads(flight("run", toy_file, "--trust", "--json")[1])["bag"] == "runs/toy-compiled-2"


METRICS = {"xi_a_max", "xi_u_max", "settling_time_s", "overshoot_percent", "tail_rad", "rate_axis_max", "rate_norm_max",
           "torque_peak", "effort", "normal_force_min", "friction_ratio_max", "wheel_speed_max", "limit_eq9"}


def test_json_of_the_cubli_names_all_metrics(flight):
    status, out, _ = flight("run", "cubli_asteroid", "--duration", 1, "--json")
    made = json.loads(out)
    assert status == 0 and METRICS <= made["metrics"].keys()
    assert made["metrics"]["settling_time_s"] is None  # one second is too short: never


@pytest.mark.parametrize("arguments, parts", [
    (["run", "cubli_astroid"], ["no scenario called 'cubli_astroid'", "'cubli_asteroid'"]),
    (["run", "nowhere.yaml"], ["there is no scenario file 'nowhere.yaml'"]),
    (["run", "TOY", "--set", "plan.angle=1"], ["no component called 'plan'; did you mean 'plant'?"]),
    (["run", "TOY", "--set", "plant.angel=1"], ["no parameter called 'angel'; did you mean 'angle'?"]),
    (["run", "TOY", "--set", "controller.kp"], ["--set controller.kp: write COMPONENT.PARAM=VALUE"]),
    (["run", "TOY", "--set", "controller.kp=abc"], ["controller.parameters.kp: 'abc' is not allowed", "[N m/rad]"]),
    (["run", "TOY", "--set", "controller.kp=.nan"], ["kp: nan is not allowed", "finite"]),
    (["run", "TOY", "--set", "controller.kd=11"], ["kd: 11 is not allowed", "<= 10"]),
    (["run", "TOY", "--set", "plant.angle=[1,2]"], ["angle: [1, 2] is not allowed", "3 numbers [rad]"]),
    (["run", "TOY", "--set", "plant.inertia=2 kg"], ["inertia: '2 kg' is not allowed", "[kg m^2]"]),
    (["run", "TOY", "--set", "controller.law=pid"], ["law: 'pid' is not allowed; allowed: one of pd, p"]),
    (["run", "TOY", "--set", "plant.rate_hz=30"], ["plant.rate_hz: 30", "25 or 32"]),
    (["run", "TOY", "--set", "connect=1"], ["write component.parameter=value"]),
    (["run", "TOY", "--set", "controller.kp=[1"], ["'[1' is no value"]),
    (["run", "TOY", "--duration", "0"], ["duration_s: 0.0 is not allowed", "greater than 0"]),
    (["run", "TOY", "--duration", "nan"], ["duration_s: nan is not a time", "finite"]),
    (["run", "TOY", "--engine", "rose"], ["no engine called 'rose'; did you mean 'ros'?"]),
    (["run", "TOY", "--engine", "ros", "--pace", "fast"], ["--pace fast: allowed: lockstep, realtime or realtime:FACTOR"]),
    (["run", "TOY", "--engine", "ros", "--pace", "realtime:0"], ["the factor must be a number greater than 0"]),
    (["run", "TOY", "--engine", "ros", "--pace", "realtime:x"], ["the factor must be a number greater than 0"]),
    (["run", "TOY", "--engine", "ros", "--pace", "lockstep:2"], ["--pace lockstep:2: allowed"]),
    (["run", "TOY", "--out", "."], ["--out .: it exists already; name a new folder"]),
    (["run", "cubli_earth_paper", "--engine", "ros"], ["runs in the compiled engine only", "100 kHz"]),
    (["list", "cubli_astroid"], ["did you mean 'cubli_asteroid'"]),
    (["node", "cubli_rose", "appc_controller"], ["no package called 'cubli_rose'; did you mean 'cubli_ros'"]),
    (["node", "cubli_ros", "apc_controller"], ["no executable called 'apc_controller'; did you mean 'appc_controller'"]),
])
def test_a_mistake_reads_as_a_sentence(flight, toy_file, tmp_path, arguments, parts):
    trusted = ["--trust"] if "TOY" in arguments else []  # the toy's components lie in another folder than its scenario
    status, out, err = flight(*[str(toy_file) if part == "TOY" else part for part in arguments], *trusted)
    assert status == 2 and out == "", (status, out, err)
    assert err.startswith("error: ") and err.count("\n") == 1, err
    for part in parts:
        assert part in err, err
    assert not list(tmp_path.glob("runs/*/*.mcap"))


@pytest.mark.parametrize("text", ["soon", "0", "-1", "nan"])
def test_a_timeout_that_is_none(flight, toy_file, monkeypatch, text):
    pytest.importorskip("rclpy")
    monkeypatch.setenv("FLIGHT_TIMEOUT_S", text)
    status, _, err = flight("run", str(toy_file), "--trust", "--engine", "ros")
    assert status == 2 and f"FLIGHT_TIMEOUT_S={text}: allowed: a number of seconds greater than 0" in err, err


def test_a_scenario_that_only_ros_can_run(flight, tmp_path):
    (tmp_path / "live.yaml").write_text(yaml.safe_dump(toy.scenario(only={"engine": "ros", "because": "it is live"})))
    status, _, err = flight("run", str(tmp_path / "live.yaml"), "--trust")
    assert status == 2 and "toy runs in the ros engine only: it is live" in err, err


def test_the_initial_error_outside_the_funnel(flight):
    status, _, err = flight("run", "cubli_asteroid", "--duration", 1, "--set", "plant.initial_angles=[-0.5,0.3,0.3]")
    assert status == 2 and err.startswith("error: controller stopped at t = 0 s: the initial attitude error")
    assert "rho_a0 = [0.4, 0.4, 0.4] rad" in err and "rearm" in err


def test_doctor_says_what_is_here(flight):
    status, out, _ = flight("doctor", "--json")
    report = json.loads(out)
    assert status == 0 and report["numba"] and report["python"]
    assert report["ros"] is None or report["two processes can talk"]
    assert "cubli_asteroid" in report["compiled"] + report["not compiled yet"] and not report["broken"]


def test_doctor_tells_a_person_in_words():
    from flight_graph.cli.doctor import _words
    assert [_words(value) for value in (["a", "b"], {}, {"a": "why"}, None, True, "1.2")] == [
        "a, b", "none", "a: why", "not installed", "yes", "1.2"]
