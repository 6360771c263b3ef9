"""Files with one mistake each: a correct controller of the rover, and what is changed in it."""

from dataclasses import dataclass
from pathlib import Path

import yaml

CORRECT = '''"""A controller under test."""

import math

import numpy as np
import scipy.linalg

import flight_math
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, Mat3, Parameters, State, Vec3, field
from flight_math import cross, kernel
from msg_schemas import cubli

GAINS = (1.0, 2.0, 3.0)
LIST = [1.0, 2.0, 3.0]


class LawParameters(Parameters):
    slope: float = field(0.3, unit="1/s", gt=0)
    weights: Vec3 = field(1.0)
    inertia: Mat3 = field((1, 0, 0, 0, 1, 0, 0, 0, 1))
    table: Array(4, 3) = field(0.0)
    square: Array(3, 3) = field(0.0)
    law: Choice("hard", "soft") = field("soft")
    note: str = field("")


class LawState(State):
    integral: Vec3
    count: int


def plain_helper(a):
    return 2.0 * a


@kernel
def doubled(a):
    return 2.0 * a


@kernel
def leaned(p, angles, rates):
    return p.slope * angles + rates


@kernel
def law(t_ns, p, x, attitude, command):
    rates = attitude.angular_velocity
    x.integral = x.integral + p.period * rates
    torque = leaned(p, x.integral, rates)
    command.effort = -torque  # here


class Law(Component):
    parameters, state = LawParameters, LawState
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND}
    kernel = law
'''


@dataclass(frozen=True)
class Mistake:
    """A change of the correct file. said: what the sentence must hold; line: text of the line that it must name."""

    name: str
    old: str
    new: str
    said: tuple
    line: str | None = None
    where: str = "Law.kernel: "

    @property
    def text(self) -> str:
        """The file with the mistake."""
        assert CORRECT.count(self.old) == 1, (self.name, CORRECT.count(self.old))
        return CORRECT.replace(self.old, self.new)

    @property
    def line_number(self) -> int:
        """The line that the sentence must name."""
        wanted = self.line or self.new.strip().splitlines()[-1]
        lines = [number for number, line in enumerate(self.text.splitlines(), 1) if wanted in line]
        assert len(lines) == 1, (self.name, wanted, lines)
        return lines[0]


def inserted(name, statement, *said, line=None, where="Law.kernel: ") -> Mistake:
    """A mistake that is a statement of the kernel's."""
    lines = "".join(f"    {part}\n" for part in statement.splitlines())
    return Mistake(name, "    command.effort = -torque  # here\n", lines, said, line, where)


def write(folder: Path, mistake: Mistake) -> tuple[Path, Path]:
    """Write the file with the mistake and a scenario that uses it; return both."""
    file = folder / "my_law.py"
    file.write_text(mistake.text)
    scenario = folder / "my_law.yaml"
    scenario.write_text(yaml.safe_dump({
        "name": "my_law", "title": "a law under test", "duration_s": 0.1, "seed": 1, "components": {
            "plant": {"use": "sim_nodes/cubli_plant"}, "imu": {"use": "sim_nodes/imu"},
            "star_tracker": {"use": "sim_nodes/star_tracker"}, "estimator": {"use": "cubli_ros/attitude_estimator"},
            "controller": {"use": "my_law.py:Law"}}}))
    return file, scenario
