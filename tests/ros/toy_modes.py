"""A mode manager for the toy graph: the controller's command, or none."""

from flight_graph.components.component import Component
from flight_graph.components.records import State
from flight_math import kernel, same
from msg_schemas.modes import mode, mode_request
from msg_schemas.qos import Role
from msg_schemas.signal import Signal
from tests.graph import toy

STALE_S = 0.1  # [s] age of a command from which it is missed; who is started again takes longer
SAFE_COMMAND = Signal("toy/safe_command", "sensor_msgs/msg/JointState", Role.COMMAND,
                      {"header.frame_id": "toy", "name": ["x", "y", "z"], "effort": 3})


class ModeState(State):
    mode: int
    requests: int
    changes: int
    entered: float


@kernel
def manage(t_ns, p, x, command, request, safe, mode):
    if request.requests > x.requests:
        x.requests = int(request.requests)
        x.mode, x.entered, x.changes = int(request.mode), t_ns * 1e-9, x.changes + 1
    safe.effort = command.effort if x.mode == 0 else same(0.0)
    mode.mode, mode.entered, mode.changes, mode.cause = x.mode, x.entered, x.changes, request.cause


class Modes(Component):
    """Run, or safe."""

    state, modes = ModeState, ("run", "safe")
    inputs = {"command": toy.COMMAND, "request": mode_request("toy", "toy")}
    outputs = {"safe": SAFE_COMMAND, "mode": mode("toy", "toy")}
    optional_inputs = ("request",)
    kernel = manage


def scenario(**overrides) -> dict:
    """The toy graph behind a mode manager that monitors ask to be safe when the command is older than `STALE_S`."""
    data = toy.scenario(**overrides)
    data["components"]["modes"] = {"use": f"{__file__}:Modes"}
    data["connect"]["plant.command"] = "modes.safe"
    data["monitors"] = {
        "rate_hz": 100, "watchpoints": [{"id": "no_law", "stale": "controller.command", "after_s": STALE_S}],
        "actionpoints": [{"id": "law_lost", "when": "no_law", "blames": ["controller"], "mode": {"modes": "safe"}}]}
    return data
