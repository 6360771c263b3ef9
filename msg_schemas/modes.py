"""Modes of a vehicle: what is wanted, and what is. One pair of signals for each flight package."""

from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, Signal, named_vector


def mode_request(vehicle: str, frame: str) -> Signal:
    """The mode that a monitor wants a vehicle's mode manager to take; ``requests`` counts, so that each is acted on
    once.
    """
    return named_vector(f"{vehicle}/mode_request", frame, {
        "mode": Quantity(None, "1", "number of the wanted mode, in the order of the manager's list"),
        "requests": Quantity(None, "1", "how many there have been; 0: none yet"),
        "cause": Quantity(None, "1", "number of the actionpoint that asked last, in the order of the scenario; -1: none"),
    }, Role.COMMAND, doc="the mode that monitors ask for")


def mode(vehicle: str, frame: str) -> Signal:
    """The mode that a vehicle is in."""
    return named_vector(f"{vehicle}/mode", frame, {
        "mode": Quantity(None, "1", "number of the mode, in the order of the manager's list"),
        "entered": Quantity(None, "s", "time at which it was entered"),
        "changes": Quantity(None, "1", "how often the mode has changed"),
        "cause": Quantity(None, "1", "-1: the start; -2: the manager itself; else the actionpoint that asked"),
    }, Role.TELEMETRY, doc="the mode that the vehicle is in")
