"""Matrices of the twistor: N, Pi, Gamma, the Jacobian of the position, and the rate of a twistor.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix A (1), (3), (4), as printed; all entries are
exact (tests/lander/test_appendix_a.py). The printed Gamma is the transpose of the kinematic matrix: it maps a gradient
in B to a wrench, (torque, force) = (1/4) Gamma dU/dB, and dB/dt = (1/4) Gamma^T V. That reading is ours.

N(b) = (1 - |b|^2) I + 2 [b]x + 2 b b^T,  S = 1 + |b|^2,  N N^T = S^2 I,  R_DB (B -> D) = N^2 / S^2.
Motor V = w + eps alpha, w = w_BD^B [rad/s], alpha = d(r^B)/dt + w x r^B = R_DB^T d(r^D)/dt [m/s].
The scalars of twistors and motors are 0: of the printed 8-row matrices stand here the 3x3 blocks of the vector parts.
"""

from flight_math import DualVector, Mat3, cross, dot, kernel


@kernel
def kinematic_matrix(twistor):
    """N(b): db/dt = (1/4) N w and r^D = (4/S^2) N b'."""
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    return Mat3(1.0 + b1 * b1 - b2 * b2 - b3 * b3, 2.0 * (b1 * b2 - b3), 2.0 * (b1 * b3 + b2),
                2.0 * (b1 * b2 + b3), 1.0 - b1 * b1 + b2 * b2 - b3 * b3, 2.0 * (b2 * b3 - b1),
                2.0 * (b1 * b3 - b2), 2.0 * (b2 * b3 + b1), 1.0 - b1 * b1 - b2 * b2 + b3 * b3)


@kernel
def pi_matrix(twistor):
    """Pi = (1/4) N^T: b' = Pi r^D and db/dt = Pi^T w."""
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    return Mat3(0.25 * (1.0 + b1 * b1 - b2 * b2 - b3 * b3), 0.5 * (b1 * b2 + b3), 0.5 * (b1 * b3 - b2),
                0.5 * (b1 * b2 - b3), 0.25 * (1.0 - b1 * b1 + b2 * b2 - b3 * b3), 0.5 * (b2 * b3 + b1),
                0.5 * (b1 * b3 + b2), 0.5 * (b2 * b3 - b1), 0.25 * (1.0 - b1 * b1 - b2 * b2 + b3 * b3))


@kernel
def pi_inverse_transpose(twistor):
    """Pi^-T, Appendix A (3) as printed: df/db' = Pi^-T df/dr^D, r^B = Pi^-T b', w = Pi^-T db/dt."""
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    s = b1 * b1 + b2 * b2 + b3 * b3 + 1.0
    return 1.0 / (s * s) * Mat3(
        4.0 * (b1 * b1 - b2 * b2 - b3 * b3 + 1.0), 8.0 * (b1 * b2 + b3), -8.0 * (b2 - b1 * b3),
        8.0 * (b1 * b2 - b3), -4.0 * (b1 * b1 - b2 * b2 + b3 * b3 - 1.0), 8.0 * (b1 + b2 * b3),
        8.0 * (b2 + b1 * b3), -8.0 * (b1 - b2 * b3), -4.0 * (b1 * b1 + b2 * b2 - b3 * b3 - 1.0))


@kernel
def gamma_blocks(twistor):
    """Gamma1 and Gamma2 of Gamma = [Gamma1 Gamma2; 0 Gamma3], Appendix A (4) as printed; Gamma3 is the same as Gamma1.

    Besides these rows and columns of the vectors, the printed blocks have one more entry each, at the scalars' (4, 4):
    1 + |b|^2 in Gamma1, 2 b.b' in Gamma2 (`gamma_scalars`).
    """
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    b5, b6, b7 = twistor.dual.x, twistor.dual.y, twistor.dual.z
    first = Mat3(
        b1 * b1 - b2 * b2 - b3 * b3 + 1.0, 2.0 * b1 * b2 + 2.0 * b3, 2.0 * b1 * b3 - 2.0 * b2,
        2.0 * b1 * b2 - 2.0 * b3, -b1 * b1 + b2 * b2 - b3 * b3 + 1.0, 2.0 * b1 + 2.0 * b2 * b3,
        2.0 * b2 + 2.0 * b1 * b3, 2.0 * b2 * b3 - 2.0 * b1, -b1 * b1 - b2 * b2 + b3 * b3 + 1.0)
    second = Mat3(
        2.0 * b1 * b5 - 2.0 * b2 * b6 - 2.0 * b3 * b7,
        2.0 * b2 * b5 + 2.0 * b1 * b6 + 2.0 * b7,
        2.0 * b3 * b5 - 2.0 * b6 + 2.0 * b1 * b7,
        2.0 * b2 * b5 + 2.0 * b1 * b6 - 2.0 * b7,
        -2.0 * b1 * b5 + 2.0 * b2 * b6 - 2.0 * b3 * b7,
        2.0 * b5 + 2.0 * b3 * b6 + 2.0 * b2 * b7,
        2.0 * b3 * b5 + 2.0 * b6 + 2.0 * b1 * b7,
        -2.0 * b5 + 2.0 * b3 * b6 + 2.0 * b2 * b7,
        -2.0 * b1 * b5 - 2.0 * b2 * b6 + 2.0 * b3 * b7)
    return first, second


