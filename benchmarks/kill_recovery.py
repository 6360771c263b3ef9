"""What kill -9 costs a recording: the recorder, or the whole graph, killed at random moments of realtime runs.

    python benchmarks/kill_recovery.py [--kills 25]

A reader beside the recorder notes every IMU message with its bytes. After the kill the bag is recovered: the loss is
the wall time from the arrival of the first message that is not saved to the kill. All saved ones must be those that the
reader saw, without a gap.
"""

import argparse
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
TOPIC, TYPE = "cubli/imu", "sensor_msgs/msg/Imu"
RATE_HZ = 100.0
_FLIGHT = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())"]


@dataclass
class Kill:
    """One kill. lost_s: wall time of messages lost; saved: IMU messages saved; intact: none before is missing."""

    victim: str
    after_s: float
    lost_s: float
    saved: int
    intact: bool


def kill_once(folder: Path, victim: str, after_s: float) -> Kill:
    """Start a realtime run, kill the ``recorder`` or the whole ``graph`` after_s seconds of messages later, recover."""
    from flight_graph.bags.reader import read_bag
    from flight_graph.bags.recover import recover
    with _reader() as reader:
        run = subprocess.Popen(
            [*_FLIGHT, "run", "cubli_asteroid", "--engine", "ros", "--pace", "realtime", "--duration", "60",
             "--set", "controller.rearm=true",
             "--out", str(folder / "bag")], cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL, stderr=open(folder / "errors", "w", encoding="utf-8"))
        try:
            seen = reader.collect_until(after_s, run, folder)
            spawner = _children(run.pid)
            recorder = next(pid for pid in _children(spawner[0]) if _name(pid) == "recorder")
            seen.update(reader.take())
            killed = time.monotonic()
            if victim == "graph":
                os.killpg(spawner[0], signal.SIGKILL)
            else:
                os.kill(recorder, signal.SIGKILL)
            run.wait(timeout=60)
        finally:
            if run.poll() is None:
                run.kill()
                run.wait()
    recover(folder / "bag", folder / "saved")
    bag = read_bag(folder / "saved")
    stamps, payloads = bag.stamps_ns(f"/{TOPIC}"), bag.payloads(f"/{TOPIC}")
    intact = bool((np.diff(stamps) == round(1e9 / RATE_HZ)).all()) and all(
        bytes(payload) == seen[stamp][1] for stamp, payload in zip(stamps.tolist(), payloads) if stamp in seen)
    saved = set(stamps.tolist())
    intact = intact and all(stamp in saved for stamp in seen if stamp <= stamps[-1])
    lost = [arrived for stamp, (arrived, _) in seen.items() if stamp not in saved]
    return Kill(victim, after_s, killed - min(lost) if lost else 0.0, len(stamps), intact)


class _reader:
    """A subscription of its own in this process: stamp [ns] -> (arrival [s], bytes) of what it takes."""

    def __enter__(self):
        from flight_graph.ros.environment import prepare_environment
        prepare_environment()
        import rclpy

        from flight_graph.ros.ports import LoopOnly, RawSubscription
        from msg_schemas.qos import RECORDER
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("watcher", context=self._context)
        self._subscription = RawSubscription(self._node, TOPIC, TYPE, RECORDER, LoopOnly())
        return self

    def __exit__(self, *_):
        self._node.destroy_node()
        self._context.try_shutdown()

    def take(self) -> dict:
        found = {}
        while (message := self._subscription.take()) is not None:
            sec, nanosec = struct.unpack_from("<iI", message, 4)
            found[sec * 10**9 + nanosec] = time.monotonic(), message
        return found

    def collect_until(self, seconds, run, folder) -> dict:
        """Take messages until their stamps span some seconds."""
        seen, deadline = {}, time.monotonic() + 90.0
        while not seen or max(seen) - min(seen) < seconds * 1e9:
            seen.update(self.take())
            if time.monotonic() > deadline or run.poll() is not None:
                raise RuntimeError(f"the run gave no messages: {(folder / 'errors').read_text(encoding='utf-8')}")
            time.sleep(0.001)
        return seen


def _children(pid):
    return [int(number) for number in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()]


def _name(pid):
    return Path(f"/proc/{pid}/comm").read_text(encoding="utf-8").strip()


def main() -> None:
    from rich.console import Console
    from rich.progress import track
    from rich.table import Table

    from flight_graph.ros import shared_memory
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=25)
    kills, rng = [], np.random.default_rng(5)
    for number in track(range(options.parse_args().kills), "killing", console=Console(stderr=True)):
        with tempfile.TemporaryDirectory() as folder:
            kills.append(kill_once(Path(folder), ("recorder", "graph")[number % 2], float(rng.uniform(0.3, 3.0))))
    shared_memory.clean()
    table = Table("killed", "times", "seconds lost, median", "most", "intact",
                  title=f"kill -9 in a realtime run ({RATE_HZ:g} Hz)", title_justify="left")
    for victim in ("recorder", "graph"):
        mine = [kill for kill in kills if kill.victim == victim]
        if mine:
            lost = [kill.lost_s for kill in mine]
            table.add_row(victim, str(len(mine)), f"{np.median(lost):.3f}", f"{max(lost):.3f}",
                          f"{sum(kill.intact for kill in mine)} of {len(mine)}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
