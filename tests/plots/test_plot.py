"""Pictures of any bag and campaign: what is drawn, what is said of a name that there is not, and what runs warn of."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from flight_graph.graphs.alarms import alarms
from flight_graph.graphs.glossary import Glossary
from flight_graph.graphs.metric_entry import Alarm, flag, number, word
from flight_graph.graphs.scenario import load
from flight_graph.plots.bag_lines import BagLines
from flight_graph.plots.names import run_names
from flight_graph.plots.thinning import chosen
from flight_graph.recordings.what_ran import what_ran
from flight_graph.reports.fewer_faces import fewer
from tests.bag.sample_bags import write_bag
from tests.commands import runner
from tests.reports.campaigns import made

ROOT = Path(__file__).parents[2]


@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """Run a command in a new folder; return (status, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)
    return runner(monkeypatch, capsys)


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are written, with what is in them."""
    found = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **_: found.append(figure) or path.write_bytes(b"picture"))
    return found


def test_fields_of_several_bags_over_each_other(flight, drawn, tmp_path):
    a, b = write_bag(tmp_path / "a", 1), write_bag(tmp_path / "b", 2)
    status, out, err = flight("plot", "a", "b", "cubli/imu.angular_velocity", "/cubli/wheels.velocity[wheel_y]", "--out", "p.svg")
    assert (status, out.strip()) == (0, "p.svg"), err
    rates, wheels = (panel for panel in drawn[0].axes)
    lines = {line.get_label(): line for line in rates.lines}
    assert list(lines) == ["a x", "a y", "a z", "b x", "b y", "b z"] and rates.get_ylabel() == "[rad/s]"
    assert (lines["b z"].get_ydata() == b.imu["angular_velocity"][:, 2]).all()
    assert np.allclose(lines["a x"].get_xdata(), a.stamps / 1e9)
    assert [line.get_label() for line in wheels.lines] == ["a", "b"]
    assert (wheels.lines[1].get_ydata() == b.wheels["velocity"][:, 1]).all()
    over = ["plot", "a", "/cubli/imu.angular_velocity.x", "--over", "/cubli/wheels.position[wheel_x]", "--from", "1", "--until", "2"]
    assert flight(*over)[0] == 0
    line = drawn[1].axes[0].lines[0]
    inside = slice(200, 401)  # every 5 ms from 1 s to 2 s; the wheels speak at every second
    assert (line.get_ydata() == a.imu["angular_velocity"][inside, 0]).all()
    assert (line.get_xdata()[::2] == a.wheels["position"][100:201, 0]).all()
    assert flight("plot", "a")[0] == 0 and len(drawn[2].axes) >= 4  # nothing asked for, and no scenario


@pytest.mark.parametrize("arguments, parts", [
    (["a", "/cubli/imu.angular_velocty"], ["no field '/cubli/imu.angular_velocty'", "did you mean /cubli/imu.angular_velocity",
                                           "--fields"]),
    (["a", "nowhere"], ["no field 'nowhere'", "no bag of this name"]),
    (["nowhere", "/cubli/imu.x"], ["there is no bag at 'nowhere'"]),
    (["a", "/cubli/imu.x", "a"], ["name bags first, then fields"]),
    (["a", "--out", "p.gif"], ["'p.gif' names no kind of picture; allowed: .png, .svg, .pdf"]),
    (["a", "/cubli/imu.orientation", "--over", "/cubli/imu.orientation"], ["it has 4 numbers; name one", "orientation.x"]),
    (["a", "--from", "nan"], ["--from nan: this is no time"]),
    (["a", "/cubli/imu.orientation", "--from", "9", "--until", "3"], ["--from 9 --until 3: there is no message then", "t = 0 s"]),
    (["campaign", "a"], ["is the folder of a campaign, the others are bags"]),
    (["campaign", "angel_max"], ["no metric called 'angel_max'; did you mean 'angle_max'"]),
    (["campaign", "angle_max", "--over", "plant.inertai"], ["no column called 'plant.inertai'; did you mean 'plant.inertia'"]),
    (["campaign", "angle_max", "--over", "plant.angle"], ["it has 3 numbers; name one, as plant.angle[0]"]),
])
def test_a_wrong_name_reads_as_a_sentence(flight, campaign, tmp_path, arguments, parts):
    write_bag(tmp_path / "a", count=20)
    status, out, err = flight("plot", *(campaign.path if word == "campaign" else word for word in arguments))
    assert status == 2 and out == "" and err.startswith("error: ") and err.count("\n") == 1, err
    for part in parts:
        assert part in err, err


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return made(tmp_path_factory.mktemp("campaigns") / "toy")


def test_metrics_of_campaigns(flight, drawn, campaign, tmp_path):
    table = campaign.read()
    angles, inertia = table.column("angle_max").to_numpy(), table.column("plant.inertia").to_numpy()
    assert flight("plot", campaign.path, "angle_max", "--out", "p.png")[0] == 0
    assert flight("plot", campaign.path, "angle_max", "--over", "plant.inertia", "--out", "p.png")[0] == 0
    histogram, scatter = (figure.axes[0] for figure in drawn)
    (outline,) = histogram.patches
    assert outline.get_xy()[:, 1].max() <= 40 and f"({len(angles)})" in histogram.get_legend().get_texts()[0].get_text()
    points = scatter.lines[0]
    assert sorted(zip(points.get_xdata(), points.get_ydata())) == sorted(zip(inertia, angles))
    assert scatter.get_xlabel() == "plant.inertia [kg m^2]" and "40 runs" in drawn[1].get_suptitle()


def test_thinned_lines_keep_every_extreme():
    random = np.random.default_rng(3)
    for count in (1, 999, 1001, 1_000_003):
        lines = [random.normal(size=count), np.cumsum(random.normal(size=count))]
        lines[0][count // 2] = np.nan
        kept = chosen(lines, 1000)
        if count <= 1000:
            assert kept is None
            continue
        assert len(kept) < 1100 and kept[0] == 0 and kept[-1] == count - 1 and (np.diff(kept) > 0).all()
        for values in lines:
            assert np.nanmax(values) == np.nanmax(values[kept]) and np.nanmin(values) == np.nanmin(values[kept])


def test_meshes_with_fewer_faces_keep_their_shape():
    """A sphere's vertices stay on it, within a cell of the grid."""
    polar, around = np.meshgrid(np.linspace(0.05, np.pi - 0.05, 120), np.linspace(0, 2 * np.pi, 120, endpoint=False))
    ball = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1).reshape(-1, 3)
    own = np.arange(120 * 120).reshape(120, 120)
    low, high, right, far = own[:-1, :-1].ravel(), own[:-1, 1:].ravel(), own[1:, :-1].ravel(), own[1:, 1:].ravel()
    faces = np.concatenate([np.stack([low, high, right], 1), np.stack([high, far, right], 1)])
    vertices, fewer_faces = fewer(ball, faces, 6000)
    assert 1000 < len(fewer_faces) <= 6000 < len(faces)
    assert abs(np.linalg.norm(vertices[np.unique(fewer_faces)], axis=1) - 1.0).max() < 0.05


