"""Appendices A and B of Zhang and Cai (2020), symbolically: the kernels' own source against B = (Q - 1)(Q + 1)^-1.

Each kernel is run as a plain function on sympy symbols, so what is compared is the very code, exactly, not a number.
"""

import pytest
import sympy
from sympy import Matrix, cancel, diff, eye, nsimplify, symbols, zeros

from lander_ros import constraints, twistor_kinematics

b1, b2, b3, b5, b6, b7 = symbols("b1 b2 b3 b5 b6 b7", real=True)
TWISTOR = [b1, b2, b3, 0, b5, b6, b7, 0]
S = 1 + b1**2 + b2**2 + b3**2


def plain(kernel):
    return getattr(kernel, "py_func", kernel)


class Grid:
    """A matrix of expressions that takes the slices the kernels use."""

    def __init__(self, matrix, row=0):
        self.matrix, self.row = matrix, row

    def __setitem__(self, index, value):
        i, j = index if isinstance(index, tuple) else (index, 0)
        self.matrix[self.row + i, j] = nsimplify(value, rational=True)

    def __getitem__(self, index):
        return Grid(self.matrix, self.row + index.start)


def evaluated(kernel, rows, columns, *arguments):
    out = zeros(rows, columns)
    plain(kernel)(*arguments, Grid(out))
    return out


def times(p, q):
    """Hamilton product in the order vector, scalar."""
    pv, qv = Matrix(p[:3]), Matrix(q[:3])
    return [*(p[3] * qv + q[3] * pv + pv.cross(qv)), p[3] * q[3] - pv.dot(qv)]


def plus(p, q, sign=1):
    return [x + sign * y for x, y in zip(p, q, strict=True)]


def dual_times(p, q):
    return [*times(p[:4], q[:4]), *plus(times(p[:4], q[4:]), times(p[4:], q[:4]))]


def conjugate(q):
    return [-q[0], -q[1], -q[2], q[3]]


@pytest.fixture(scope="module")
def position():
    """r^D = 2 (q' q*)_v of Q = (1 + B)(1 - B)^-1, from the definition."""
    one_plus, one_minus = [b1, b2, b3, 1, b5, b6, b7, 0], [-b1, -b2, -b3, 1, -b5, -b6, -b7, 0]
    real = [x / S for x in conjugate(one_minus[:4])]
    dual = [-x for x in times(times(real, one_minus[4:]), real)]
    q = dual_times(one_plus, [*real, *dual])
    r = times(q[4:], conjugate(q[:4]))
    assert cancel(r[3]) == 0
    return Matrix([cancel(2 * x) for x in r[:3]])


def test_position_jacobian_is_exact_in_every_entry(position, monkeypatch):
    monkeypatch.setattr(
        twistor_kinematics, "pi_inverse_transpose", plain(twistor_kinematics.pi_inverse_transpose)
    )
    printed = evaluated(twistor_kinematics.position_jacobian, 8, 3, TWISTOR)
    for i, symbol in enumerate(TWISTOR):
        for j in range(3):
            expected = 0 if symbol == 0 else diff(position[j], symbol)
            assert cancel(printed[i, j] - expected) == 0, f"entry ({i + 1}, {j + 1}) of Appendix A (1) differs"


def test_pi_inverse_transpose_is_exact(position):
    printed = evaluated(twistor_kinematics.pi_inverse_transpose, 3, 3, TWISTOR)
    pi = evaluated(twistor_kinematics.pi_matrix, 3, 3, TWISTOR)
    n = evaluated(twistor_kinematics.kinematic_matrix, 3, 3, TWISTOR)
    assert (printed.T * pi - eye(3)).applyfunc(cancel) == zeros(3)
    assert (n.T / 4 - pi).applyfunc(sympy.expand) == zeros(3)
    assert (pi * position - Matrix([b5, b6, b7])).applyfunc(cancel) == zeros(3, 1)


def test_gamma_is_the_transpose_of_the_kinematic_matrix():
    """(1/4)(1 + B) V (1 - B) = (1/4) Gamma^T V for every V, scalar slots included; so is the rate kernel."""
    motor = list(symbols("v1:9", real=True))
    one_plus, one_minus = [b1, b2, b3, 1, b5, b6, b7, 0], [-b1, -b2, -b3, 1, -b5, -b6, -b7, 0]
    rate = Matrix(dual_times(dual_times(one_plus, motor), one_minus)) / 4
    gamma = evaluated(twistor_kinematics.gamma_matrix, 8, 8, TWISTOR)
    assert (gamma.T * Matrix(motor) / 4 - rate).applyfunc(sympy.expand) == zeros(8, 1)
    assert (gamma * Matrix(motor) / 4 - rate).applyfunc(sympy.expand) != zeros(8, 1)
    without_scalars = {motor[3]: 0, motor[7]: 0}
    given = [x.subs(without_scalars) for x in map(sympy.sympify, motor)]
    code = zeros(8, 1)
    monkey = plain(twistor_kinematics.twistor_rate)
    monkey(TWISTOR, given, Grid(code))
    assert (code - rate.subs(without_scalars)).applyfunc(sympy.expand) == zeros(8, 1)


