"""The page of bags: its numbers are those that other libraries read, it moves in a real browser, and strangers' text is text."""

import hashlib
import json
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from flight_graph.bags.writer import BagWriter
from flight_graph.components.foreign import refuse
from flight_graph.plots.bag_lines import BagLines
from flight_graph.plots.marks import marks
from flight_graph.reports import bag_figures, bag_page, page
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from tests.bag.sample_bags import stamp, write_bag
from tests.commands import runner
from tests.reports.browser import Browser
from tests.reports.test_figures import EVIL
from tests.security.attacks import bag as bag_with_scenario

LANDER = Path(__file__).parents[2] / "bags/lander_nominal"
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def lander():
    return bag_page.read_run(LANDER, "lander", refuse)


@pytest.fixture(scope="module")
def sections(lander):
    """Title of a section -> its parts."""
    return {section.title: section.parts for section in bag_page.page([lander])[2]}


@pytest.fixture
def flight(monkeypatch, capsys):
    """Run a command; return (status, standard output, standard error)."""
    return runner(monkeypatch, capsys)


def messages(path):
    """topic -> [(log time, message)], by rosbags."""
    found = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, time, data in reader.messages():
            found.setdefault(connection.topic, []).append((time, reader.deserialize(data, connection.msgtype)))
    return found


def parts_of(parts, kind):
    """All parts of a kind, those in folds too."""
    for part in parts:
        if isinstance(part, kind):
            yield part
        yield from parts_of(getattr(part, "parts", ()), kind)


def test_the_page_has_the_numbers_that_other_libraries_read(lander, sections):
    assert {"What ran", "In space", "Metrics", "Requirements", "Claims", "All topics"} <= set(sections)
    with open(next(LANDER.glob("*.mcap")), "rb") as file:
        found = hashlib.sha256()
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            found.update(channel.topic.encode() + message.log_time.to_bytes(8, "little") + message.data)
    assert bag_figures.digest(lander.bag) == found.hexdigest()
    facts = {row[0]: row[1] for row in sections["What ran"][0].rows}
    assert found.hexdigest() in facts["digest of its messages"] and facts["how it ended"] == "complete"
    shown = next(one for one in parts_of(sections["All topics"], page.Figure) if "wrench.force.x [N]" in one.columns)
    force = [(time / 1e9, message.wrench.force.x) for time, message in messages(LANDER)["/lander/cmd_wrench"]]
    t, values = np.array(force).T
    assert np.allclose(shown.columns["wrench.force.x [N]"], values, rtol=1e-6)
    assert np.allclose(shown.columns["t [s]"], t - t[0], atol=1e-6)
    away = np.array(messages(LANDER)["/lander/truth/summary"][-1][1].position)
    rows = {row[0]: row for row in sections["Requirements"][0].rows}
    assert rows["LAND-010"][3].startswith("not met: ") and float(rows["LAND-010"][3].split()[2]) in np.round(away, 1)


def test_events_are_read_without_running_anything(tmp_path):
    faults = named_vector("faults", "", {"wheel": Quantity(None, "1")}, Role.TRUTH)
    monitors = named_vector("monitors", "", {"fast": Quantity(None, "1"), "give_up": Quantity(None, "1")}, Role.TELEMETRY)
    mode = named_vector("cubli/mode", "", {"mode": Quantity(None, "1"), "changes": Quantity(None, "1")}, Role.TELEMETRY)
    times = np.arange(5) * SECOND
    with BagWriter(tmp_path / "b") as writer:
        writer.attach("scenario.json", "application/json", json.dumps({
            "name": "x", "components": {}, "epoch_ns": 1, "duration_s": 9, "faults": [{"id": "wheel", "type": "stuck", "at": EVIL}],
            "events": [{"at_s": 2.5, "set": {"controller.k": 3}}], "monitors": {
                "watchpoints": [{"id": "fast", "when": "rate > 1"}], "actionpoints": [{"id": "give_up", "text": "too fast"}]}}
        ).encode())
        writer.metadata("units", {f"/{signal.topic}:position[{name}]": "1" for signal in (faults, monitors, mode)
                                  for name in signal.fixed["name"]})
        writer.metadata("flight_graph.outcome", {"complete": "false"})
        for signal, columns in ((faults, {"wheel": [0, 1, 1, 0, 0]}), (monitors, {"fast": [0, 0, 1, 1, 1],
                                "give_up": [0, 0, 0, 1, 1]}), (mode, {"mode": [0, 0, 0, 2, 2], "changes": [0, 0, 0, 1, 1]})):
            topic, records = writer.add_topic(f"/{signal.topic}", signal.type_name, signal.role.qos), signal.zeros(5)
            stamp(records, times + 1)
            for name, values in columns.items():
                records[name] = values
            for at, payload in zip((times + 1).tolist(), signal.payloads(records)):
                writer.write(topic, at, payload)
    found, count = marks(BagLines(tmp_path / "b"), {"/cubli/mode": ("balance", "hold", "rest")})
    told = [(mark.t, mark.kind, mark.text) for mark in found]
    assert count == len(told) and told[0] == (0.0, "mode", "balance")
    assert [(t, kind) for t, kind, _ in told[1:]] == [(1.0, "fault"), (2.0, "limit"), (2.5, "setting"), (3.0, "act"),
                                                      (3.0, "fault"), (3.0, "mode"), (4.0, "end")]
    assert told[2][2] == "fast holds: rate > 1" and told[4][2] == "give_up: too fast" and told[6][2] == "rest"
    assert "4 of 9 s" in told[7][2]


