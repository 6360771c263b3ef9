"""Bags to test with: two fixed-layout topics, a variable one, attachments and metadata, with known numbers in them."""

from types import SimpleNamespace

import numpy as np

from flight_graph.bags.writer import BagWriter
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role
from msg_schemas.signal import Signal

IMU = Signal("cubli/imu", "sensor_msgs/msg/Imu", Role.SENSOR, fixed={"header.frame_id": "imu_link"})
WHEELS = Signal("cubli/wheels", "sensor_msgs/msg/JointState", Role.SENSOR, fixed={
    "header.frame_id": "cubli", "name": ["wheel_x", "wheel_y", "wheel_z"], "position": 3, "velocity": 3, "effort": 3})


def stamp(records, stamps_ns):
    records["header"]["stamp"]["sec"] = stamps_ns // 10**9
    records["header"]["stamp"]["nanosec"] = stamps_ns % 10**9


def recorded(seed, count):
    """Return (stamps [ns], Imu records, wheel records at every second stamp) with random numbers."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(count) * 5_000_000  # [ns]
    imu, wheels = IMU.zeros(count), WHEELS.zeros((count + 1) // 2)
    stamp(imu, stamps)
    stamp(wheels, stamps[::2])
    for name, width in (("orientation", 4), ("angular_velocity", 3), ("linear_acceleration", 3)):
        imu[name] = rng.standard_normal((count, width))
    for name in ("position", "velocity", "effort"):
        wheels[name] = rng.standard_normal((len(wheels), 3))
    return stamps, imu, wheels


def diagnostics_payload(index):
    """A DiagnosticArray whose length depends on the index, serialised by rosbags."""
    types = TYPESTORE.types
    status, pair = types["diagnostic_msgs/msg/DiagnosticStatus"], types["diagnostic_msgs/msg/KeyValue"]
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](index, 7), "cubli")
    values = [pair(f"key{i}", "v" * i) for i in range(index % 4)]
    message = types["diagnostic_msgs/msg/DiagnosticArray"](
        header, [status(index % 3, f"part {index}", "all is well", "id", values)] * (index % 3))
    return bytes(TYPESTORE.serialize_cdr(message, "diagnostic_msgs/msg/DiagnosticArray"))


def write_bag(folder, seed=1, count=600, change=None):
    """Write the test bag message by message; ``change`` may alter the Imu records first."""
    stamps, imu, wheels = recorded(seed, count)
    if change is not None:
        change(imu)
    payloads = {"/cubli/imu": IMU.payloads(imu), "/cubli/wheels": WHEELS.payloads(wheels)}
    with BagWriter(folder) as writer:
        topics = [writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos),
                  writer.add_topic("/cubli/wheels", WHEELS.type_name, WHEELS.role.qos),
                  writer.add_topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", Role.DIAGNOSTICS.qos)]
        writer.attach("scenario.yaml", "application/yaml", b"name: hop\nseed: 3\n")
        writer.metadata("versions", {"numpy": "2", "seed": "3"})
        for i, at in enumerate(stamps.tolist()):
            writer.write(topics[0], at, payloads["/cubli/imu"][i])
            if i % 2 == 0:
                writer.write(topics[1], at, payloads["/cubli/wheels"][i // 2].tobytes())
            if i % 50 == 0:
                writer.write(topics[2], at, diagnostics_payload(i // 50))
    return SimpleNamespace(folder=folder, mcap=folder / f"{folder.name}_0.mcap", stamps=stamps, imu=imu,
                           wheels=wheels, payloads=payloads)
