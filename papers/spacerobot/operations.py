"""Operations of one update (Table 2), counted: the printed formulas run on numbers that count what is done to them.

Times are a machine's and a program's; the counts are the formulas'. The regressor, which both methods need, is left out.
"""

import numpy as np

PERIOD = 0.25  # [s] shortest control period of section 4.3


class Counted:
    """A number that counts the operations on all numbers of its ``tally``: {"+": .., "*": .., "/": ..}."""

    def __init__(self, value, tally):
        self.value, self.tally = float(value), tally

    def _made(self, kind, value):
        self.tally[kind] += 1
        return Counted(value, self.tally)

    def __add__(self, other):
        return self._made("+", self.value + other.value)

    def __sub__(self, other):
        return self._made("+", self.value - other.value)

    def __mul__(self, other):
        return self._made("*", self.value * other.value)

    def __truediv__(self, other):
        return self._made("/", self.value / other.value)


def counted(array, tally) -> np.ndarray:
    """An array of counting numbers."""
    return np.vectorize(lambda value: Counted(value, tally), otypes=[object])(np.asarray(array, float))


def values(array) -> np.ndarray:
    """What the numbers are."""
    return np.vectorize(lambda one: one.value, otypes=[float])(array)


def product(a, b) -> np.ndarray:
    """a (m, n) times b (n, k): m n k multiplications and m (n - 1) k additions."""
    found = np.empty((a.shape[0], b.shape[1]), object)
    for i in range(a.shape[0]):
        for k in range(b.shape[1]):
            total = a[i, 0] * b[0, k]
            for j in range(1, a.shape[1]):
                total = total + a[i, j] * b[j, k]
            found[i, k] = total
    return found


def inverse(a, tally) -> np.ndarray:
    """Inverse (n, n) by Gauss and Jordan, without pivoting (a is positive definite)."""
    size = len(a)
    wide = np.concatenate([a, counted(np.eye(size), tally)], axis=1)
    for k in range(size):
        pivot = wide[k, k]
        wide[k] = [one / pivot for one in wide[k]]
        for i in range(size):
            if i != k:
                factor = wide[i, k]
                wide[i] = [mine - factor * other for mine, other in zip(wide[i], wide[k])]
    return wide[:, size:]


def least_squares_update(y, tau, pi, g):
    """(39)-(41) as printed: (pi, G, tally) of y (rows, p), tau (rows,), pi (p,), G (p, p)."""
    tally = {"+": 0, "*": 0, "/": 0}
    y, tau, pi, g = counted(y, tally), counted(tau, tally)[:, None], counted(pi, tally)[:, None], counted(g, tally)
    rows, count = y.shape
    gy = product(g, y.T)
    gain = product(gy, inverse(product(y, gy) + counted(np.eye(rows), tally), tally))
    pi = pi + product(gain, tau - product(y, pi))
    g = product(counted(np.eye(count), tally) - product(gain, y), g)
    return values(pi)[:, 0], values(g), tally


def lyapunov_update(y, sigma, gain, pi, period=0.02, inverse_kept=True):
    """(44) as printed, K_pi^-1 = gain (p, p), and a step of Euler: (pi, tally). inverse_kept: else K_pi is given."""
    tally = {"+": 0, "*": 0, "/": 0}
    y, sigma, pi = counted(y, tally), counted(sigma, tally)[:, None], counted(pi, tally)[:, None]
    gain = counted(gain, tally) if inverse_kept else inverse(counted(gain, tally), tally)
    rate = product(gain, product(y.T, sigma))
    return values(pi + counted([[period]], tally) * rate)[:, 0], tally


def tallies(rows=7, count=50, inverse_kept=True) -> tuple[dict, dict]:
    """Operations of both updates, by kind."""
    draw = np.random.default_rng(2)
    y, pi = draw.standard_normal((rows, count)), draw.standard_normal(count)
    *_, least = least_squares_update(y, draw.standard_normal(rows), pi, np.eye(count))
    _, lyapunov = lyapunov_update(y, draw.standard_normal(rows), np.eye(count), pi, inverse_kept=inverse_kept)
    return least, lyapunov


def relative_cost(every: float = 1.0):
    """Least squares takes more operations a control cycle than Lyapunov's law. every: cycles between its updates."""
    least, lyapunov = (sum(tally.values()) for tally in tallies())
    return least / every > lyapunov, f"{least} and {lyapunov} operations, ratio {least / every / lyapunov:.3g}"


def inverts_nothing(inverse_kept: bool = True):
    """Lyapunov's law inverts no matrix in an update: it divides by nothing. inverse_kept: K_pi^-1 is known, not K_pi."""
    least, lyapunov = tallies(inverse_kept=inverse_kept)
    return lyapunov["/"] == 0, f"{lyapunov['/']} divisions, {least['/']} in least squares"


def fits_the_period(rate: float = 1e7):
    """Both updates together take less than the shortest control period. rate: operations a second."""
    seconds = sum(sum(tally.values()) for tally in tallies()) / rate
    return seconds < PERIOD, f"{seconds:.2g} s at {rate:g} operations a second"
