"""What `flight view --save` writes, read back by Rerun itself: numbers, poses and shapes are the bag's."""

import shutil

import numpy as np
import pytest

from flight_graph.bags.reader import read_bag
from tests.commands import runner

chunks = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed (RERUN=none, or make viewers brings it)")
BAG = "bags/cubli_asteroid"


@pytest.fixture
def run(monkeypatch, capsys):
    return runner(monkeypatch, capsys)


def content(path):
    """(entity, component) -> (seconds or None, rows) of a recording."""
    found = {}
    for chunk in chunks.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        names = batch.schema.names
        seconds = np.array(batch.column("time").cast("int64")) / 1e9 if "time" in names else None
        for name in names:
            if ":" in name:
                found.setdefault((chunk.entity_path, name), []).append((seconds, batch.column(name).to_pylist()))
    return {key: (None if parts[0][0] is None else np.concatenate([one for one, _ in parts]),
                  [row for _, rows in parts for row in rows]) for key, parts in found.items()}


def test_numbers_and_poses_are_those_of_the_bag(run, tmp_path):
    path = tmp_path / "rover.rrd"
    assert run("view", BAG, "--save", path)[:2] == (0, f"{path}\n")
    found, bag = content(path), read_bag(BAG)
    seconds, rows = found["/plots/cubli/funnel/attitude_xi", "Scalars:scalars"]
    names = bag.constants("/cubli/funnel")["name"]
    columns = [names.index(f"attitude_xi[{k}]") for k in range(3)]
    np.testing.assert_array_equal(np.array(rows), bag["/cubli/funnel"]["position"][:, columns])
    np.testing.assert_allclose(seconds, (bag.stamps_ns("/cubli/funnel") - bag.start_ns) / 1e9, atol=1e-9)
    assert found["/plots/cubli/wheel_command/effort", "SeriesLines:names"][1] == [["wheel_x", "wheel_y", "wheel_z"]]
    moved = [one for message in bag.decoded("/tf")["transforms"] for one in message
             if one["child_frame_id"] == "cubli_base"]
    seconds, rows = found["/scene/map/site/cubli_base", "Transform3D:translation"]
    assert len(rows) == len(moved) == len(seconds)
    np.testing.assert_allclose(np.array(rows)[:, 0], [one["transform"]["translation"] for one in moved], atol=1e-6)
    assert any(name.startswith("Boxes3D") for entity, name in found if entity == "/scene/map/site/cubli_base/cube")
    stored = chunks.RrdReader(path)
    assert len(stored.recordings()) == 1 and len(stored.blueprints()) == 1


def test_a_long_bag_is_thinned_and_it_is_said(run, tmp_path):
    path = tmp_path / "thin.rrd"
    status, _, said = run("view", BAG, "--save", path, "--points", "20")
    assert status == 0 and "thinned: of topics with more than 20 messages" in said
    seconds, rows = content(path)["/plots/cubli/imu/angular_velocity", "Scalars:scalars"]
    assert len(rows) <= 21 and np.isclose(seconds[-1], 0.49)


def test_bags_that_are_damaged_or_foreign(run, tmp_path):
    shutil.copytree(BAG, tmp_path / "bag")
    file = next((tmp_path / "bag").glob("*.mcap"))
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    status, _, said = run("view", tmp_path / "bag", "--save", tmp_path / "x.rrd")
    assert status == 2 and "is damaged" in said and not (tmp_path / "x.rrd").exists()
    from flight_graph.bags.writer import BagWriter
    from msg_schemas.definitions import TYPESTORE
    from msg_schemas.qos import Qos
    types = TYPESTORE.types
    writer = BagWriter(tmp_path / "foreign")
    topic = writer.add_topic("/level", "std_msgs/msg/Float64", Qos(10))
    for k in range(5):
        writer.write(topic, 10**18 + k * 10**9, bytes(TYPESTORE.serialize_cdr(
            types["std_msgs/msg/Float64"](k / 3), "std_msgs/msg/Float64")))
    writer.close()
    status, _, said = run("view", tmp_path / "foreign", "--save", tmp_path / "foreign.rrd")
    assert status == 0 and "no picture, plots alone" in said
    seconds, rows = content(tmp_path / "foreign.rrd")["/plots/level/data", "Scalars:scalars"]
    assert rows == [[k / 3] for k in range(5)] and seconds.tolist() == [0, 1, 2, 3, 4]
