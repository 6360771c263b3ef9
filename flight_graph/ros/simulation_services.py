"""Simulation control by services of std_srvs, which every ROS 2 has: each a Trigger below the node's name."""

import json

from std_srvs.srv import Trigger

from flight_graph.ros import simulation as control


def offer(node) -> None:
    """Make the services of a `flight_graph.ros.simulation_node.SimulationNode`."""
    run = node.simulation
    calls = {
        "play": lambda: run.set_state(control.PLAYING),
        "pause": lambda: run.set_state(control.PAUSED),
        "stop": lambda: run.set_state(control.STOPPED),
        "quit": lambda: run.set_state(control.QUITTING),
        "step": lambda: run.step(node.steps),
        "reset": lambda: run.reset(node.reset_to_ns),
        "state": lambda: control.Answer(control.OK, json.dumps(run.summary())),
    }
    for name, call in calls.items():
        node.create_service(Trigger, f"~/{name}", _answered(call), callback_group=node.group)


def _answered(call):
    def answer(_, response):
        found = call()
        response.success, response.message = found.is_ok, found.text
        return response
    return answer
