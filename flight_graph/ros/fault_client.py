"""Asks a running graph to inject, list and clear faults: a client of the parameters of its node ``faults``."""

import json
import os
import time
from contextlib import contextmanager

from flight_graph.errors import FlightError
from flight_graph.faults.report import REPORT
from flight_graph.ros.environment import prepare_environment
from flight_graph.ros.patience import at_least, patience_s

prepare_environment()

import rclpy  # noqa: E402 (reads the environment)
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.parameter_client import AsyncParameterClient  # noqa: E402

from flight_graph.ros.live_faults import CLEAR, INJECT, INJECTED  # noqa: E402

FOUND_S = 8.0  # [s] in which a graph that is there is found


@contextmanager
def _graph(namespace: str):
    """The parameters of the node ``faults`` of a running graph: a function that waits for the answer of a call."""
    rclpy.init(args=["fault_client"])
    node = Node("fault_client", start_parameter_services=False, enable_rosout=False)
    try:
        name = f"{namespace.rstrip('/')}/{REPORT}"
        client, deadline = AsyncParameterClient(node, name), time.monotonic() + at_least(FOUND_S)
        while not client.services_are_ready():
            if time.monotonic() > deadline:
                domain = os.environ.get("ROS_DOMAIN_ID") or "0"
                raise FlightError(f"there is no node {name} on ROS domain {domain}: a graph takes faults while it runs as "
                                  "nodes, where its scenario has live_faults; ROS_DOMAIN_ID chooses the domain, and the "
                                  "run says on which it is")
            time.sleep(0.02)

        def ask(call):
            future = call(client)
            rclpy.spin_until_future_complete(node, future, timeout_sec=patience_s())
            if not future.done():
                raise FlightError(f"the node {name} does not answer")
            return future.result()
        yield ask
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _listed(ask) -> list[dict]:
    found = ask(lambda client: client.get_parameters([INJECTED])).values
    if not found or not found[0].string_value:
        raise FlightError(f"the node {REPORT} takes no faults while it runs; the scenario needs live_faults")
    return json.loads(found[0].string_value)


def _changed(namespace, name, text) -> dict:
    """Set a parameter; the injected fault that has changed then."""
    with _graph(namespace) as ask:
        before = _listed(ask)
        answer = ask(lambda client: client.set_parameters([Parameter(name, value=text)])).results[0]
        if not answer.successful:
            raise FlightError(answer.reason)
        deadline = time.monotonic() + patience_s()
        while not (changed := [one for one in _listed(ask) if one not in before]):
            if time.monotonic() > deadline:
                raise FlightError(f"the node {REPORT} does not go on")
            time.sleep(0.02)
    return changed[-1]


def inject(fault: dict, namespace: str = "") -> dict:
    """Inject a fault (the keys of a scenario's block, without id and times); what it is then. Raises FlightError."""
    return _changed(namespace, INJECT, json.dumps(fault))


def clear(name: str, namespace: str = "") -> dict:
    """End an injected fault; what it is then. Raises FlightError."""
    return _changed(namespace, CLEAR, name)


def injected(namespace: str = "") -> list[dict]:
    """The faults that have been injected. Raises FlightError."""
    with _graph(namespace) as ask:
        return _listed(ask)
