"""Answers that are known in closed form, from elsewhere."""

import math

import numpy as np

A, B = 7.0, 0.1  # of the Ishigami function
# T. Ishigami and T. Homma, First International Symposium on Uncertainty Modeling and Analysis (1990) 398-403
_FIRST_A, _FIRST_B = 0.5 * (1.0 + B * math.pi**4 / 5.0) ** 2, A**2 / 8.0
_JOINT_AC = B**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
_VARIANCE = _FIRST_A + _FIRST_B + _JOINT_AC
ISHIGAMI_FIRST = (_FIRST_A / _VARIANCE, _FIRST_B / _VARIANCE, 0.0)
ISHIGAMI_TOTAL = ((_FIRST_A + _JOINT_AC) / _VARIANCE, _FIRST_B / _VARIANCE, _JOINT_AC / _VARIANCE)


def ishigami(u):
    """The function of three uniform numbers (..., 3) in (0, 1)."""
    x = math.pi * (2.0 * u - 1.0)
    return np.sin(x[..., 0]) + A * np.sin(x[..., 1]) ** 2 + B * x[..., 2] ** 4 * np.sin(x[..., 0])


def ishigami_design(u):
    """Its values on a design of Saltelli, row by row, from base samples (2, n, 3)."""
    a, b = u
    rows = [a, b]
    for j in range(3):
        mixed = a.copy()
        mixed[:, j] = b[:, j]
        rows.append(mixed)
    return ishigami(np.stack(rows, axis=1)).reshape(-1)


def spearman_of_normal(covariance):
    """Rank correlations of normal numbers: 6 / pi asin(rho / 2) (K. Pearson, 1907)."""
    deviation = np.sqrt(np.diag(covariance))
    return 6.0 / math.pi * np.arcsin(0.5 * covariance / np.outer(deviation, deviation))


def partial_rank(ranked):
    """Partial correlation of each of the first two variables with the third, from the correlations of all (3, 3)."""
    (_, ab, ay), (_, _, by), _ = ranked
    return ((ay - ab * by) / math.sqrt((1 - ab**2) * (1 - by**2)), (by - ab * ay) / math.sqrt((1 - ab**2) * (1 - ay**2)))
