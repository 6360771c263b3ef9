"""Which parameters a scenario's desired motion makes visible, before anything is flown.

The motion is the trajectory generator's, tracked ideally: base rates and joint rates are the desired ones, the base
origin accelerates as momentum demands. ``random`` stands for a free-floating motion through arbitrary states.
"""

import numpy as np

from flight_graph.components.component import kinds_of
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.scenario import Scenario
from flight_math import view
from spacerobot_ros.identifiability import (
    Identifiability,
    Samples,
    identify,
    momentum_free_acceleration,
    stack_regressors,
)
from spacerobot_ros.model import SpaceRobot
from spacerobot_ros.robot_files import find_model

ROWS = {"all": slice(None), "moments": slice(3, None), "joints": slice(6, None)}
USE = "spacerobot_ros/trajectory_generator"


def report(robot: SpaceRobot, scenario: Scenario | None, rows: str = "moments", cut: float = 1e-10,
           step: float = 0.1) -> Identifiability:
    """Identifiability of ``robot``'s parameters on the desired motion of ``scenario`` (None: random states).

    rows: all (forces, moments, joint torques), moments (without forces), joints; ``step`` [s] between samples.
    """
    if rows not in ROWS:
        raise unknown("choice of rows", rows, ROWS, "--rows")
    motion = random_motion(robot) if scenario is None else desired_motion(scenario, step)
    if motion[0].shape[1] != robot.joints:
        raise FlightError(f"the trajectory moves {motion[0].shape[1]} joints; '{robot.name}' has {robot.joints}")
    acceleration = momentum_free_acceleration(robot, motion)
    stack = stack_regressors(robot, motion, acceleration, ROWS[rows])
    return identify(stack, robot.parameter_names, robot.pi, cut)


def random_motion(robot: SpaceRobot, states: int = 400) -> Samples:
    """Arbitrary states."""
    rng = np.random.default_rng(0)
    n = robot.joints
    return Samples(rng.uniform(-np.pi, np.pi, (states, n)), *(
        rng.standard_normal((states, columns)) for columns in (3, n, 3, n)))


def desired_motion(scenario: Scenario, step: float) -> Samples:
    """The motion of the scenario's trajectory generator, sampled over its duration."""
    nodes = [node for node in scenario.graph.nodes.values() if "reference" in node.component.outputs and not
             node.component.inputs]
    if len(nodes) != 1:
        raise FlightError(f"{scenario.origin}: it has no trajectory generator ({USE})")
    component, values = nodes[0].component, nodes[0].values
    parameters, state = component.parameters.record(values), component.state.record()
    _, reference = component.outputs["reference"].new()
    records = view(parameters[0], component.parameters.kinds), view(state[0], component.state.kinds)
    desired = view(reference[0], kinds_of(component.outputs["reference"]))
    if component.start is not None:
        component.start(*records)
    samples = []
    step_ns = int(round(step * 1e9))
    for t_ns in range(0, scenario.duration_ns + 1, step_ns):
        component.kernel(t_ns, *records, desired)
        samples.append(reference.copy())
    motion = np.concatenate(samples)
    return Samples(*(np.ascontiguousarray(motion[name]) for name in (
        "joints", "rates", "joint_rates", "angular_acceleration", "joint_accelerations")))


def robot_named(name: str) -> SpaceRobot:
    """``spacerobot`` (the shipped one), a model's name, or a YAML or URDF file."""
    return find_model("mini_space_robot" if name == "spacerobot" else name)
