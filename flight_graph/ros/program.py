"""The life of a program that is a node of its own beside the components: recorder, stand-in, simulation."""

import signal
import threading

import rclpy
from rclpy.signals import SignalHandlerOptions

from flight_graph.errors import FlightError
from flight_graph.ros import leaving
from flight_graph.ros.entry import tell_errors
from flight_graph.ros.environment import prepare_environment
from flight_graph.ros.managed import Stopped


def main(what: str, run, arguments: list[str], announce=None) -> int:
    """The executable of a program: run it, then end this process. Returns where only help was wanted.

    what: its help; run: see `run`, called with the arguments and what announces.
    """
    if "-h" in arguments or "--help" in arguments:
        print(what)
        return 0
    prepare_environment()
    leaving.at_once()
    leaving.keep_imports()
    leaving.leave(run(arguments, announce or tell_errors))


def run(name: str, live, arguments: list[str], announce) -> int:
    """Run a program until it is done or asked to end; return the exit status.

    live: does all between the start of the middleware and its end, called with the event that is set when the program is
    asked to end, and with ``announce``.
    """
    stopping = threading.Event()
    for number in leaving.SIGNALS:
        signal.signal(number, lambda *_: stopping.set())
    rclpy.init(args=[name, *arguments], signal_handler_options=SignalHandlerOptions.NO)
    try:
        live(stopping, announce)
        return 0
    except Stopped:
        return 0
    except (FlightError, OSError) as error:
        announce({"error": str(error)})
        return 1
    finally:
        rclpy.try_shutdown()


def linger(node, stopping: threading.Event) -> None:
    """Stay until asked to end, where the node's settings say so: who started it wants its words until then."""
    while node.settings.linger and not stopping.is_set():
        stopping.wait(0.05)
