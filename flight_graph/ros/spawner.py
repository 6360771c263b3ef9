"""Starts the nodes of a graph quickly: one process imports everything once, and forks one child per node.

Run as ``python -m flight_graph.ros.spawner`` with a JSON list on a line of standard input: {"name", "use", "arguments"}
each (``use`` is a component or one of PROGRAMS). Further lines are nodes to start later. Events are JSON lines on
standard output: {"node", "pid"}, what nodes announce, and {"node", "exit"}. The children get SIGTERM when this process
dies, this process when its starter dies.
"""

import contextlib
import ctypes
import importlib
import json
import os
import select
import signal
import sys
import time
import traceback
import warnings

from flight_graph.engines.child_process import die_with_parent

_PR_SET_NAME = 15
_LOOK_S = 0.02  # [s] between two looks at children and orders
PROGRAMS = {"recorder": "flight_graph.ros.recorder_node:run_recorder",
            "stand_in": "flight_graph.ros.stand_in:run_stand_in",
            "simulation": "flight_graph.ros.simulation_node:run_simulation",
            "replayer": "flight_graph.ros.replay_runner:run_replayer"}


def name_process(name: str) -> None:
    """Show the node's name in ``ps`` and ``top`` (its first 15 bytes)."""
    ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode()[:15])


def main() -> int:
    die_with_parent()
    orders = _Orders()
    while not (found := orders.read(1.0)):
        pass
    specs = found[0]
    _import_once(specs)
    children, own = {}, os.getpid()
    announce = _announce("spawner")
    for spec in specs:
        if (pid := _start(spec, announce)) == 0:
            return _child(spec, own)
        children[pid] = spec["name"]
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while children:
        for spec in orders.read(_LOOK_S):
            if (pid := _start(spec, announce)) == 0:
                return _child(spec, own)
            children[pid] = spec["name"]
        pid = 1
        while children and pid:
            pid, status = os.waitpid(-1, os.WNOHANG)
            name = children.pop(pid, None)
            if name is not None:
                announce({"node": name, "exit": os.waitstatus_to_exitcode(status)})
    return 0


def _start(spec, announce) -> int:
    """Fork; 0 in the child."""
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        pid = os.fork()  # the middleware's libraries have started the tracer's threads, and only those
    if pid:
        announce({"node": spec["name"], "pid": pid})
    return pid


class _Orders:
    """Nodes to start later, one JSON object a line of standard input."""

    def __init__(self):
        self._left, self._open = b"", True

    def read(self, seconds: float) -> list[dict]:
        """What has been ordered by now; waits for at most so long."""
        if not self._open:
            time.sleep(seconds)
            return []
        if not select.select([0], [], [], seconds)[0]:
            return []
        found = os.read(0, 65536)
        self._open = bool(found)
        *lines, self._left = (self._left + found).split(b"\n")
        return [json.loads(line) for line in lines]


def _import_once(specs):
    """Everything the children need, except what starts threads or sockets."""
    from flight_graph.ros.environment import prepare_environment
    prepare_environment()
    from flight_graph.components import registry
    from flight_graph.engines import parts
    from flight_graph.ros import entry, leaving, lockstep, node, ports, realtime, recorder, recorder_node, tracer  # noqa: F401
    types = {"rosgraph_msgs/msg/Clock"}
    for spec in specs:
        if spec["use"] not in PROGRAMS:
            component = registry.component(spec["use"])
            parts.load(component, spec.get("check_bounds", False))  # once, here; compiled before the launch
            types |= {signal_.type_name for signal_ in [*component.inputs.values(), *component.outputs.values()]}
    for type_name in types:
        metaclass = type(ports.message_class(type_name))
        metaclass.__import_type_support__()
    importlib.import_module("rclpy.lifecycle")
    tracer.follow_forks()


def _child(spec, parent) -> int:
    die_with_parent(parent)
    name_process(spec["name"])
    announce = _announce(spec["name"])
    from flight_graph.ros import leaving
    try:
        if spec["use"] in PROGRAMS:
            module, _, function = PROGRAMS[spec["use"]].partition(":")
            leaving.leave(getattr(importlib.import_module(module), function)(spec["arguments"], announce))
        from flight_graph.ros.entry import run_component
        return run_component(spec["use"], spec["name"], spec["arguments"], announce)
    except Exception as error:  # a defect, not a user's mistake: tell it whole
        announce({"error": f"{spec['name']}: {type(error).__name__}: {error}"})
        traceback.print_exc()
        return 3
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def _announce(name):
    def announce(event):
        with contextlib.suppress(BrokenPipeError):  # the starter has been killed
            os.write(1, (json.dumps({"node": name, **event}) + "\n").encode())
    return announce


if __name__ == "__main__":
    sys.exit(main())