def test_names_of_runs_tell_them_apart(tmp_path):
    assert run_names([tmp_path / "x/run", tmp_path / "y/run", tmp_path / "b.mcap"]) == ["x/run", "y/run", "b"]


@pytest.mark.parametrize("name, given, case, words", [
    ("cubli_asteroid", {"controller.lambda_a": 0.03, "seed": 7}, None, "seed 7, controller.lambda_a = 0.03"),
    ("cubli_gains", {}, 2, "case 2 (case 3), seed 0"),
    ("cubli_seeds", {}, 5, "case 5, seed 6"),
    ("cubli_bennu", {"plant.latitude": 1.5708}, None, "seed 0, plant.latitude = 1.5708"),
    ("cubli_asteroid", {"controller.use": f"{ROOT}/examples/sliding_controller.py:SlidingController"}, None,
     "seed 1, controller.use = sliding_controller.py:SlidingController"),
])
def test_what_was_set_is_found_again(name, given, case, words):
    scenario = load(name, given, case)
    assert what_ran(scenario).words(scenario.seed) == words


def test_runs_warn_of_what_is_declared_and_of_filters_that_refuse():
    known = Glossary({entry.name: entry for entry in (
        number("outside", "1", "", alarm=Alarm("left {value} times", above=0.0)), flag("landed", "", alarm=Alarm("not landed",
                                                                                                                 is_=False)),
        word("outcome", "", alarm=Alarm("it {value}")), number("none", "1", "", alarm=Alarm("never", above=0.0)))})
    scenario = load("cubli_asteroid")
    estimator = next(signal for node, _, signal in scenario.graph.outputs() if signal.topic == "cubli/attitude_filter")
    record = estimator.zeros(2)
    record["accepted"], record["rejected"] = 1, (0, 3)
    found = alarms(known, {"outside": 2.0, "landed": False, "outcome": "fell", "none": None}, scenario,
                   {"cubli/attitude_filter": record})
    assert found[:3] == ["left 2 times", "not landed", "it fell"] and "estimator rejected 3 of 4 measurements" in found[3]
    assert alarms(known, {"outside": 0.0, "landed": True}, scenario, {"cubli/attitude_filter": record[:1]}) == []


def test_lines_of_a_bag_go_by_the_names_of_its_export(tmp_path):
    lines = BagLines(write_bag(tmp_path / "a").folder)
    series = lines.find("/cubli/wheels.effort")
    assert [line.column for line in series.lines] == ["effort[wheel_x]", "effort[wheel_y]", "effort[wheel_z]"]
    assert series.labels == ["wheel_x", "wheel_y", "wheel_z"] and series.t[0] == 0.0
    assert lines.find("cubli/wheels.effort[2]").name == lines.find("cubli/wheels.effort[wheel_z]").name == "effort[wheel_z]"
    assert not any("stamp" in one.name for topic in lines.topics for one in lines.series(topic))


def test_an_estimate_less_the_truth(flight, drawn, tmp_path):
    """A difference at the messages of the first; of a slower second its newest message counts."""
    a = write_bag(tmp_path / "a", 1)
    status, _, err = flight("plot", "a", "/cubli/imu.angular_velocity - /cubli/imu.linear_acceleration", "--out", "p.png")
    assert status == 2 and "the first is in rad/s, the second in m/s^2" in err
    status, _, err = flight("plot", "a", "/cubli/imu.angular_velocity.x - /cubli/wheels.velocity[wheel_x]", "--out", "p.png")
    assert status == 0, err
    (line,) = drawn[0].axes[0].lines
    assert drawn[0].axes[0].get_ylabel() == "[rad/s]"
    newest = np.repeat(a.wheels["velocity"][:, 0], 2)  # the wheels speak at every second message of the inertial unit
    assert (line.get_ydata() == a.imu["angular_velocity"][:, 0] - newest).all()
    status, _, err = flight("plot", "a", "/cubli/imu.angular_velocity - /cubli/wheels.velocity[wheel_x]")
    assert status == 2 and "the first has 3 numbers, the second 1" in err
