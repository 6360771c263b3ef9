"""A controlled run is taken back where a launch has started its nodes: by the node ``simulation``.

Who started the nodes with ``flight run`` ends them and starts others; a launch would take that for the end of the run. So
this node makes the next segment and tells all others, which begin again by themselves (`flight_graph.ros.following`).
"""

import json
import tempfile
import time
from functools import partial
from pathlib import Path

import yaml

from flight_graph.errors import FlightError
from flight_graph.ros import leaving
from flight_graph.ros.following import TOPIC
from flight_graph.ros.launcher import node_specs
from flight_graph.ros.node_processes import RECORDER
from flight_graph.ros.patience import at_least, patience_s
from flight_graph.ros.ports import RawPublisher
from flight_graph.ros.segments import Segments
from flight_graph.ros.standing import ORDERED
from flight_graph.ros.texts import TYPE, text_payload

_CLOSED_S = 60.0  # a recorder has written what it has, and closed its bag


class Relaunch:
    """The part of the node ``simulation``, in place of who started the nodes. out: the bag of the first segment."""

    def __init__(self, node, scenario, pace: str, rate: float, out: str):
        self._work = tempfile.TemporaryDirectory(prefix="flight_again_")
        self._publisher = RawPublisher(node, TOPIC, TYPE, ORDERED)
        self._segments = Segments(scenario, Path(out).absolute(), None, partial(self._made, pace), rate)
        self._number, self.failure = 0, ""

    def take_back(self, to_ns: int, from_ns: int, rate: float) -> None:
        """Let all begin anew at a time; what fails is kept in ``failure``."""
        self._number += 1
        closed = Path(self._work.name) / f"closed_{self._number}"
        self._say(close=str(closed))
        try:
            self._wait_for(closed)
            files = self._segments.back(to_ns, from_ns, rate)
        except FlightError as error:
            self.failure = str(error)
            return
        self._say(files=files)

    def _say(self, **said):
        self._publisher.publish(text_payload(json.dumps({"segment": self._number, **said})))

    def _wait_for(self, closed):
        deadline = time.monotonic() + at_least(_CLOSED_S)
        while not closed.exists():
            if time.monotonic() > deadline:
                raise FlightError("the run cannot be taken back: its recorder does not close the bag")
            time.sleep(0.02)

    def _made(self, pace, scenario, folder, begin, control) -> dict[str, str]:
        """name of a node -> the file of its parameters in the next segment."""
        files = {}
        for spec in node_specs(Path(self._work.name), pace, patience_s(), False, scenario, folder, begin, control):
            file = Path(spec["arguments"][-1]).with_suffix(leaving.AGAIN)
            values = yaml.safe_load(Path(spec["arguments"][-1]).read_text(encoding="utf-8"))
            for block in values.values():
                block["ros__parameters"]["graph.again"] = True
                if spec["name"] == RECORDER:
                    block["ros__parameters"]["graph.linger"] = False
            file.write_text(yaml.safe_dump(values), encoding="utf-8", newline="\n")
            files[spec["name"]] = str(file)
        return files

    def close(self) -> None:
        """Nothing begins again any more."""
        self._work.cleanup()
