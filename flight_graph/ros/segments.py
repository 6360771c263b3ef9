"""The segments of a run that is taken back to an earlier time: each has processes and a bag of its own.

The bag of a segment says where it begins (`flight_graph.recordings.beginning`) and carries the memory there, so that it is
run again from itself; its memory is made by the compiled engine, from the bag that has just been closed.
"""

from dataclasses import dataclass
from pathlib import Path

from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.beginning import Beginning
from flight_graph.recordings.continuation import taken_back
from flight_graph.ros.simulation_settings import Control
from flight_graph.timebase import SECOND


@dataclass
class Segments:
    """Where a run stands. make(scenario, folder, begin, control): the specs of a segment's nodes; first: folder of the
    first; bags: those that were closed on the way.
    """

    scenario: Scenario
    first: Path
    begin: Beginning | None
    make: object
    rate: float

    def __post_init__(self):
        self.folder, self.bags, self._number = self.first, [], 0

    def specs(self) -> list[dict]:
        """The nodes of the first segment."""
        return self.make(self.scenario, self.folder, self.begin, Control(0, self.rate))

    def back(self, to_ns: int, from_ns: int, rate: float) -> list[dict]:
        """The nodes of the next segment, which begins at a time of the one that has just ended. Raises FlightError."""
        scenario, begin = self.scenario, self.begin
        if to_ns > (begin.checkpoint.t_ns if begin else 0):
            made = taken_back(self.folder, to_ns)
            scenario, begin = made.scenario, made.begin
        origin = f"taken back from t = {from_ns / SECOND:.9g} s of {self.folder.name}"
        self.bags.append(self.folder)
        self._number += 1
        self.folder = self._free()
        return self.make(scenario, self.folder, begin, Control(self._number, rate, origin))

    def _free(self) -> Path:
        number = self._number
        while (folder := self.first.with_name(f"{self.first.name}_reset_{number}")).exists():
            number += 1
        return folder
