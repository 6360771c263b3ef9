"""Commands that read bags: what they print, and that no damage gives a traceback or wrong data."""

import csv
import json
import shutil
import zlib

import numpy as np
import pytest
from mcap.writer import Writer

from flight_graph.bags.message_types import standard_definition
from flight_graph.bags.reader import read_bag
from tests.bag.sample_bags import write_bag
from tests.bag_commands.conftest import recorded

CASES = 200


def commands(bag, other):
    """Every command that reads a bag, as arguments."""
    return [("info", bag), ("verify", bag), ("replay", bag, "--component", "plant"), ("play", bag), ("plot", bag),
            ("diff", bag, other), ("diff", other, bag), ("export", bag, "--to", "npz", "--out", bag.parent / "tables")]


def damaged_copy(bag, folder, content):
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(bag, folder)
    next(folder.glob("*.mcap")).write_bytes(content)
    return folder


@pytest.mark.parametrize("harm", ["cut", "flip"])
def test_damage_never_crashes_a_command(flight, earth, tmp_path, harm):
    """200 places each, the commands in turn: status 2 and a sentence that names the way out."""
    content = next(earth.glob("*.mcap")).read_bytes()
    rng = np.random.default_rng(zlib.crc32(harm.encode()))
    folder = tmp_path / "broken"
    for case, place in enumerate(rng.integers(0, len(content), CASES).tolist()):
        broken = bytearray(content[:place] if harm == "cut" else content)
        if harm == "flip":
            broken[place] ^= 1 << int(rng.integers(8))
        damaged_copy(earth, folder, broken)
        chosen = commands(folder, earth)
        done = flight(*chosen[case % len(chosen)])
        assert done.status == 2 and done.out == "", (chosen[case % len(chosen)], done)
        assert f"`flight recover {folder}`" in " ".join(done.err.split()), done.err


def test_recover_says_what_it_saved(flight, earth, tmp_path):
    content = next(earth.glob("*.mcap")).read_bytes()
    broken = damaged_copy(earth, tmp_path / "broken", content[:len(content) // 2])
    report = json.loads(flight("recover", broken, "--json").out)
    saved = read_bag(tmp_path / "broken_recovered")
    assert report["bag"] == str(tmp_path / "broken_recovered")
    assert {name: entry["saved"] for name, entry in report["topics"].items()} == {
        name: info.count for name, info in saved.topics.items()}
    assert flight("verify", tmp_path / "broken_recovered").status == 0
    again = flight("recover", broken)
    assert again.status == 2 and "exists already" in " ".join(again.err.split())
    other = flight("recover", broken, "--out", tmp_path / "elsewhere")
    assert other.status == 0 and "/cubli/truth" in other.out and other.out.rstrip().endswith("elsewhere")


def test_an_unfinished_bag_is_recognised(flight, earth, tmp_path):
    """The mark RECORDING without a living recorder, as kill -9 leaves it."""
    folder = damaged_copy(earth, tmp_path / "broken", next(earth.glob("*.mcap")).read_bytes())
    (folder / "RECORDING").write_bytes(b"")
    for arguments in commands(folder, earth):
        done = flight(*arguments)
        assert done.status == 2 and "recorder was stopped" in " ".join(done.err.split())


def test_diff(flight, earth, tmp_path):
    same = flight("diff", earth, earth)
    assert same.status == 0 and "/cubli/truth: equal (500 messages, byte for byte)" in same.out

    def change(recording):
        for track in recording.tracks:
            if track.topic == "cubli/wheel_command":
                track.records["effort"][7, 2] += 0.25
        return recording

    other = recorded("cubli_earth", {"duration_s": 0.5}, tmp_path / "other", change)
    done = flight("diff", earth, other, "--json")
    report = json.loads(done.out)
    assert done.status == 1 and not report["equal"]
    differing, = [topic for topic in report["topics"] if not topic["equal"]]
    assert differing["topic"] == "/cubli/wheel_command" and list(differing["fields"]) == ["effort[wheel_z]"]
    assert differing["fields"]["effort[wheel_z]"]["absolute"] == pytest.approx(0.25)
    assert (differing["first"]["index"], differing["first"]["field"]) == (7, "effort[wheel_z]")
    shown = flight("diff", earth, other)
    assert shown.status == 1 and "effort[wheel_z]" in shown.out and "0.25" in shown.out
    assert flight("diff", earth, other, "--topics", "cubli/truth").status == 0
    assert "did you mean '/cubli/truth'" in flight("diff", earth, other, "--topics", "cubli/truht").err


def test_export_has_units_and_names(flight, earth, tmp_path):
    done = flight("export", earth, "--out", tmp_path / "tables", "--topics", "cubli/truth,/cubli/wheel_command")
    assert done.status == 0
    with open(tmp_path / "tables" / "cubli.truth.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    truth = read_bag(earth)["/cubli/truth"]
    assert [float(row["position[rates[1]] [rad/s]"]) for row in rows] == truth["position"][:, 4].tolist()
    assert {file.name for file in (tmp_path / "tables").iterdir()} == {"cubli.truth.csv", "cubli.wheel_command.csv"}
    report = json.loads(flight("export", earth, "--to", "parquet", "--out", tmp_path / "p", "--json").out)
    assert len(report["files"]) == len(read_bag(earth).topics)
    assert "csv, parquet, npz" in flight("export", earth, "--to", "xls").err


def test_reading_commands_take_a_foreign_bag(flight, tmp_path):
    """A bag without a scenario is read, compared, exported and drawn; commands that need one say so."""
    bag = write_bag(tmp_path / "hop").folder
    assert flight("info", bag).status == 0
    assert flight("diff", bag, bag).status == 0
    assert flight("export", bag, "--to", "npz").status == 0
    assert flight("plot", bag, "--out", tmp_path / "p.png").status == 0 and (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    for arguments in (("replay", bag, "--component", "plant"), ("verify", bag)):
        done = flight(*arguments)
        assert done.status == 2 and "carries no scenario" in " ".join(done.err.split())


@pytest.mark.parametrize("crcs", [True, False])
def test_a_bag_without_checksums_is_said_to_have_none(flight, tmp_path, crcs):
    """Written by the library mcap: with a checksum for each chunk, and without any."""
    definition = standard_definition("geometry_msgs/msg/Vector3")
    with (tmp_path / "foreign.mcap").open("wb") as file:
        writer = Writer(file, enable_crcs=crcs)
        writer.start("ros2")
        schema = writer.register_schema("geometry_msgs/msg/Vector3", "ros2msg", definition.text.encode())
        channel = writer.register_channel("/v", "cdr", schema)
        for i in range(3):
            writer.add_message(channel, i, b"\0\1\0\0" + np.array([i, 2.0, 3.0]).tobytes(), i)
        writer.finish()
    for arguments in (("info", "--json"), ("export", "--to", "npz", "--out", tmp_path / "tables")):
        done = flight(arguments[0], tmp_path / "foreign.mcap", *arguments[1:])
        assert done.status == 0 and ("carries no checksums" in " ".join(done.err.split())) is not crcs, done.err
    assert json.loads(flight("info", tmp_path / "foreign.mcap", "--json").out)["checked"] is crcs


def test_help_has_examples(flight):
    for command in ("verify", "replay", "play", "recover", "diff", "export"):
        done = flight(command, "--help")
        assert done.status == 0 and f"Example: flight {command} " in " ".join(done.out.split())
