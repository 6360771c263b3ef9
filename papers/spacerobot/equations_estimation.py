"""Equations (39)-(41) and (46) as printed, and what a motion can show of the parameters: one function a row of the table.

Source: Aerospace 2023, 10(8), 679, sections 3.2.1, 4.1, 4.3. The answers are those of `papers.spacerobot.equations`.
"""

import numpy as np

from papers.spacerobot.equations import agree
from papers.spacerobot.inertial_frame import Arm, bodies, floating, momenta, random_arm, random_motion, tensor
from spacerobot_ros.inertial_parameters import prior
from spacerobot_ros.robot_files import find_model


def recursion(noise: float = 1.0):
    """(39)-(41) give what all measurements at once give: the least squares of torques and prior.

    noise: what stands for E in (40); the torques of all measurements at once weigh one."""
    draw, rows, count = np.random.default_rng(39), 7, 20
    true, pi = draw.standard_normal((2, count))
    spread = draw.standard_normal((count, count))
    g = spread @ spread.T + np.eye(count)
    normal, right = np.linalg.inv(g), np.linalg.solve(g, pi)
    for _ in range(30):
        y = draw.standard_normal((rows, count))
        tau = y @ true + 0.1 * draw.standard_normal(rows)
        gain = g @ y.T @ np.linalg.inv(y @ g @ y.T + noise * np.eye(rows))
        pi, g = pi + gain @ (tau - y @ pi), (np.eye(count) - gain @ y) @ g
        normal, right = normal + y.T @ y, right + y.T @ tau
    return agree([(pi, np.linalg.solve(normal, right)), (g, np.linalg.inv(normal))])


def _priors(eta, reading, seeds=200):
    robot = find_model("mini_space_robot")
    return robot.pi, np.array([prior(robot.pi, eta, seed, reading) for seed in range(seeds)])


def three_deviations(reading: str = "standard_deviation"):
    """(46): eta is three standard deviations, so 99.7 % of the draws are within eta of the true parameter (eta 20 %)."""
    true, drawn = _priors(0.2, reading)
    inside = float((np.abs(drawn - true) <= 0.2 * np.abs(true)).mean())
    return abs(inside - 0.9973) < 0.002, f"{100.0 * inside:.2f} % of 200 draws of 50 parameters within 20 %"


def is_possible(pi) -> bool:
    """Whether a body of positive masses has these ten parameters: I about the centre of mass, triangle inequality."""
    mass, c = pi[9], pi[6:9] / pi[9]
    principal = np.linalg.eigvalsh(tensor(pi[:6]) - mass * (c @ c * np.eye(3) - np.outer(c, c)))
    return bool(mass > 0.0 and principal[0] > 0.0 and principal[2] < principal[0] + principal[1])


def priors_are_possible(eta: float = 0.1):
    """Every prior of (46) is a robot that can be built."""
    _, drawn = _priors(eta, "standard_deviation")
    found = sum(all(map(is_possible, one.reshape(-1, 10))) for one in drawn)
    return found == len(drawn), f"{found} of {len(drawn)} priors at eta {100.0 * eta:g} %"


def regressor(arm: Arm, motion) -> np.ndarray:
    """Force and moment on the base and joint torques (6+n, 10(n+1)) of each parameter, by the rates of momentum."""
    placed = bodies(arm, motion)
    found = np.zeros((5 + len(placed), 10 * len(placed)))
    base = placed[0][0].value.T
    for b, body in enumerate(placed):
        for k, ten in enumerate(np.eye(10)):
            part = momenta(ten, *body)
            found[0:3, 10 * b + k] = base @ part.force
            found[3:6, 10 * b + k] = base @ (part.moment - np.cross(placed[0][1].value, part.force))
            for i in range(1, b + 1):
                rotation, origin = placed[i]
                found[5 + i, 10 * b + k] = rotation.value[:, 2] @ (part.moment - np.cross(origin.value, part.force))
    return found


def rank(joints: int, rows=slice(None), floats: bool = True, count=40) -> int:
    """Number of combinations of the parameters that random motions show, free-floating or pushed by thrusters."""
    draw = np.random.default_rng(50)
    arm, stack = random_arm(draw, joints), []
    for _ in range(count):
        motion = random_motion(draw, joints)
        stack.append(regressor(arm, floating(arm, motion) if floats else motion)[rows])
    values = np.linalg.svd(np.vstack(stack), compute_uv=False)
    return int((values > 1e-10 * values[0]).sum())


def true_parameters_are_hidden(joints: int = 4, floats: bool = True):
    """No motion shows all parameters, so no method finds them from torques. joints: of the arm; floats: no thrusters."""
    found, count = rank(joints, floats=floats), 10 * (joints + 1)
    return found < count, f"{found} combinations of {count} parameters, random motions, all rows"
