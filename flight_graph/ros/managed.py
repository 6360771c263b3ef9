"""A lifecycle node whose work is a loop of the main thread: its states, its services' thread, its end.

What a node needs is made in ``on_configure``. With the parameter ``autostart`` (the default) it configures and activates
itself; without, it waits for somebody to do so. While it is inactive its loop rests. A configuration that fails says why,
and may be tried again after parameters have been set.
"""

import threading

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from flight_graph.components.names import joined, ros
from flight_graph.errors import FlightError


class Stopped(Exception):
    """The node was asked to end (SIGINT, SIGTERM or the shutdown transition)."""


class ManagedNode(LifecycleNode):
    """The states of a node. A subclass has ``_configure()``, which raises FlightError.

    name: by default; namespace: of the vehicle that it is in, as components are named. A node in one has its topics below
    the root of the graph (`in_graph`), in whatever namespace the graph as a whole is.
    """

    def __init__(self, name: str, stopping: threading.Event | None = None, namespace: str = ""):
        inside = {"namespace": f"/{ros(namespace)}"} if namespace else {}
        super().__init__(name, automatically_declare_parameters_from_overrides=False, **inside)
        self._vehicle = namespace
        self.stopping = stopping or threading.Event()
        self._configured, self.active = threading.Event(), threading.Event()
        self._refusal = None  # why the last configuration failed
        self._is_closing = False
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self._thread = threading.Thread(target=self._serve, daemon=True)

    @property
    def graph_name(self) -> str:
        """The name of its component in the graph."""
        return joined(self._vehicle, self.get_name())

    def in_graph(self, topic: str) -> str:
        """A topic of the graph as this node has to name it."""
        if not self._vehicle or topic.startswith("/"):
            return topic
        return f"{self.get_namespace().removesuffix(f'/{ros(self._vehicle)}')}/{topic}"

    def begin(self) -> None:
        """Serve the lifecycle, and go through it where nobody else does. Raises FlightError."""
        autostart = self.declare_parameter("autostart", True).value
        if autostart and self.trigger_configure() != TransitionCallbackReturn.SUCCESS:
            raise self._refusal
        self._thread.start()
        if autostart:
            self.trigger_activate()

    def on_configure(self, state):
        before = {*self.publishers, *self.subscriptions, *self.timers}
        try:
            self._configure()
        except FlightError as error:
            self._refusal = error
            if self._thread.is_alive():
                self.get_logger().error(str(error))
            for made, destroy in ((self.publishers, self.destroy_publisher), (self.timers, self.destroy_timer),
                                  (self.subscriptions, self.destroy_subscription)):
                for entity in [entity for entity in made if entity not in before]:
                    destroy(entity)
            return TransitionCallbackReturn.FAILURE
        self._configured.set()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        self.get_logger().error("a run cannot be begun anew: shut this node down and start it again")
        return TransitionCallbackReturn.FAILURE

    def on_activate(self, state):
        self.active.set()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.active.clear()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.stopping.set()
        return TransitionCallbackReturn.SUCCESS

    def wait_until_configured(self) -> None:
        """Raises Stopped when the node is to end before."""
        self._wait_for(self._configured)

    def check_alive(self) -> None:
        """Raise Stopped when the node is to end; wait while it is inactive."""
        self._wait_for(self.active)

    def _wait_for(self, event):
        while True:
            if self.stopping.is_set() or not rclpy.ok():
                raise Stopped
            self._beat()
            if event.wait(0.05):
                return

    def _beat(self):
        """Called again and again while the node waits."""

    def close(self) -> None:
        """End the service thread and the node."""
        self._is_closing = True
        self._executor.shutdown(timeout_sec=0.5)
        if self._thread.is_alive():
            self._thread.join(timeout=0.5)
        self.destroy_node()

    def _serve(self):
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass
        except AttributeError:  # an executor that is shut down while it looks for work finds parts of itself gone
            if not self._is_closing:
                raise
