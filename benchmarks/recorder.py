"""What recording costs: microseconds and megabytes a second, message by message and in whole arrays.

    python benchmarks/recorder.py [--messages 200000]

IMU messages of random numbers, 324 bytes each, which zstd cannot shrink much; the writer is closed and on the
disk within the time. The library mcap writes the same messages beside it.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from flight_graph.bags.writer import BagWriter
from msg_schemas.definitions import definition
from msg_schemas.qos import Role
from msg_schemas.signal import Signal

IMU = Signal("cubli/imu", "sensor_msgs/msg/Imu", Role.SENSOR, fixed={"header.frame_id": "imu_link"})
PERIOD_NS = 1_000_000  # [ns]


def messages(count: int):
    """Return (stamps [ns] (count,), payloads (count, size) uint8): random numbers in every field."""
    rng, records = np.random.default_rng(1), IMU.zeros(count)
    for name, width in (("orientation", 4), ("angular_velocity", 3), ("linear_acceleration", 3)):
        records[name] = rng.standard_normal((count, width))
    stamps = np.arange(count) * PERIOD_NS
    records["header"]["stamp"]["sec"], records["header"]["stamp"]["nanosec"] = stamps // 10**9, stamps % 10**9
    return stamps, IMU.payloads(records)


def one_by_one(folder, stamps, rows):
    with BagWriter(folder) as writer:
        topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
        for stamp, row in zip(stamps, rows):
            writer.write(topic, stamp, row)


def whole(folder, stamps, payloads):
    with BagWriter(folder) as writer:
        writer.write_many([(writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos), stamps, payloads)])


def library(folder, stamps, rows):
    from mcap.writer import CompressionType, Writer
    folder.mkdir()
    with open(folder / "bag.mcap", "wb") as file:
        writer = Writer(file, chunk_size=65536, compression=CompressionType.ZSTD)
        writer.start("ros2", "mcap")
        schema = writer.register_schema(IMU.type_name, "ros2msg", definition(IMU.type_name).text.encode())
        channel = writer.register_channel("/cubli/imu", "cdr", schema)
        for number, (stamp, row) in enumerate(zip(stamps, rows)):
            writer.add_message(channel, stamp, row, stamp, number)
        writer.finish()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--messages", type=int, default=200_000)
    count = options.parse_args().messages
    stamps, payloads = messages(count)
    listed, rows = stamps.tolist(), [row.tobytes() for row in payloads]
    table = Table("writer", "us a message", "CPU us", "MB/s", "MB a CPU second",
                  title=f"recording {count} IMU messages of {payloads.shape[1]} bytes",
                  title_justify="left")
    with tempfile.TemporaryDirectory() as work:
        whole(Path(work) / "compile", stamps[:10], payloads[:10])
        for number, (name, write, what) in enumerate((
                ("ours, one by one", one_by_one, (listed, rows)), ("ours, whole arrays", whole, (stamps, payloads)),
                ("library mcap, one by one", library, (listed, rows)))):
            began, worked = time.perf_counter(), time.process_time()
            write(Path(work) / str(number), *what)
            took, worked = time.perf_counter() - began, time.process_time() - worked
            table.add_row(name, f"{1e6 * took / count:.2f}", f"{1e6 * worked / count:.2f}",
                          f"{payloads.nbytes / took / 1e6:.0f}", f"{payloads.nbytes / worked / 1e6:.0f}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