def test_view_gradient_is_exact(position, monkeypatch):
    """Appendix A (2) is the gradient of + r^B_z/|r|; |b'| is kept as a symbol n with n^2 = b5^2 + b6^2 + b7^2."""
    n = symbols("n", positive=True)
    squares = b5**2 + b6**2 + b7**2

    class Roots:
        @staticmethod
        def sqrt(expression):
            expression = nsimplify(expression, rational=True)
            for power in (0, 2):
                if cancel(expression * S**power - squares) == 0:
                    return n / S ** (power // 2)
            raise AssertionError(f"unexpected root of {expression}")

    monkeypatch.setattr(constraints, "math", Roots)
    top = nsimplify(plain(constraints.view_cosine_twistor)(TWISTOR), rational=True) * S * n
    rotation = evaluated(twistor_kinematics.pi_inverse_transpose, 3, 3, TWISTOR)  # r^B = Pi^-T b'
    assert cancel((rotation * Matrix([b5, b6, b7]))[2] * S**2 / 4 - top) == 0
    printed = evaluated(constraints.view_gradient_printed, 8, 1, TWISTOR)
    for i, symbol in enumerate(TWISTOR):
        if symbol == 0:
            assert printed[i] == 0
            continue
        c = top / S
        expected = diff(c, symbol) / n - (c * symbol / n**3 if i > 3 else 0)
        numerator, _ = sympy.fraction(cancel(sympy.together(printed[i] - expected)))
        remainder = sympy.rem(sympy.Poly(numerator, n), sympy.Poly(n**2 - squares, n))
        assert sympy.expand(remainder.as_expr()) == 0, f"row {i + 1} of Appendix A (2) differs"


def test_terrain_gradient_is_exact(monkeypatch):
    """Eq. (53) is the gradient of k [alpha (x^2 + beta y^2)]^gamma - k z; our clearance is -f1 at rho_0 = z_0 = 0."""
    x, y, z, alpha, beta, gamma, k = symbols("x y z alpha beta gamma k", positive=True)

    class Powers:
        pow = staticmethod(lambda base, exponent: nsimplify(base, rational=True) ** nsimplify(exponent, rational=True))

    monkeypatch.setattr(constraints, "math", Powers)
    monkeypatch.setattr(constraints, "funnel_height", plain(constraints.funnel_height))
    printed = evaluated(constraints.terrain_gradient_printed, 3, 1, [x, y, z], alpha, beta, gamma, k)
    f1 = k * ((alpha * (x**2 + beta * y**2)) ** gamma - z)
    for i, symbol in enumerate((x, y, z)):
        assert sympy.simplify(printed[i] - diff(f1, symbol)) == 0
    ours = zeros(3, 1)
    d = plain(constraints.clearance)([x, y, z], alpha, beta, gamma, 0, 0, Grid(ours))
    assert sympy.simplify(nsimplify(d, rational=True) + f1 / k) == 0
    assert (ours + printed / k).applyfunc(sympy.simplify) == zeros(3, 1)


def test_appendix_b_cancels_for_every_weight():
    """V1' + V2' = 0 for any p, q, p_eps, q_eps; alone each vanishes only where p_eps q = p q_eps."""
    p, q, p_eps, q_eps, m = symbols("p q p_eps q_eps m", positive=True)
    w, alpha, zeta, eta = (Matrix(symbols(f"{name}1:4", real=True)) for name in ("w", "a", "z", "e"))
    j = Matrix(3, 3, lambda i, k: symbols(f"J{min(i, k)}{max(i, k)}"))

    def cross(a, b):
        return a[0].cross(b[0]), a[0].cross(b[1]) + a[1].cross(b[0])

    def inertia(a):
        return m * a[1], j * a[0]

    def circle(a, b):
        return a[0].dot(b[0]) + a[1].dot(b[1])

    weight = (p_eps * q * alpha, p * q_eps * w)
    motor, site = (w, alpha), (zeta, eta)
    total = (w + zeta, alpha + eta)
    v1 = circle(weight, cross(motor, inertia(total)))
    first, second = cross(site, inertia(motor)), inertia(cross(motor, site))
    v2 = circle(weight, (first[0] - second[0], first[1] - second[1]))
    last_line_v1 = m * p_eps * q * alpha.dot(w.cross(total[1])) + m * p * q_eps * w.dot(alpha.cross(total[1]))
    last_line_v2 = (
        p * q_eps * w.dot(zeta.cross(j * w))
        - m * p * q_eps * w.dot(alpha.cross(eta))
        - m * p_eps * q * alpha.dot(w.cross(eta))
        - p * q_eps * w.dot(j * w.cross(zeta))
    )
    assert sympy.expand(v1 - last_line_v1) == 0
    assert sympy.expand(v2 - last_line_v2) == 0
    assert sympy.expand(v1 + v2) == 0
    assert sympy.expand(v1) != 0
    assert sympy.expand(v1.subs(p_eps, p * q_eps / q)) == 0
