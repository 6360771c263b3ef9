"""Equations (32)-(38) as printed, on closed loops: one function a row of the claims table.

Source: Aerospace 2023, 10(8), 679, section 3. Each closes the loop at random states of random robots and differentiates
what the paper differentiates along the motion, by complex steps. For (32)-(37) Theta has attitude and joints, the
paper's own; from (38) on it has the base's position too, so that the dynamics are linear in pi, as (29) takes them to be.
The arguments and answers are those of `papers.spacerobot.equations`.
"""

from dataclasses import dataclass, replace

import numpy as np

from papers.spacerobot.equations import EXACT, JOINTS, STATES, agree
from papers.spacerobot.inertial_frame import Arm, random_arm
from papers.spacerobot.lagrangian import STEP, coriolis_matrix, mass_matrix, reduced_mass_matrix


@dataclass(frozen=True)
class Loop:
    """A robot at coordinates q (6+n,) with rates of Theta; error = Theta_d - Theta, its rate, the desired acceleration;
    Lambda and K_D (size, size)."""

    arm: Arm
    q: np.ndarray
    rate: np.ndarray
    error: np.ndarray
    error_rate: np.ndarray
    desired_second: np.ndarray
    weight: np.ndarray
    damping: np.ndarray

    @property
    def size(self) -> int:
        return len(self.rate)

    @property
    def sigma(self) -> np.ndarray:
        """(33)."""
        return self.error_rate + self.weight @ self.error

    @property
    def reference_rate(self) -> np.ndarray:
        """(32)."""
        return self.rate + self.sigma

    @property
    def reference_second(self) -> np.ndarray:
        """(32)."""
        return self.desired_second + self.weight @ self.error_rate

    def matrix(self, q, pi=None) -> np.ndarray:
        """M(Theta)."""
        return (reduced_mass_matrix if self.size < len(q) else mass_matrix)(self.arm, q, pi)

    def coriolis(self, rate=None, pi=None) -> np.ndarray:
        """D(Theta, rate), by Christoffel symbols."""
        return coriolis_matrix(lambda q: self.matrix(q, pi), self.q, self.rate if rate is None else rate)

    def reference_torque(self, pi=None, rate=None) -> np.ndarray:
        """M Theta_r_ddot + D Theta_r_dot; ``rate``: the one that D is taken at, the actual one if none is given."""
        return self.matrix(self.q, pi) @ self.reference_second + self.coriolis(rate, pi) @ self.reference_rate

    def second(self, torque) -> np.ndarray:
        """Theta_ddot under a torque, by (28)."""
        return np.linalg.solve(self.matrix(self.q), torque - self.coriolis() @ self.rate)

    def along(self, function, second):
        """Rate of function(q, error, sigma) along the motion with this Theta_ddot."""
        step = 1j * STEP
        rate = np.concatenate([np.zeros(len(self.q) - self.size), self.rate])
        sigma_rate = self.reference_second - second
        return np.imag(function(self.q + step * rate, self.error + step * self.error_rate,
                                self.sigma + step * sigma_rate)) / STEP


def loops(whole: bool = False, count: int = STATES):
    """Random closed loops with diagonal gains; ``whole``: Theta has the base's position too."""
    draw = np.random.default_rng(38)
    size = (6 if whole else 3) + JOINTS
    for _ in range(count):
        q = np.concatenate([np.zeros(3), draw.uniform(-1.2, 1.2, 3 + JOINTS)])
        gains = np.exp(draw.uniform(-1.0, 1.0, (2, size)))
        yield Loop(random_arm(draw, JOINTS), q, *draw.standard_normal((4, size)), np.diag(gains[0]), np.diag(gains[1]))


def beside(printed, true, size):
    """A pair of numbers, with the size that their difference is judged by."""
    return np.array([printed, size]), np.array([true, size])


def reference_error(sign: float = 1.0):
    """(33): sigma = Theta_r_dot - Theta_dot is also the error's rate + Lambda error. sign: of error = Theta_d - Theta."""
    return agree((sign * loop.error_rate + sign * loop.weight @ loop.error,
                  (loop.rate + loop.error_rate) + loop.weight @ loop.error - loop.rate) for loop in loops())


def closed_loop(corrected: bool = False):
    """(34): M sigma_ddot + D sigma_dot + K_D sigma = 0 under (31). Corrected: one derivative less."""
    pairs = []
    for loop in loops():
        sigma_rate = _sigma_rate(loop)
        if corrected:
            terms = loop.matrix(loop.q) @ sigma_rate, loop.coriolis() @ loop.sigma
        else:
            terms = loop.matrix(loop.q) @ _sigma_second(loop), loop.coriolis() @ sigma_rate
        pairs.append((terms[0] + terms[1], -loop.damping @ loop.sigma))
    return agree(pairs)


def _sigma_rate(loop):
    """d sigma / dt under (31)."""
    return loop.reference_second - loop.second(loop.reference_torque() + loop.damping @ loop.sigma)


def _sigma_second(loop, step=1e-5):
    """d2 sigma / dt2, by a central difference along the motion; the desired acceleration is constant."""
    second = loop.second(loop.reference_torque() + loop.damping @ loop.sigma)
    rate = np.concatenate([np.zeros(len(loop.q) - loop.size), loop.rate])

    def moved(h):
        return replace(loop, q=loop.q + h * rate, rate=loop.rate + h * second, error=loop.error + h * loop.error_rate,
                       error_rate=loop.error_rate + h * (loop.desired_second - second))
    return (_sigma_rate(moved(step)) - _sigma_rate(moved(-step))) / (2.0 * step)


def _energy(loop, share):
    """V of (35): 1/2 sigma^T M sigma + 1/2 error^T ``share`` error, as a function for `Loop.along`."""
    return lambda q, error, sigma: 0.5 * sigma @ loop.matrix(q) @ sigma + 0.5 * error @ share @ error