def test_a_stranger_s_bag_is_reported_as_far_as_it_goes_and_its_text_is_text(flight, tmp_path, monkeypatch):
    write_bag(tmp_path / "foreign")
    evil = bag_with_scenario(tmp_path / "evil", {"name": EVIL, "title": EVIL, "components": {EVIL: {"use": "evil:Law"}},
                                                 "faults": [{"id": EVIL}], "metrics": "evil:draw"})
    status, out, err = flight("report", tmp_path / "foreign", evil, "--html", tmp_path / "page.html")
    assert status == 0 and "evil: metrics, requirements and claims are left out" in err
    text = (tmp_path / "page.html").read_text()
    assert "<img" not in text and text.count("<script") == text.count("</script") and "/cubli/wheels" in text
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes((tmp_path / "foreign" / "foreign_0.mcap").read_bytes()[:-3000])
    status, out, err = flight("report", damaged)
    assert status == 2 and err.startswith("error: ") and "flight recover" in err
    status, out, err = flight("report", tmp_path / "foreign", "--metric", "x")
    assert status == 2 and "--metric goes with the folder of a campaign" in err


def test_the_page_is_opened_and_clicked(lander, sections, tmp_path):
    assert len(page.rendered("Lander", "", [page.Section(title, parts) for title, parts in sections.items()])) < 5_000_000
    view = next(parts_of(sections["In space"], page.View))
    view.height = 120  # [px] a small picture: a processor draws it here
    shown = {**sections, "All topics": sections["All topics"][:3]}
    text = page.rendered("Lander", "", [page.Section(title, parts) for title, parts in shown.items()])
    number = next(k for k, mesh in enumerate(view.data["meshes"]) if mesh["moves"])
    figures = len(list(parts_of([part for parts in shown.values() for part in parts], page.Figure)))
    corner = f"['x', 'y', 'z'].map(axis => document.querySelector('.space').data[{number}][axis][0])"
    at, slider = "document.querySelector('.space').dataset.time", "document.querySelector('.time input')"
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with Browser(tmp_path / "page.html") as browser:
        browser.run("openSpaces()")
        begin = browser.run(corner)
        browser.run(f"{slider}.value = {slider}.max; {slider}.dispatchEvent(new Event('input'))")
        browser.wait(f"{at} === {slider}.max")
        end = browser.run(corner)
        browser.run(f"{slider}.value = {slider}.min")
        browser.click(".follow")
        browser.wait(f"{at} === {slider}.min")
        browser.click(".play")
        browser.wait(f"Number({at}) > Number({slider}.min)")
        browser.click(".play")
        browser.wait("document.querySelector('.play').textContent === 'Play'")
        browser.click("details:not([open]) summary")
        browser.wait("document.querySelectorAll('details[open]').length === 2")  # the first one is open by itself
        browser.click("button[data-as=csv]")
        browser.run("drawAll()")
        assert browser.run("document.querySelectorAll('.drawing[data-drawn=yes]').length") == figures > 10
        assert browser.run("tableOf(document.querySelector('button[data-of]').dataset.of)").startswith("t [s],")
        assert browser.bad == [] and browser.asked == 0
    part = view.data["meshes"][number]["parts"][0]
    place = np.frombuffer(b64decode(part["vertices"]["f4"]), "<f4")[:3]
    frame = ["map", *frames(lander)][part["frame"]]
    for found, when in ((begin, 0), (end, -1)):
        assert np.allclose(found, placed(frame, place, when), atol=1e-3)  # [m] of a path of 1000 m


def frames(lander):
    """Names of the frames in the order of the page."""
    from flight_graph.scenes.finding import scene_of_bag
    from flight_graph.scenes.motion import poses_at, tracks
    scene = scene_of_bag(lander.bag)
    return [name for name in poses_at(scene, tracks(scene, lander.bag), np.array([lander.bag.start_ns])) if name != "map"]


def placed(frame, point, at):
    """A point of a frame in map, by the first or the last transforms of the bag as rosbags reads them and scipy turns them."""
    said = {}
    for topic in ("/tf_static", "/tf"):
        for _, message in messages(LANDER)[topic]:
            for one in message.transforms:
                said.setdefault(one.child_frame_id, []).append(one)
    while frame != "map":
        one = said[frame][at]
        move, turn = one.transform.translation, one.transform.rotation
        point = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).apply(point) + [move.x, move.y, move.z]
        frame = one.header.frame_id
    return point