@kernel
def gamma_scalars(twistor):
    """The entries (4, 4) of Gamma1 and Gamma2, Appendix A (4) as printed."""
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    b5, b6, b7 = twistor.dual.x, twistor.dual.y, twistor.dual.z
    return b1 * b1 + b2 * b2 + b3 * b3 + 1.0, 2.0 * b1 * b5 + 2.0 * b2 * b6 + 2.0 * b3 * b7


@kernel
def conjugate_wrench(twistor, gradient):
    """(1/4) Gamma dU/dB of the gradient dU/dB: torque-conjugate + eps force-conjugate, both in B.

    dU/dt = ((1/4) Gamma dU/dB)^T V.
    """
    first, second = gamma_blocks(twistor)
    return 0.25 * DualVector(first @ gradient.real + second @ gradient.dual, first @ gradient.dual)


@kernel
def twistor_rate(twistor, motor):
    """dB/dt = (1/4)(1 + B) V (1 - B) = (1/4) Gamma^T V, of a motor V."""
    b, d, w, a = twistor.real, twistor.dual, motor.real, motor.dual
    plain, plain_dual = 1.0 - dot(b, b), -2.0 * dot(b, d)
    along, along_dual = dot(b, w), dot(b, a) + dot(d, w)
    return DualVector(
        0.25 * plain * w + 0.5 * (cross(b, w) + along * b),
        0.25 * (plain * a + plain_dual * w) + 0.5 * (cross(b, a) + cross(d, w) + along_dual * b + along * d))


@kernel
def position_jacobian(twistor):
    """(d r^D / dB^T)^T, Appendix A (1) as printed: the rows of b and of b'; those of the scalars b4 and b8 are 0.

    Row i is the derivative of r^D to B_i; dU/db = A dU/dr^D, dU/db' = Pi^-T dU/dr^D.
    """
    b1, b2, b3 = twistor.real.x, twistor.real.y, twistor.real.z
    b5, b6, b7 = twistor.dual.x, twistor.dual.y, twistor.dual.z
    q1, q2, q3 = b1 * b1, b2 * b2, b3 * b3
    s = q1 + q2 + q3 + 1.0
    y = -b6 * q1 + 2.0 * b2 * b5 * b1 - 2.0 * b7 * b1 + 2.0 * b3 * b5 + q2 * b6 - q3 * b6 + b6 + 2.0 * b2 * b3 * b7
    z = -b7 * q1 + 2.0 * b3 * b5 * b1 + 2.0 * b6 * b1 - 2.0 * b2 * b5 + 2.0 * b2 * b3 * b6 - q2 * b7 + q3 * b7 + b7
    along = b1 * b5 + b2 * b6 + b3 * b7
    a11 = -8.0 * (
        b5 * q1 * b1
        + 3.0 * (b2 * b6 + b3 * b7) * q1
        + (-3.0 * b5 * q2 + 4.0 * b7 * b2 - 3.0 * q3 * b5 + b5 - 4.0 * b3 * b6) * b1
        - (q2 + q3 + 1.0) * (b2 * b6 + b3 * b7)
    )
    a12 = 4.0 * (-4.0 * b1 * y - 2.0 * s * (-b2 * b5 + b1 * b6 + b7))
    a13 = 8.0 * (
        b7 * q1 * b1
        - 3.0 * (b3 * b5 + b6) * q1
        + (b7 * q2 + 4.0 * (b5 - b3 * b6) * b2 - 3.0 * (q3 + 1.0) * b7) * b1
        + (q2 + q3 + 1.0) * (b3 * b5 + b6)
    )
    a21 = 8.0 * (
        b5 * q2 * b2
        - 3.0 * (b1 * b6 + b7) * q2
        + ((-3.0 * q1 + q3 - 3.0) * b5 + 4.0 * b3 * (b6 - b1 * b7)) * b2
        + (q1 + q3 + 1.0) * (b1 * b6 + b7)
    )
    a22 = 4.0 * (-4.0 * b2 * y + 2.0 * s * along)
    a23 = 4.0 * (-4.0 * b2 * z - 2.0 * s * (b5 - b3 * b6 + b2 * b7))
    a31 = 8.0 * (
        b5 * q3 * b3
        + 3.0 * (b6 - b1 * b7) * q3
        - ((3.0 * q1 - q2 + 3.0) * b5 + 4.0 * b2 * (b1 * b6 + b7)) * b3
        + (q1 + q2 + 1.0) * (b1 * b7 - b6)
    )
    a32 = 8.0 * (
        b6 * q3 * b3
        - 3.0 * b2 * b7 * q3
        + ((q1 - 3.0 * q2 - 3.0) * b6 + 4.0 * b1 * b7) * b3
        + (q1 + q2 + 1.0) * b2 * b7
        + (q1 - 4.0 * b2 * b3 * b1 + q2 - 3.0 * q3 + 1.0) * b5
    )
    a33 = 4.0 * (-4.0 * b3 * z + 2.0 * s * along)
    return Mat3(a11, a12, a13, a21, a22, a23, a31, a32, a33) / (s * s * s), pi_inverse_transpose(twistor)