def rate_of_v(loop, share, torque=None):
    """dV/dt along the motion under (31), or another torque; ``share``: W."""
    torque = loop.reference_torque() + loop.damping @ loop.sigma if torque is None else torque
    return loop.along(_energy(loop, share), loop.second(torque))


def lyapunov_rate(corrected: bool = False):
    """(36), first line: dV/dt by its terms. Corrected: M_dot where M stands in the second."""
    pairs = []
    for loop in loops():
        share = 2.0 * loop.weight @ loop.damping
        sigma, matrix = loop.sigma, loop.matrix(loop.q)
        change = loop.along(lambda q, error, s, loop=loop: loop.matrix(q), np.zeros(loop.size)) if corrected else matrix
        printed = sigma @ matrix @ _sigma_rate(loop) + 0.5 * sigma @ change @ sigma + loop.error @ share @ loop.error_rate
        pairs.append(beside(printed, rate_of_v(loop, share), sigma @ loop.damping @ sigma))
    return agree(pairs)


def lyapunov_rate_simplified(skew: bool = True):
    """(36), second line: dV/dt = -sigma^T K_D sigma + error^T W error_rate. skew: D is the one with M_dot - 2 D skew."""
    pairs = []
    for loop in loops():
        share = 2.0 * loop.weight @ loop.damping
        drive = loop.reference_torque() if skew else _other_coriolis(loop)
        power = loop.sigma @ loop.damping @ loop.sigma
        printed = -power + loop.error @ share @ loop.error_rate
        pairs.append(beside(printed, rate_of_v(loop, share, drive + loop.damping @ loop.sigma), power))
    return agree(pairs)


def _other_coriolis(loop):
    """M Theta_r_ddot + D' Theta_r_dot with a D' that gives the same D' Theta_dot, but no skew M_dot - 2 D'."""
    velocity = loop.coriolis() @ loop.rate
    other = np.outer(velocity, loop.rate) / (loop.rate @ loop.rate)
    return loop.matrix(loop.q) @ loop.reference_second + other @ loop.reference_rate


def weight_is_symmetric(multiple: bool = False):
    """Below (35): W = 2 Lambda K_D is symmetric, for diagonal gains and for any. multiple: Lambda a multiple of E."""
    draw, found = np.random.default_rng(35), {"diagonal gains": [], "any positive definite gains": []}
    for loop in loops():
        one, two = draw.standard_normal((2, loop.size, loop.size))
        full = np.eye(loop.size) if multiple else one @ one.T + np.eye(loop.size)
        for name, share in zip(found, (loop.weight @ loop.damping, full @ (two @ two.T + np.eye(loop.size)))):
            found[name].append(np.abs(share - share.T).max() / np.abs(share).max())
    return {name: (bool(max(errors) < EXACT), f"asymmetry {max(errors):.1e}") for name, errors in found.items()}


def lyapunov_rate_chosen(corrected: bool = False):
    """(37): dV/dt for W = 2 Lambda K_D. Corrected: the last term has Lambda K_D Lambda."""
    pairs = []
    for loop in loops():
        last = loop.weight @ loop.damping @ (loop.weight if corrected else np.eye(loop.size))
        kept = loop.error_rate @ loop.damping @ loop.error_rate
        true = rate_of_v(loop, 2.0 * loop.weight @ loop.damping)
        pairs.append(beside(-kept - loop.error @ last @ loop.error, true, kept))
    return agree(pairs)


def lyapunov_rate_is_negative(factor: float = 1.0):
    """Below (37): dV/dt is zero at rest on the target alone, negative elsewhere. factor: of W = 2 Lambda K_D."""
    worst = max(float(np.linalg.eigvalsh(_quadratic_form(_rate_of_errors(loop, factor), 2 * loop.size)).max())
                for loop in loops(count=2))
    return worst < 0.0, f"largest eigenvalue of dV/dt as a form in error and sigma: {worst:.2g}"


def _rate_of_errors(loop, factor):
    """dV/dt as a function of [error, sigma] (2 size,), where the loop is and moves."""
    share = 2.0 * factor * loop.weight @ loop.damping
    inertia, coriolis = loop.matrix(loop.q), loop.coriolis()

    def rate(x):
        error, sigma = x[:loop.size], x[loop.size:]
        moved = replace(loop, error=error, error_rate=sigma - loop.weight @ error)
        torque = inertia @ moved.reference_second + coriolis @ moved.reference_rate + loop.damping @ sigma
        return moved.along(_energy(moved, share), np.linalg.solve(inertia, torque - coriolis @ loop.rate))
    return rate


def _quadratic_form(function, size):
    """Symmetric matrix of a quadratic form, by its values at unit vectors and their sums."""
    one = np.eye(size)
    alone = np.array([function(vector) for vector in one])
    form = np.diag(alone)
    for i in range(size):
        for j in range(i):
            form[i, j] = form[j, i] = 0.5 * (function(one[i] + one[j]) - alone[i] - alone[j])
    return form


def control_regressor(corrected: bool = False):
    """(38): with Y(Theta, Theta_r_dot, Theta_r_ddot), D at the reference rate, dV/dt is (36). Corrected: at the actual."""
    pairs = []
    for loop in loops(whole=True):
        share = 2.0 * loop.weight @ loop.damping
        power = loop.sigma @ loop.damping @ loop.sigma
        drive = loop.reference_torque(rate=None if corrected else loop.reference_rate)
        true = rate_of_v(loop, share, drive + loop.damping @ loop.sigma)
        pairs.append(beside(-power + loop.error @ share @ loop.error_rate, true, power))
    return agree(pairs)
