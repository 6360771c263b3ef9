"""What resets of a controlled run cost, and whether anything grows by them.

    python benchmarks/resets.py [--resets 20] [--minutes 40] [--scenario cubli_asteroid] [--pace lockstep]

A run of nodes is stepped and taken back again and again, to its start and to a tick in between by turns. What is left
behind is looked at on the way: memory (what is a process's own and its part of what is shared), open files and threads of
who started the nodes, of their spawner and of the node `simulation`, and the files of shared memory of the machine.
"""

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

_FLIGHT = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())"]
_LOOKS = 10  # rows of the table, about
_STEPS, _TO_S = 10, 0.02  # [1], [s]
_ANSWER_S = 300.0  # a reset takes seconds, and longer where the machine has other work


class Operator:
    """A client of the node ``simulation``."""

    def __init__(self):
        from flight_graph.ros.environment import prepare_environment
        prepare_environment()
        import rclpy
        from rclpy.node import Node
        from rclpy.parameter_client import AsyncParameterClient
        from std_srvs.srv import Trigger
        self._rclpy, self._type = rclpy, Trigger
        rclpy.init()
        self._node, self._clients = Node("operator"), {}
        self._parameters = AsyncParameterClient(self._node, "/simulation")

    def call(self, name: str):
        """Call a Trigger of the node; its sentence. Exits where it is refused."""
        if name not in self._clients:
            self._clients[name] = self._node.create_client(self._type, f"/simulation/{name}")
        client = self._clients[name]
        if not client.wait_for_service(timeout_sec=60.0):
            sys.exit(f"the run offers no /simulation/{name}")
        future = client.call_async(self._type.Request())
        self._rclpy.spin_until_future_complete(self._node, future, timeout_sec=_ANSWER_S)
        if not future.done() or not future.result().success:
            sys.exit(f"/simulation/{name}: {future.result().message if future.done() else 'no answer'}")
        return future.result().message

    def set(self, name: str, value) -> None:
        """Set a parameter of the node."""
        from rclpy.parameter import Parameter
        future = self._parameters.set_parameters([Parameter(name, value=value)])
        self._rclpy.spin_until_future_complete(self._node, future, timeout_sec=_ANSWER_S)
        if not future.done() or not future.result().results[0].successful:
            sys.exit(f"/simulation {name}: {future.result().results[0].reason if future.done() else 'no answer'}")


def children(pid: int) -> list[int]:
    """The processes that a process has started."""
    return [int(one) for task in Path(f"/proc/{pid}/task").glob("*")
            for one in (task / "children").read_text().split()]


def name_of(pid: int) -> str:
    return Path(f"/proc/{pid}/comm").read_text().strip()


def look(pid: int) -> tuple[float, int, int]:
    """(memory [MB], open files, threads) of a process."""
    rollup = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    kilobytes = next(int(line.split()[1]) for line in rollup if line.startswith("Pss:"))
    return kilobytes / 1024, len(list(Path(f"/proc/{pid}/fd").iterdir())), len(list(Path(f"/proc/{pid}/task").iterdir()))


def shared() -> int:
    """Files of the middleware in shared memory."""
    return sum(1 for one in Path("/dev/shm").iterdir() if one.name.startswith(("fastrtps", "sem.fastrtps")))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--resets", type=int, default=20)
    options.add_argument("--minutes", type=float, default=40.0, help="end before so many minutes are over")
    options.add_argument("--scenario", default="cubli_asteroid", help="a name, or a file; code that it names is run")
    options.add_argument("--pace", default="lockstep")
    options.add_argument("--domain", type=int, default=115, help="ROS domain of the run [0 to 232]")
    asked = options.parse_args()
    os.environ["ROS_DOMAIN_ID"] = str(asked.domain)
    with tempfile.TemporaryDirectory() as work:
        run = subprocess.Popen([*_FLIGHT, "run", asked.scenario, "--engine", "ros", "--control", "--pace", asked.pace,
                                "--out", f"{work}/bag", "--trust"], stdout=subprocess.DEVNULL)
        try:
            reset_again_and_again(run, asked, Path(work))
        except SystemExit:
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(30)  # where it ends by itself, it says why
            raise
        finally:
            run.terminate()
            run.wait(300)


def reset_again_and_again(run, asked, work):
    operator = Operator()
    operator.call("pause")
    operator.set("steps", _STEPS)
    spawner = children(run.pid)[0]
    simulation = next(pid for pid in children(spawner) if name_of(pid) == "simulation")
    table = Table("resets", "s each", *(f"{who}: MB, files, threads" for who in ("starter", "spawner", "simulation")),
                  "nodes", "shared memory", title=f"{asked.scenario}, {asked.pace}: taken back again and again",
                  title_justify="left")
    began = since = time.monotonic()
    every = max(1, asked.resets // _LOOKS)
    last = done = 0
    while True:
        if done in (1, 5) or done % every == 0 or done == asked.resets:
            rows = ["{:.2f}, {}, {}".format(*look(pid)) for pid in (run.pid, spawner, simulation)]
            each = f"{(time.monotonic() - since) / (done - last):.2f}" if done > last else "-"
            since, last = time.monotonic(), done
            table.add_row(str(done), each, *rows, str(len(children(spawner))), str(shared()))
            print(done, each, *rows, len(children(spawner)), shared(), file=sys.stderr, flush=True)
        if done == asked.resets or time.monotonic() - began > 60.0 * asked.minutes:
            break
        operator.call("step")
        operator.set("reset_to_s", _TO_S if done % 2 and asked.pace == "lockstep" else 0.0)
        if not operator.call("reset").startswith("the run was taken back"):
            sys.exit("the run stands where it was to go back to")
        done += 1
        for bag in sorted(work.glob("bag_reset_*"), key=lambda one: one.stat().st_mtime)[:-2]:
            shutil.rmtree(bag)
    Console(width=160).print(table)
    Console().print(f"{done} resets in {(time.monotonic() - began) / 60:.1f} minutes")


if __name__ == "__main__":
    main()
