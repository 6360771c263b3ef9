"""What Appendix B prints, line by line, on random states: one function a row of the claims table.

Ours is the reading of the notation: a + eps c of two vectors, (a + eps c) x (p + eps l) = a x p + eps (a x l + c x p),
(a + eps c) o (p + eps l) = a.p + c.l, [a + eps c]^s = c + eps a, M (a + eps c) = m c + eps J a, P and Q the scalings
(p, p_eps) and (q, q_eps) of the two parts. Each function returns (holds, what was found), or several of them by label.
Arguments change what is printed; their defaults change nothing.
"""

from typing import NamedTuple

import numpy as np
from numpy import cross

EXACT = 1e-12  # [1] of the terms


class State(NamedTuple):
    """Weights, inertia and the motors of a random state; alpha, beta, zeta, eta as in Appendix B."""

    p: float
    p_eps: float
    q: float
    q_eps: float
    m: float
    j: np.ndarray
    w: np.ndarray
    alpha: np.ndarray
    zeta: np.ndarray
    eta: np.ndarray

    @property
    def beta(self):
        return self.alpha + self.eta

    @property
    def w_bi(self):
        return self.w + self.zeta


def states(equal=False) -> list[State]:
    """200 random states; equal: with p_eps q = p q_eps."""
    random, found = np.random.default_rng(2427), []
    for _ in range(200):
        w, alpha, zeta, eta = random.normal(size=(4, 3))
        root = random.normal(size=(3, 3))
        p, p_eps, q, q_eps, m = random.uniform(0.5, 2.0, 5)
        found.append(State(p, p_eps, q, p_eps * q / p if equal else q_eps, m, root @ root.T, w, alpha, zeta, eta))
    return found


def times(a, b):
    """The cross product of dual vectors."""
    return cross(a[0], b[0]), cross(a[0], b[1]) + cross(a[1], b[0])


def circle(a, b):
    """The product o of dual vectors."""
    return a[0] @ b[0] + a[1] @ b[1]


def inertia(s, a):
    """M a."""
    return s.m * a[1], s.j @ a[0]


def weighted(s):
    """Q^T [P V]^s of the first lines, with V = w + eps alpha."""
    swapped = s.p_eps * s.alpha, s.p * s.w
    return s.q * swapped[0], s.q_eps * swapped[1]


def first_line_1(s):
    """V1' as it stands before the reduction."""
    return circle(weighted(s), times((s.w, s.alpha), inertia(s, (s.w_bi, s.beta))))


def first_line_2(s):
    """V2' as it stands before the reduction."""
    site, motor = (s.zeta, s.eta), (s.w, s.alpha)
    bracket, rest = times(site, inertia(s, motor)), inertia(s, times(motor, site))
    return circle(weighted(s), (bracket[0] - rest[0], bracket[1] - rest[1]))


def lines_1(s, last_term=1.0):
    """The four reduced lines of V1'; last_term: a factor of the last term of the last one."""
    k_a, k_w = s.p_eps * s.q, s.p * s.q_eps
    front = k_a * s.alpha, k_w * s.w
    moment = cross(s.w, s.j @ s.w_bi) + s.m * cross(s.alpha, s.beta)
    return [circle(front, times((s.w, s.alpha), (s.m * s.beta, s.j @ s.w_bi))),
            circle(front, (s.m * cross(s.w, s.beta), moment)),
            s.m * k_a * s.alpha @ cross(s.w, s.beta) + k_w * s.w @ moment,
            s.m * k_a * s.alpha @ cross(s.w, s.beta) + last_term * s.m * k_w * s.w @ cross(s.alpha, s.beta)]


def lines_2(s, last_term=1.0):
    """The three reduced lines of V2'; last_term: a factor of the last term of the last one."""
    k_a, k_w = s.p_eps * s.q, s.p * s.q_eps
    moment = cross(s.zeta, s.j @ s.w) + s.m * cross(s.eta, s.alpha)
    force = cross(s.w, s.eta) + cross(s.alpha, s.zeta)
    spin = s.j @ cross(s.w, s.zeta)
    return [circle((k_a * s.alpha, k_w * s.w), (s.m * cross(s.zeta, s.alpha) - s.m * force, moment - spin)),
            s.m * k_a * s.alpha @ cross(s.zeta, s.alpha) + k_w * s.w @ moment - s.m * k_a * s.alpha @ force
            - k_w * s.w @ spin,
            k_w * s.w @ cross(s.zeta, s.j @ s.w) - s.m * k_w * s.w @ cross(s.alpha, s.eta)
            - s.m * k_a * s.alpha @ cross(s.w, s.eta) - last_term * k_w * s.w @ spin]


def size(s):
    """What the terms of a state are as large as."""
    norm = np.linalg.norm
    return 1.0 + s.m * norm(s.alpha) * norm(s.beta) + norm(s.j) * norm(s.w_bi) ** 2


def told(error):
    return bool(error < EXACT), f"largest difference {error:.1e} of the terms, 200 random states and weights"


def reduction(first, lines):
    """Each printed line of a reduction against the expression that it begins with."""
    found = [max(abs(line - first(s)) / size(s) for s, line in pairs)
             for pairs in zip(*[[(s, line) for line in lines(s)] for s in states()])]
    return {f"line {number}": told(error) for number, error in enumerate(found, 2)}


def reduction_1(last_term=1.0):
    """Appendix B: the lines of V1'."""
    return reduction(first_line_1, lambda s: lines_1(s, last_term))


def reduction_2(last_term=1.0):
    """Appendix B: the lines of V2'."""
    return reduction(first_line_2, lambda s: lines_2(s, last_term))


def power_cancels(asymmetry=0.0):
    """V1' + V2' = 0 of the last lines, for any weights; asymmetry: of the inertia."""
    skew = asymmetry * np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    moved = [s._replace(j=s.j + skew) for s in states()]
    return told(max(abs(lines_1(s)[-1] + lines_2(s)[-1]) / size(s) for s in moved))


def power_vanishes_alone(equal=False):
    """V1' = 0 and V2' = 0, each for itself; equal: where p_eps q = p q_eps."""
    return {name: told(max(abs(lines(s)[-1]) / size(s) for s in states(equal)))
            for name, lines in (("V1'", lines_1), ("V2'", lines_2))}
