"""Differences between bags, against changes put in by hand."""

import numpy as np
import pytest

from flight_graph.bags.diff import diff
from flight_graph.bags.writer import BagWriter
from msg_schemas.qos import Role
from tests.bag.sample_bags import IMU, diagnostics_payload, write_bag


def by_topic(a, b):
    return {result.topic: result for result in diff(a, b)}


def test_equal_bags(bag, tmp_path):
    results = by_topic(bag.folder, write_bag(tmp_path / "again").folder)
    assert list(results) == ["/cubli/imu", "/cubli/wheels", "/diagnostics"]
    assert all(result.equal and result.same_values and not result.fields for result in results.values())
    assert str(results["/cubli/imu"]) == "/cubli/imu: equal (600 messages, byte for byte)"


def test_first_and_largest_difference(bag, tmp_path):
    def change(imu):
        imu["angular_velocity"][300, 1] = bag.imu["angular_velocity"][300, 1] * 2
        imu["angular_velocity"][400, 1] += 5.0
        imu["orientation"][450, 3] = np.nan
    result = by_topic(bag.folder, write_bag(tmp_path / "other", change=change).folder)["/cubli/imu"]
    old = bag.imu["angular_velocity"][:, 1]
    assert not result.equal and not result.same_values
    assert (result.first.index, result.first.stamp_ns, result.first.field) == (300, 1_500_000_000, "angular_velocity.y")
    assert (result.first.value_a, result.first.value_b) == (old[300], 2 * old[300])
    assert set(result.fields) == {"angular_velocity.y", "orientation.w"}
    assert result.fields["angular_velocity.y"].absolute == max(abs(old[300]), abs(old[400] + 5.0 - old[400]))
    assert result.fields["angular_velocity.y"].relative == pytest.approx(
        max(0.5, 5.0 / max(abs(old[400]), abs(old[400] + 5.0))))
    assert np.isinf(result.fields["orientation.w"].absolute)
    assert "angular_velocity.y" in str(result) and "1.500000000 s" in str(result)


def test_counts_and_missing_topics(bag, tmp_path):
    with BagWriter(tmp_path / "short") as writer:
        topic = writer.add_topic("/cubli/imu", IMU.type_name, Role.SENSOR.qos)
        writer.write_many([(topic, bag.stamps[:100], bag.payloads["/cubli/imu"][:100])])
    results = by_topic(bag.folder, tmp_path / "short")
    imu = results["/cubli/imu"]
    assert (imu.count_a, imu.count_b, imu.equal, imu.first) == (600, 100, False, None)
    assert "600 and 100 messages" in str(imu)
    assert "missing in" in str(results["/cubli/wheels"])


def test_stamps_and_padding(tmp_path):
    """A shifted log time differs; bytes that no field covers are told apart from values."""
    padded = bytearray(IMU.template)
    hole = 4 + 8 + 4 + len("imu_link") + 1  # behind the string, before the next float64
    padded[hole] = 0x55
    for name, at, payload in (("a", 5, IMU.template), ("b", 6, IMU.template), ("c", 5, bytes(padded))):
        with BagWriter(tmp_path / name) as writer:
            writer.write(writer.add_topic("/imu", IMU.type_name, Role.SENSOR.qos), at, payload)
    late, = diff(tmp_path / "a", tmp_path / "b")
    assert (late.first.field, late.first.value_a, late.first.value_b) == ("stamp", 5, 6)
    padding, = diff(tmp_path / "a", tmp_path / "c")
    assert (padding.equal, padding.same_values, padding.first.field) == (False, True, "padding")
    assert "padding bytes differ" in str(padding)


def test_signed_zero_and_variable_messages(tmp_path):
    for name, number, index in (("a", 0.0, 1), ("b", -0.0, 2)):
        records = IMU.zeros(1)
        records["linear_acceleration"][0, 2] = number
        with BagWriter(tmp_path / name) as writer:
            imu = writer.add_topic("/imu", IMU.type_name, Role.SENSOR.qos)
            writer.write(imu, 0, IMU.payloads(records)[0])
            diagnostics = writer.add_topic("/d", "diagnostic_msgs/msg/DiagnosticArray", Role.DIAGNOSTICS.qos)
            writer.write(diagnostics, 0, diagnostics_payload(index))
    imu, diagnostics = diff(tmp_path / "a", tmp_path / "b")
    assert (imu.first.field, imu.fields["linear_acceleration.z"].absolute) == ("linear_acceleration.z", 0.0)
    assert not diagnostics.same_values and diagnostics.first.field == "header.stamp.sec"
    assert set(diagnostics.fields) == {"header.stamp.sec", "status"}


def test_another_frame_of_equal_length(tmp_path):
    for name, frame in (("a", b"imu_link"), ("b", b"imu_lynx")):
        with BagWriter(tmp_path / name) as writer:
            imu = writer.add_topic("/imu", IMU.type_name, Role.SENSOR.qos)
            writer.write(imu, 3, IMU.template.replace(b"imu_link", frame))
    result, = diff(tmp_path / "a", tmp_path / "b")
    assert (result.first.field, result.first.value_a, result.first.value_b) == (
        "header.frame_id", "imu_link", "imu_lynx")
    assert not result.same_values


def test_numbers_inside_of_lists_of_structures(tmp_path):
    """A tf message is a list of transforms: what differs in it by rounding is measured, anything else is infinite."""
    from msg_schemas.definitions import TYPESTORE
    types, kind = TYPESTORE.types, "tf2_msgs/msg/TFMessage"

    def bag(name, x, child):
        header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](1, 2), "map")
        transforms = [types["geometry_msgs/msg/TransformStamped"](header, child * n, types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](x, 2.0, 0.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)))
            for n in (1, 2)]
        with BagWriter(tmp_path / name) as writer:
            topic = writer.add_topic("/tf", kind, Role.TRUTH.qos)
            for count in (1, 2):  # of two lengths, so that no fixed layout holds
                writer.write(topic, count, bytes(TYPESTORE.serialize_cdr(types[kind](transforms[:count]), kind)))
        return tmp_path / name

    first = bag("a", 8.0, "base")
    close, = diff(first, bag("b", np.nextafter(8.0, 9.0), "base"))
    assert close.fields["transforms"].absolute == np.nextafter(8.0, 9.0) - 8.0
    assert close.fields["transforms"].relative == pytest.approx(2.0**-52, rel=0.5)
    other, = diff(first, bag("c", 8.0, "head"))
    assert other.fields["transforms"].absolute == np.inf
