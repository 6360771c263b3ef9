"""Calls of services of other nodes, from any thread: a node of its own hears the answers."""

import threading
import time

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from flight_graph.errors import FlightError
from flight_graph.ros.patience import at_least

_LOOK_S = 0.01
_THERE_S = 10.0  # nodes that start take seconds
_ANSWER_S, _TRIES = 3.0, 4  # who has just been started may not have heard the first call


def _is_done(future) -> bool:
    """Wait for an answer, a little while at most; whether it is there."""
    answered = threading.Event()
    future.add_done_callback(lambda _: answered.set())
    return answered.wait(at_least(_ANSWER_S))


class Asking:
    """name: of the node; it is hidden where it begins with an underscore."""

    def __init__(self, name: str):
        self._node = Node(name, start_parameter_services=False, enable_rosout=False)
        self._clients, self._lock = {}, threading.Lock()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        threading.Thread(target=self._serve, daemon=True).start()

    def call(self, type_, service: str, request):
        """The answer of a service. Raises FlightError where none comes."""
        client = self._client(type_, service)
        for _ in range(_TRIES):
            self._wait_for(client)
            future = client.call_async(request)
            if _is_done(future):
                return future.result()
            client.remove_pending_request(future)
        raise FlightError(f"nobody answers at {client.srv_name}")

    def _client(self, type_, service):
        with self._lock:
            if service not in self._clients:
                self._clients[service] = self._node.create_client(type_, service)
            return self._clients[service]

    @staticmethod
    def _wait_for(client):
        deadline = time.monotonic() + at_least(_THERE_S)
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                raise FlightError(f"nobody offers {client.srv_name}")
            time.sleep(_LOOK_S)

    def _serve(self):
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass

    def close(self) -> None:
        """End its node."""
        self._executor.shutdown(timeout_sec=1.0)
        self._node.destroy_node()
