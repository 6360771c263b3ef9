"""What a component's docstring says of it: a summary, what it promises, and what it does on bad input.

    class Imu(Component):
        \"\"\"Gyro and accelerometer of the Cubli rover.

        Promises: angular velocity [rad/s] and specific force [m/s^2] at the cube's centre, body frame, ...

        Bad input: ...
        \"\"\"

A promise is what a reader of the outputs may count on, with units and frames. Bad input is what is done about messages that
are missing, late, wrong or not finite.
"""

import inspect
import sys
from dataclasses import dataclass

from flight_graph.components.component import Component

PROMISES, BAD_INPUT = "Promises:", "Bad input:"


@dataclass(frozen=True)
class Described:
    """The parts, as text without line ends; "" where the docstring has none."""

    summary: str
    promises: str
    bad_input: str


def described(component: type[Component]) -> Described:
    """The parts of a component's docstring."""
    text = inspect.cleandoc(component.__doc__ or sys.modules[component.__module__].__doc__ or "")
    paragraphs = [" ".join(part.split()) for part in text.split("\n\n")]
    found = {label: next((part.removeprefix(label).strip() for part in paragraphs if part.startswith(label)), "")
             for label in (PROMISES, BAD_INPUT)}
    return Described(paragraphs[0], found[PROMISES], found[BAD_INPUT])
