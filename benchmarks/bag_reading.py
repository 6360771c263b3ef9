"""Reading a bag to arrays: ours against rosbags and mcap-ros2-support, in one run.

    python benchmarks/bag_reading.py [--messages 1000000] [--repeats 2]

A million IMU messages of random numbers. Each reader ends with the same: stamps, angular velocities and accelerations
of all messages as NumPy arrays, and these are compared. Each reads the bag several times, in turn; the fastest counts
(the system's price of fresh memory varies much). Ours verifies every checksum of the file first, and uses a second thread:
hence both ratios, of time and of CPU time.
"""

import argparse
import gc
import tempfile
import time
from pathlib import Path

import numpy as np
from recorder import messages, whole
from rich.console import Console
from rich.table import Table


def ours(folder):
    from flight_graph.bags.reader import read_bag
    bag = read_bag(folder)
    imu = bag["/cubli/imu"]
    return bag.stamps_ns("/cubli/imu"), imu["angular_velocity"], imu["linear_acceleration"]


def with_rosbags(folder):
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(folder) as reader:
        return _arrays((stamp, store.deserialize_cdr(raw, connection.msgtype))
                       for connection, stamp, raw in reader.messages())


def with_mcap_ros2(folder):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory
    with open(next(folder.glob("*.mcap")), "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return _arrays((message.log_time, decoded) for _, _, message, decoded in reader.iter_decoded_messages())


def _arrays(found):
    stamps, rates, accelerations = [], [], []
    for stamp, message in found:
        stamps.append(stamp)
        rate, acceleration = message.angular_velocity, message.linear_acceleration
        rates.append((rate.x, rate.y, rate.z))
        accelerations.append((acceleration.x, acceleration.y, acceleration.z))
    return np.array(stamps), np.array(rates), np.array(accelerations)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--messages", type=int, default=1_000_000)
    options.add_argument("--repeats", type=int, default=2)
    chosen = options.parse_args()
    count = chosen.messages
    with tempfile.TemporaryDirectory() as work:
        whole(Path(work) / "compile", *(part[:1000] for part in messages(1000)))
        ours(Path(work) / "compile")
        folder = Path(work) / "bag"
        whole(folder, *messages(count))
        took, readers = {}, [("ours", ours), ("rosbags", with_rosbags), ("mcap-ros2-support", with_mcap_ros2)]
        for name, read in readers * chosen.repeats:
            gc.collect()
            began, worked = time.perf_counter(), time.process_time()
            found = read(folder)
            once = time.perf_counter() - began, time.process_time() - worked
            took[name] = min(took.get(name, once), once)
            if name == "ours":
                expected = found
            assert all(np.array_equal(a, b) for a, b in zip(expected, found)), name
            del found
        size = sum(file.stat().st_size for file in folder.iterdir())
    table = Table("reader", "seconds", "us a message", "times ours", "times ours (CPU)", title_justify="left",
                  title=f"reading {count} IMU messages ({size / 1e6:.0f} MB on disk) to arrays")
    for name, (seconds, worked) in took.items():
        table.add_row(name, f"{seconds:.2f}", f"{1e6 * seconds / count:.2f}", f"{seconds / took['ours'][0]:.0f}",
                      f"{worked / took['ours'][1]:.0f}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
