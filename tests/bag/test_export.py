"""Tables: the numbers of the records come back from every format, under names with units."""

import csv
import json

import numpy as np
import pytest
from pyarrow import parquet

from flight_graph.bags.errors import BagError
from flight_graph.bags.export import export
from flight_graph.bags.writer import BagWriter
from msg_schemas.qos import Role
from tests.bag.sample_bags import WHEELS


def read_csv(path):
    with open(path, newline="") as file:
        head, *rows = csv.reader(file)
    return {name: [row[i] for row in rows] for i, name in enumerate(head)}


READERS = {"csv": read_csv, "parquet": lambda path: parquet.read_table(path).to_pydict(), "npz": np.load}


@pytest.mark.parametrize("to", READERS)
def test_round_trip(bag, tmp_path, to):
    paths = export(bag.folder, tmp_path, to=to).paths
    assert [path.name for path in paths] == [f"cubli.imu.{to}", f"cubli.wheels.{to}", f"diagnostics.{to}"]
    imu, wheels, diagnostics = (READERS[to](path) for path in paths)
    assert list(imu)[:2] == ["stamp [ns]", "time [s]"]
    np.testing.assert_array_equal(np.array(imu["stamp [ns]"], np.int64), bag.stamps)
    np.testing.assert_array_equal(np.array(imu["time [s]"], float), bag.stamps / 1e9)
    for axis, name in enumerate("xyz"):
        column = np.array(imu[f"angular_velocity.{name} [rad/s]"], float)
        np.testing.assert_array_equal(column, bag.imu["angular_velocity"][:, axis])
        column = np.array(wheels[f"effort[wheel_{name}]"], float)
        np.testing.assert_array_equal(column, bag.wheels["effort"][:, axis])
    np.testing.assert_array_equal(np.array(imu["orientation.w"], float), bag.imu["orientation"][:, 3])
    assert {"header.stamp.sec [s]", "orientation_covariance[4] [rad^2]", "linear_acceleration.z [m/s^2]"} <= set(imu)
    assert diagnostics["header.frame_id"][0] == "cubli"
    status = json.loads(str(diagnostics["status"][5]))
    assert [s["name"] for s in status] == ["part 5"] * 2 and status[0]["values"][0] == {"key": "key0", "value": ""}


def test_units_from_the_bag_and_the_caller(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer.metadata("units", {"/wheels:position[wheel_x]": "rad"})
        writer.write(writer.add_topic("/wheels", WHEELS.type_name, Role.SENSOR.qos), 0, WHEELS.template)
    path, = export(tmp_path / "bag", tmp_path, units={("/wheels", "effort[wheel_x]"): "N m"}).paths
    assert {"position[wheel_x] [rad]", "effort[wheel_x] [N m]", "velocity[wheel_x]"} <= set(read_csv(path))


def test_nested_names_and_arrays_of_structs(tmp_path):
    from msg_schemas.definitions import TYPESTORE

    types = TYPESTORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](1, 2), "map")
    poses = [types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](1.0, 2.0, k),
                                             types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)) for k in (3, 4)]
    with BagWriter(tmp_path / "bag") as writer:
        kind = "geometry_msgs/msg/PoseArray"
        payload = bytes(TYPESTORE.serialize_cdr(types[kind](header, poses), kind))
        writer.write(writer.add_topic("/poses", kind, Role.TRUTH.qos), 7, payload)
    path, = export(tmp_path / "bag", tmp_path / "out", topics=["/poses"]).paths
    found = read_csv(path)
    assert found["poses[1].position.z [m]"] == ["4.0"] and found["poses[0].orientation.w"] == ["1.0"]


def test_what_cannot_be_exported(bag, tmp_path):
    with pytest.raises(BagError, match="not as 'xlsx'"):
        export(bag.folder, tmp_path, to="xlsx")
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match="cannot be written"):
        export(bag.folder, tmp_path / "file" / "out")
    with pytest.raises(ValueError, match="no topic called '/none'"):
        export(bag.folder, tmp_path, topics=["/none"])
