"""The robot and the parameters believed of it, as component parameters.

A scenario names a model and how wrong the knowledge of it is; `resolve` works that out to numbers before the run, so
that a bag carries the tree and all parameters and needs no file.
"""

import numpy as np

from flight_graph.components.records import Array, Choice, Integers, Parameters, field
from flight_graph.errors import FlightError
from flight_math import uncompiled
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.inertial_parameters import prior
from spacerobot_ros.natural_adaptation import project
from spacerobot_ros.robot_files import find_model

NO_LIMIT = 1e9  # [-] in place of an infinite limit


def robot_parameters(joints: int) -> type[Parameters]:
    """Parameters of a component that needs the tree of a robot with this many joints."""

    class RobotParameters(Parameters):
        model: str = field("mini_space_robot", doc="a robot of the package, or a YAML or URDF file; empty: the numbers "
                                                   "below")
        parent: Integers(joints) = field(0, ge=0, doc="body that carries each joint; 0 is the base")
        fixed_rotation: Array(joints, 9) = field(0.0, unit="1", doc="axes of each body in its parent's at angle zero")
        offset: Array(joints, 3) = field(0.0, unit="m", doc="origin of each body in its parent's axes")
        axis: Array(joints, 3) = field(0.0, unit="1", doc="axis of each joint in its body's axes")

    return RobotParameters


def believed_parameters(joints: int) -> type[Parameters]:
    """Parameters of a component that starts from a prior of the inertial parameters, eq. (46)."""

    class BelievedParameters(robot_parameters(joints)):
        pi: Array(10 * (joints + 1)) = field(0.0, unit="SI", doc="inertial parameters of the model")
        prior_source: Choice("drawn", "given") = field("drawn", doc="drawn about the model's parameters, or as given")
        prior_eta: float = field(0.0, unit="1", ge=0, source="eq. (46)", used_if={"prior_source": ["drawn"]},
                                 doc="relative error; 0: the model's own")
        prior_seed: int = field(5, ge=0, used_if={"prior_source": ["drawn"]}, doc="of the draw")
        prior_reading: Choice("standard_deviation", "variance") = field(
            "standard_deviation", source="eq. (46)", doc="what eta pi / 3 is: as the text says, or the variance")
        prior_projected: bool = field(False, doc="make every body of the prior possible")
        prior: Array(10 * (joints + 1)) = field(0.0, unit="SI", doc="parameters believed at the start")

    return BelievedParameters


def resolve_robot(values: dict, where: str, folder=None) -> dict:
    """Fill in the tree (and ``pi``, ``lower``, ``upper`` where the component has them) from ``model``."""
    if not values["model"]:
        return values
    robot = _robot(values["model"], where, folder)
    joints = len(values["parent"])
    if robot.joints != joints:
        raise FlightError(f"{where}.model: '{robot.name}' has {robot.joints} joints; this component is built "
                          f"for {joints}")
    found = {"parent": robot.parent, "fixed_rotation": robot.fixed_rotation.reshape(joints, 9),
             "offset": robot.offset, "axis": robot.axis, "pi": robot.pi, "lower": robot.lower, "upper": robot.upper}
    for name, limit in (("lower", -NO_LIMIT), ("upper", NO_LIMIT)):
        found[name] = np.where(np.isfinite(found[name]), found[name], limit)
    return {**values, "model": "", **{name: value.tolist() for name, value in found.items() if name in values}}


def resolve_prior(values: dict, where: str, folder=None) -> dict:
    """As `resolve_robot`, and the prior of eq. (46)."""
    values = resolve_robot(values, where, folder)
    if values["prior_source"] == "given":
        return values
    believed = prior(values["pi"], values["prior_eta"], values["prior_seed"], values["prior_reading"])
    if values["prior_projected"]:
        uncompiled(project)(believed, 0.02)
    return {**values, "prior": believed.tolist()}


def resolve_covariance(values: dict) -> dict:
    """Fill in the diagonal of G0."""
    if values["covariance"] == "given":
        return values
    diagonal = rls.initial_covariance(values["prior"], values["covariance"], values["covariance_scale"] or None,
                                      values["covariance_eta"], values["torque_noise"])
    return {**values, "covariance_diagonal": diagonal.tolist()}


def _robot(name, where, folder):
    try:
        return find_model(name, folder)
    except FlightError as error:
        raise FlightError(f"{where}.model: {error}") from None
