"""What moves in a run: each component of the truth that publishes a true pose, as an entity. Its node is asked where it is,
and told where to be (`flight_graph.ros.placing`).
"""

import json
import re

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import Trigger

from flight_graph.components import placement
from flight_graph.components.names import ros
from flight_graph.components.namespaces import MAP
from flight_graph.errors import FlightError
from flight_graph.graphs import placements
from flight_graph.ros.asking import Asking
from flight_graph.ros.placing import MOTION, PLACE

_WORLD = "world"  # as other simulators call what does not move


class Entities:
    """The entities of a graph. about: name -> what it is; frames: name -> the frame in which its motion is told.

    All methods raise FlightError.
    """

    def __init__(self, graph):
        self._nodes = {found.name: found for found in graph.nodes.values() if placement.pose_signal(found.component)}
        self.about = {name: node.component.summary() for name, node in self._nodes.items()}
        self.frames = {name: placement.frame_of(node.component) for name, node in self._nodes.items()}
        self._asking = Asking("_simulation_asks")

    def can_be_put(self, name: str) -> bool:
        """Whether a component says what it means to be put elsewhere."""
        return self._nodes[name].component.place is not None

    def matching(self, expression: str) -> list[str]:
        """The names in which a regular expression is found; all for an empty one."""
        try:
            pattern = re.compile(expression)
        except re.error as error:
            raise FlightError(f"'{expression}' is no regular expression: {error}") from None
        return [name for name in self.about if pattern.search(name)]

    def motion(self, name: str) -> tuple[int, placement.TrueMotion]:
        """(time [ns], where an entity is then): at its next firing, as it stands now."""
        answer = self._asking.call(Trigger, MOTION.replace("~", ros(name)), Trigger.Request())
        if not answer.success:
            raise FlightError(answer.message)
        found = json.loads(answer.message)
        return found.pop("t_ns"), placement.TrueMotion(**found)

    def parse(self, text: str, where: str) -> dict[str, dict]:
        """What a text puts where (entity -> quantities), in plain form."""
        found = placements.parse(text, where)
        if not found:
            raise FlightError(f"{where}: nothing is put anywhere; write ENTITY.QUANTITY=[NUMBERS]; entities are "
                              f"{', '.join(self.about) or 'none here'}")
        return {name: placements.require(self._nodes, name, given, where) for name, given in found.items()}

    def put(self, name: str, given: dict) -> None:
        """Put an entity elsewhere before its next firing."""
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=json.dumps(given))
        request = SetParameters.Request(parameters=[Parameter(name=PLACE, value=value)])
        result = self._asking.call(SetParameters, f"{ros(name)}/set_parameters", request).results[0]
        if not result.successful:
            raise FlightError(result.reason)

    def require_frame(self, name: str, frame: str) -> None:
        """Refuse a frame that is not that of an entity's motion. That of the world (none, world, map) is the same one."""
        if frame not in ("", _WORLD, MAP, self.frames[name]):
            raise FlightError(f"the frame '{frame}' is not taken; allowed for {name}: {self.frames[name]}, or none")

    def close(self) -> None:
        """Nobody is asked any more."""
        self._asking.close()
