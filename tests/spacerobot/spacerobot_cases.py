"""Random robots and states for the space robot's tests, and the same robot as a Pinocchio model."""

from typing import NamedTuple

import numpy as np

from flight_math import Vec3
from sim_nodes.spacerobot.dynamics import forward_dynamics
from spacerobot_ros.dynamics import inverse_dynamics, mass_matrix, reduced_mass_matrix
from spacerobot_ros.kinematics import Motion, posed
from spacerobot_ros.model import model_from_mapping
from spacerobot_ros.regressor import regressor

PAPER_COLUMNS = [4, 5, 7, 6, 8, 9, 1, 2, 3, 0]  # Pinocchio: m, h, Ixx, Ixy, Iyy, Ixz, Iyz, Izz


def random_body(rng, name):
    spread = rng.standard_normal((3, 3))
    second_moment = spread @ spread.T * 0.1 + 0.02 * np.eye(3)
    mass = rng.uniform(0.5, 20.0)
    inertia = mass * (np.trace(second_moment) * np.eye(3) - second_moment)
    keys = ("xx", "xy", "xz", "yy", "yz", "zz")
    return {
        "name": name,
        "mass": mass,
        "center_of_mass": (0.3 * rng.standard_normal(3)).tolist(),
        "inertia": dict(zip(keys, inertia[np.triu_indices(3)].tolist(), strict=True)),
    }


def random_mapping(rng, joints):
    """A robot file's content: ``joints`` joints with random axes, each on a random earlier body."""
    names = ["base"] + [f"link_{k + 1}" for k in range(joints)]
    return {
        "name": "random",
        "base": random_body(rng, "base"),
        "joints": [
            {
                "name": f"joint_{k + 1}",
                "parent": names[rng.integers(0, k + 1)],
                "origin": {"xyz": rng.standard_normal(3).tolist(), "rpy": rng.uniform(-3, 3, 3).tolist()},
                "axis": rng.standard_normal(3).tolist(),
                "body": random_body(rng, names[k + 1]),
            }
            for k in range(joints)
        ],
    }


def random_robot(rng, joints):
    return model_from_mapping(random_mapping(rng, joints))


class Signals:
    """A random motion of ``robot``: theta, w, thd, al, a, thdd."""

    def __init__(self, rng, robot, size=1.0):
        n = robot.joints
        self.theta = rng.uniform(-np.pi, np.pi, n)
        self.w, self.al, self.a, self.v = size * rng.standard_normal((4, 3))
        self.thd, self.thdd = size * rng.standard_normal((2, n))


def tree_at(robot, theta):
    return posed(robot.geometry, np.asarray(theta, float), np.zeros((robot.joints, 3, 3)))


def motion(w, w_r, al_r, a_r, thd, thd_r, thdd_r):
    """A `Motion` of arrays."""
    return Motion(Vec3(*w), Vec3(*w_r), Vec3(*al_r), Vec3(*a_r), thd, thd_r, thdd_r)


def regress(robot, theta, *signals):
    """Regressor of the signals of `motion`."""
    n = robot.joints
    y = np.full((6 + n, 10 * (n + 1)), np.nan)
    regressor(tree_at(robot, theta), motion(*signals), y)
    return y


def inverse(robot, theta, *signals, pi=None):
    """Inverse dynamics of the signals of `motion`."""
    wrench = np.full(6 + robot.joints, np.nan)
    inverse_dynamics(tree_at(robot, theta), robot.pi if pi is None else pi, motion(*signals), wrench)
    return wrench


def forward(robot, theta, w, thd, wrench):
    """Accelerations (6+n,) under a wrench."""
    acceleration = np.full(6 + robot.joints, np.nan)
    forward_dynamics(tree_at(robot, theta), robot.pi, Vec3(*w), np.asarray(thd, float), wrench, acceleration)
    return acceleration


def inertia_matrices(robot, theta):
    """Full (6+n) and reduced (3+n) mass matrix."""
    n = robot.joints
    h, reduced = np.full((6 + n, 6 + n), np.nan), np.full((3 + n, 3 + n), np.nan)
    mass_matrix(tree_at(robot, theta), robot.pi, h)
    reduced_mass_matrix(h, reduced)
    return h, reduced


class Plant(NamedTuple):
    """What the plant's kernels read of its parameters."""

    parent: np.ndarray
    fixed_rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    stop_stiffness: float
    stop_damping: float


def plant_of(robot, lower=None, upper=None, stiffness=0.0, damping=0.0):
    """The robot with its joints free, or with stops."""
    n = robot.joints
    return Plant(*robot.geometry, np.full(n, -np.inf) if lower is None else lower,
                 np.full(n, np.inf) if upper is None else upper, stiffness, damping)


def relative(got, expected):
    return np.abs(got - expected).max() / np.abs(expected).max()


class PinocchioTwin:
    """The same tree as a Pinocchio model without gravity, joint by joint.

    Pinocchio numbers joints depth first (its composite-body algorithm needs it): ``order`` (n,) lists our joints in
    that order, ``rows`` (6+n,) puts Pinocchio's generalised vector into ours, ``columns`` its regressor's columns.
    """

    def __init__(self, pin, robot):
        self.model = pin.Model()
        self.model.gravity = pin.Motion.Zero()
        ids = {0: self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")}
        self.model.appendBodyToJoint(ids[0], _inertia(pin, robot.pi[:10]), pin.SE3.Identity())
        self.order = []

        def add_children(body):
            for i in np.flatnonzero(robot.parent == body):
                placement = pin.SE3(robot.fixed_rotation[i], robot.offset[i])
                kind = pin.JointModelRevoluteUnaligned(*robot.axis[i])
                ids[i + 1] = self.model.addJoint(ids[body], kind, placement, robot.joint_names[i])
                inertia = _inertia(pin, robot.pi[10 * (i + 1) : 10 * (i + 2)])
                self.model.appendBodyToJoint(ids[i + 1], inertia, pin.SE3.Identity())
                self.order.append(i)
                add_children(i + 1)

        add_children(0)
        self.data = self.model.createData()
        position = np.argsort(self.order)
        self.rows = np.concatenate([np.arange(6), 6 + position]).astype(int)
        bodies = np.concatenate([[0], 1 + position]).astype(int)
        self.columns = np.concatenate([10 * b + np.array(PAPER_COLUMNS) for b in bodies])

    def state(self, s):
        """q, v, a of the free flyer: velocity in body axes, spatial acceleration a - w x v."""
        q = np.concatenate([np.zeros(3), [0, 0, 0, 1.0], s.theta[self.order]])
        v = np.concatenate([s.v, s.w, s.thd[self.order]])
        a = np.concatenate([s.a - np.cross(s.w, s.v), s.al, s.thdd[self.order]])
        return q, v, a

    def back(self, wrench):
        """A wrench of ours in Pinocchio's order."""
        return np.concatenate([wrench[:6], wrench[6:][self.order]])


def _inertia(pin, pi):
    xx, xy, xz, yy, yz, zz, hx, hy, hz, m = pi
    c = np.array([hx, hy, hz]) / m
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pin.Inertia(m, c, about_origin - m * (c @ c * np.eye(3) - np.outer(c, c)))

