"""Commands on a stranger's bag write where they say and nowhere else, also where links lie in the way."""

import os

import pytest

from tests.bag.sample_bags import write_bag


@pytest.fixture
def victim(tmp_path):
    """A file and a folder elsewhere that nobody means to change."""
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "precious").write_text("mine")
    yield tmp_path / "home"
    assert (tmp_path / "home" / "precious").read_text() == "mine"
    assert [path.name for path in (tmp_path / "home").iterdir()] == ["precious"]


@pytest.mark.parametrize("kind", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_links_in_the_folder_of_tables(flight, tmp_path, victim, kind, link):
    bag = write_bag(tmp_path / "bag", count=10).folder
    (tmp_path / "bag_tables").mkdir()
    for name in ("cubli.imu", "cubli.wheels", "diagnostics"):
        link(victim / "precious", tmp_path / "bag_tables" / f"{name}.{kind}")
    done = flight("export", bag, "--to", kind)
    assert done.status == 0 and len(list((tmp_path / "bag_tables").iterdir())) == 3, done.err


@pytest.mark.parametrize("command", ["export", "recover"])
def test_a_place_beside_the_bag_that_is_a_link(flight, tmp_path, victim, command):
    bag = write_bag(tmp_path / "bag", count=10).folder
    for name in ("bag_tables", "bag_recovered"):
        (tmp_path / name).symlink_to(victim)
    done = flight(command, bag)
    assert done.status == 2 and "is a link to another place; name where to write with --out" in done.err


def test_a_figure_beside_the_bag_that_is_a_link(flight, tmp_path, victim, earth):
    (tmp_path / "run").symlink_to(earth)
    (tmp_path / "run.png").symlink_to(victim / "precious")
    done = flight("plot", tmp_path / "run")
    assert done.status == 2 and "is a link to another place" in done.err, done.err


def test_a_dangling_link_for_a_new_bag(flight, tmp_path, victim):
    (tmp_path / "out").symlink_to(victim / "new")
    bag = write_bag(tmp_path / "bag", count=10).folder
    for command in (("recover", bag, "--out", tmp_path / "out"), ("run", "cubli_asteroid", "--out", tmp_path / "out")):
        done = flight(*command)
        assert done.status == 2 and "exists already" in done.err, done.err


TOPICS = ["/../../home/x", "/..", "/", "//", "/a/../../home/x", "/.bashrc", "/con", "/a\\..\\home\\x", "/" + "a" * 400, "/a:b", "/A", "/a", "/\0x"]


def test_names_of_topics_stay_in_the_folder(flight, tmp_path, victim):
    from flight_graph.bags.writer import BagWriter
    from tests.bag.sample_bags import IMU, recorded
    stamps, imu, _ = recorded(1, 2)
    with BagWriter(tmp_path / "bag") as writer:
        for name in TOPICS:
            writer.write(writer.add_topic(name, IMU.type_name, IMU.role.qos), 1, IMU.payloads(imu)[0])
    before = {path for path in tmp_path.rglob("*")}
    done = flight("export", tmp_path / "bag", "--out", tmp_path / "tables")
    made = {path for path in tmp_path.rglob("*")} - before
    assert done.status == 0 and {path.parent for path in made} == {tmp_path, tmp_path / "tables"}, done.err
    assert len(made) == len(TOPICS) + 1
