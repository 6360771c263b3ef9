"""Simulation control by services of std_srvs, which every ROS 2 has: each a Trigger below the node's name."""

import json
from dataclasses import replace
from functools import partial

from std_srvs.srv import Trigger

from flight_graph.errors import FlightError
from flight_graph.ros import simulation as control
from flight_graph.timebase import SECOND


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
        "place": lambda: _placed(node),
        "entities": lambda: _entities(node),
    }
    for name, call in calls.items():
        node.create_service(Trigger, f"~/{name}", _answered(call), callback_group=node.group)


def _placed(node):
    """Put what the parameter says where it says; the first refusal, where there is one."""
    try:
        wanted = node.placements
    except FlightError as error:
        return control.Answer(control.FAILED, str(error))
    done = []
    for name, given in wanted.items():
        answer = node.simulation.place(name, partial(node.entities.put, name, given), False)
        if not answer.is_ok:
            return replace(answer, text="; ".join([answer.text, *(f"{one} is put already" for one in done)]))
        done.append(name)
    if done[1:]:
        return replace(answer, text=f"{' and '.join(done)} are{answer.text.removeprefix(f'{name} is')}")
    return answer


def _entities(node):
    """Where everything is that moves, as JSON."""
    try:
        found = {name: node.entities.motion(name) for name in node.entities.about}
    except FlightError as error:
        return control.Answer(control.FAILED, str(error))
    return control.Answer(control.OK, json.dumps({
        name: {"t_s": t_ns / SECOND, "frame": node.entities.frames[name], **vars(motion)}
        for name, (t_ns, motion) in found.items()}))


def _answered(call):
    def answer(_, response):
        found = call()
        response.success, response.message = found.is_ok, found.text
        return response
    return answer
