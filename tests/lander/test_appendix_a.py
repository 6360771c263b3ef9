"""Appendices A and B of Zhang and Cai (2020), symbolically: the kernels' own source against B = (Q - 1)(Q + 1)^-1.

Each kernel is run as a plain function on sympy symbols, so what is compared is the very code, exactly, not a number.
Values of symbols take the place of the values of numbers that the kernels' modules name.
"""

from types import SimpleNamespace

import pytest
import sympy
from sympy import Matrix, cancel, diff, eye, nsimplify, symbols, zeros

from flight_math import plain
from lander_ros import constraints, twistor_kinematics

b1, b2, b3, b5, b6, b7 = symbols("b1 b2 b3 b5 b6 b7", real=True)
TWISTOR = [b1, b2, b3, 0, b5, b6, b7, 0]
S = 1 + b1**2 + b2**2 + b3**2


class Vector(sympy.ImmutableMatrix):
    """A Vec3 of expressions."""

    x, y, z = (property(lambda self, i=i: self[i, 0]) for i in range(3))


def vector(*parts):
    return Vector(3, 1, [nsimplify(part, rational=True) for part in parts])


def exact(matrix):
    """Fractions in place of floats."""
    return Matrix(matrix).applyfunc(lambda part: nsimplify(part, rational=True))


def dual_vector(real, dual):
    return SimpleNamespace(real=Vector(real), dual=Vector(dual))


B = dual_vector(vector(b1, b2, b3), vector(b5, b6, b7))


@pytest.fixture(autouse=True)
def symbolic(monkeypatch):
    """The kernels' modules with values of symbols; a kernel that they call is its plain function."""
    values = {
        "Vec3": vector, "DualVector": dual_vector, "Mat3": lambda *parts: exact(Matrix(3, 3, parts)),
        "dot": lambda a, b: Matrix(a).dot(Matrix(b)), "cross": lambda a, b: Vector(Matrix(a).cross(Matrix(b))),
        "norm": lambda v: constraints.math.sqrt(Matrix(v).dot(Matrix(v))),
        "pi_inverse_transpose": plain(twistor_kinematics.pi_inverse_transpose),
        "funnel_height": plain(constraints.funnel_height),
    }
    for module in (twistor_kinematics, constraints):
        for name in set(values) & set(vars(module)):
            monkeypatch.setattr(module, name, values[name])


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


def test_position_jacobian_is_exact_in_every_entry(position):
    blocks = plain(twistor_kinematics.position_jacobian)(B)
    for block, half in zip(map(exact, blocks), (TWISTOR[0:3], TWISTOR[4:7])):
        for i, symbol in enumerate(half):
            for j in range(3):
                difference = cancel(block[i, j] - diff(position[j], symbol))
                assert difference == 0, f"entry ({symbol}, {j + 1}) of Appendix A (1) differs"


def test_pi_inverse_transpose_is_exact(position):
    printed, pi, n = (exact(plain(kernel)(B)) for kernel in (
        twistor_kinematics.pi_inverse_transpose, twistor_kinematics.pi_matrix, twistor_kinematics.kinematic_matrix))
    assert (printed.T * pi - eye(3)).applyfunc(cancel) == zeros(3)
    assert (n.T / 4 - pi).applyfunc(sympy.expand) == zeros(3)
    assert (pi * position - Matrix([b5, b6, b7])).applyfunc(cancel) == zeros(3, 1)


def printed_gamma():
    """Gamma (8, 8) of its printed blocks, scalars included."""
    gamma = zeros(8, 8)
    (first, second), (scalar, scalar_dual) = (
        plain(kernel)(B) for kernel in (twistor_kinematics.gamma_blocks, twistor_kinematics.gamma_scalars))
    for row, column, block, corner in ((0, 0, first, scalar), (0, 4, second, scalar_dual), (4, 4, first, scalar)):
        gamma[row:row + 3, column:column + 3] = exact(block)
        gamma[row + 3, column + 3] = nsimplify(corner, rational=True)
    return gamma


def test_gamma_is_the_transpose_of_the_kinematic_matrix():
    """(1/4)(1 + B) V (1 - B) = (1/4) Gamma^T V for every V, scalar slots included; so is the rate kernel."""
    motor = list(symbols("v1:9", real=True))
    one_plus, one_minus = [b1, b2, b3, 1, b5, b6, b7, 0], [-b1, -b2, -b3, 1, -b5, -b6, -b7, 0]
    rate = Matrix(dual_times(dual_times(one_plus, motor), one_minus)) / 4
    gamma = printed_gamma()
    assert (gamma.T * Matrix(motor) / 4 - rate).applyfunc(sympy.expand) == zeros(8, 1)
    assert (gamma * Matrix(motor) / 4 - rate).applyfunc(sympy.expand) != zeros(8, 1)
    without_scalars = {motor[3]: 0, motor[7]: 0}
    given = dual_vector(vector(*motor[0:3]), vector(*motor[4:7]))
    code = plain(twistor_kinematics.twistor_rate)(B, given)
    found = [*exact(code.real), 0, *exact(code.dual), 0]
    assert (Matrix(found) - rate.subs(without_scalars)).applyfunc(sympy.expand) == zeros(8, 1)


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
    top = nsimplify(plain(constraints.view_cosine_twistor)(B), rational=True) * S * n
    rotation = exact(plain(twistor_kinematics.pi_inverse_transpose)(B))  # r^B = Pi^-T b'
    assert cancel((rotation * Matrix([b5, b6, b7]))[2] * S**2 / 4 - top) == 0
    code = plain(constraints.view_gradient_printed)(B)
    for printed, half, is_dual in ((exact(code.real), TWISTOR[0:3], False), (exact(code.dual), TWISTOR[4:7], True)):
        for i, symbol in enumerate(half):
            c = top / S
            expected = diff(c, symbol) / n - (c * symbol / n**3 if is_dual else 0)
            numerator, _ = sympy.fraction(cancel(sympy.together(printed[i] - expected)))
            remainder = sympy.rem(sympy.Poly(numerator, n), sympy.Poly(n**2 - squares, n))
            assert sympy.expand(remainder.as_expr()) == 0, f"row {symbol} of Appendix A (2) differs"


def test_terrain_gradient_is_exact(monkeypatch):
    """Eq. (53) is the gradient of k [alpha (x^2 + beta y^2)]^gamma - k z; our clearance is -f1 at rho_0 = z_0 = 0."""
    x, y, z, alpha, beta, gamma, k = symbols("x y z alpha beta gamma k", positive=True)
    monkeypatch.setattr(constraints, "power",
                        lambda base, exponent: nsimplify(base, rational=True) ** nsimplify(exponent, rational=True))
    p = SimpleNamespace(funnel_alpha=alpha, funnel_beta=beta, funnel_gamma=gamma, funnel_rho_0=0, funnel_z_0=0)
    printed = exact(plain(constraints.terrain_gradient_printed)(p, k, vector(x, y, z)))
    f1 = k * ((alpha * (x**2 + beta * y**2)) ** gamma - z)
    for i, symbol in enumerate((x, y, z)):
        assert sympy.simplify(printed[i] - diff(f1, symbol)) == 0
    d = plain(constraints.clearance)(p, vector(x, y, z))
    ours = exact(plain(constraints.clearance_gradient)(p, vector(x, y, z)))
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
