"""Matrices of the twistor: N, Pi, Gamma, the Jacobian of the position, and the rate of a twistor.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix A (1), (3), (4), as printed; all entries are
exact (tests/lander/test_appendix_a.py). The printed Gamma is the transpose of the kinematic matrix: it maps a gradient
in B to a wrench, (torque, force) = (1/4) Gamma dU/dB, and dB/dt = (1/4) Gamma^T V. That reading is ours.

N(b) = (1 - |b|^2) I + 2 [b]x + 2 b b^T,  S = 1 + |b|^2,  N N^T = S^2 I,  R_DB (B -> D) = N^2 / S^2.
Motor V = w + eps alpha, w = w_BD^B [rad/s], alpha = d(r^B)/dt + w x r^B = R_DB^T d(r^D)/dt [m/s], as [w, 0 | alpha, 0].
"""

from flight_graph.kernel import kernel


@kernel
def kinematic_matrix(twistor, out):
    """N(b), to (3, 3): db/dt = (1/4) N w and r^D = (4/S^2) N b'."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    out[0, 0] = 1.0 + b1 * b1 - b2 * b2 - b3 * b3
    out[0, 1] = 2.0 * (b1 * b2 - b3)
    out[0, 2] = 2.0 * (b1 * b3 + b2)
    out[1, 0] = 2.0 * (b1 * b2 + b3)
    out[1, 1] = 1.0 - b1 * b1 + b2 * b2 - b3 * b3
    out[1, 2] = 2.0 * (b2 * b3 - b1)
    out[2, 0] = 2.0 * (b1 * b3 - b2)
    out[2, 1] = 2.0 * (b2 * b3 + b1)
    out[2, 2] = 1.0 - b1 * b1 - b2 * b2 + b3 * b3


@kernel
def pi_matrix(twistor, out):
    """Pi = (1/4) N^T, to (3, 3): b' = Pi r^D and db/dt = Pi^T w."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    out[0, 0] = 0.25 * (1.0 + b1 * b1 - b2 * b2 - b3 * b3)
    out[1, 0] = 0.5 * (b1 * b2 - b3)
    out[2, 0] = 0.5 * (b1 * b3 + b2)
    out[0, 1] = 0.5 * (b1 * b2 + b3)
    out[1, 1] = 0.25 * (1.0 - b1 * b1 + b2 * b2 - b3 * b3)
    out[2, 1] = 0.5 * (b2 * b3 - b1)
    out[0, 2] = 0.5 * (b1 * b3 - b2)
    out[1, 2] = 0.5 * (b2 * b3 + b1)
    out[2, 2] = 0.25 * (1.0 - b1 * b1 - b2 * b2 + b3 * b3)


@kernel
def pi_inverse_transpose(twistor, out):
    """Pi^-T, to (3, 3), Appendix A (3) as printed: df/db' = Pi^-T df/dr^D, r^B = Pi^-T b', w = Pi^-T db/dt."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    s = b1 * b1 + b2 * b2 + b3 * b3 + 1.0
    scale = 1.0 / (s * s)
    out[0, 0] = 4.0 * (b1 * b1 - b2 * b2 - b3 * b3 + 1.0) * scale
    out[0, 1] = 8.0 * (b1 * b2 + b3) * scale
    out[0, 2] = -8.0 * (b2 - b1 * b3) * scale
    out[1, 0] = 8.0 * (b1 * b2 - b3) * scale
    out[1, 1] = -4.0 * (b1 * b1 - b2 * b2 + b3 * b3 - 1.0) * scale
    out[1, 2] = 8.0 * (b1 + b2 * b3) * scale
    out[2, 0] = 8.0 * (b2 + b1 * b3) * scale
    out[2, 1] = -8.0 * (b1 - b2 * b3) * scale
    out[2, 2] = -4.0 * (b1 * b1 + b2 * b2 - b3 * b3 - 1.0) * scale


@kernel
def gamma_matrix(twistor, out):
    """Gamma = [Gamma1 Gamma2; 0 Gamma3], to (8, 8), Appendix A (4) as printed (Gamma3 is the same as Gamma1)."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    b5, b6, b7 = twistor[4], twistor[5], twistor[6]
    for i in range(8):
        for j in range(8):
            out[i, j] = 0.0
    for block in range(0, 8, 4):
        out[block, block] = b1 * b1 - b2 * b2 - b3 * b3 + 1.0
        out[block, block + 1] = 2.0 * b1 * b2 + 2.0 * b3
        out[block, block + 2] = 2.0 * b1 * b3 - 2.0 * b2
        out[block + 1, block] = 2.0 * b1 * b2 - 2.0 * b3
        out[block + 1, block + 1] = -b1 * b1 + b2 * b2 - b3 * b3 + 1.0
        out[block + 1, block + 2] = 2.0 * b1 + 2.0 * b2 * b3
        out[block + 2, block] = 2.0 * b2 + 2.0 * b1 * b3
        out[block + 2, block + 1] = 2.0 * b2 * b3 - 2.0 * b1
        out[block + 2, block + 2] = -b1 * b1 - b2 * b2 + b3 * b3 + 1.0
        out[block + 3, block + 3] = b1 * b1 + b2 * b2 + b3 * b3 + 1.0
    out[0, 4] = 2.0 * b1 * b5 - 2.0 * b2 * b6 - 2.0 * b3 * b7
    out[0, 5] = 2.0 * b2 * b5 + 2.0 * b1 * b6 + 2.0 * b7
    out[0, 6] = 2.0 * b3 * b5 - 2.0 * b6 + 2.0 * b1 * b7
    out[1, 4] = 2.0 * b2 * b5 + 2.0 * b1 * b6 - 2.0 * b7
    out[1, 5] = -2.0 * b1 * b5 + 2.0 * b2 * b6 - 2.0 * b3 * b7
    out[1, 6] = 2.0 * b5 + 2.0 * b3 * b6 + 2.0 * b2 * b7
    out[2, 4] = 2.0 * b3 * b5 + 2.0 * b6 + 2.0 * b1 * b7
    out[2, 5] = -2.0 * b5 + 2.0 * b3 * b6 + 2.0 * b2 * b7
    out[2, 6] = -2.0 * b1 * b5 - 2.0 * b2 * b6 + 2.0 * b3 * b7
    out[3, 7] = 2.0 * b1 * b5 + 2.0 * b2 * b6 + 2.0 * b3 * b7


@kernel
def conjugate_wrench(twistor, gradient, gamma, out):
    """(1/4) Gamma dU/dB, to (8,): slots 0:3 torque-conjugate, 4:7 force-conjugate, both in B. ``gamma`` (8, 8) is work.

    dU/dt = ((1/4) Gamma dU/dB)^T V, for the gradient (8,) of U with respect to the twistor.
    """
    gamma_matrix(twistor, gamma)
    for i in range(8):
        total = 0.0
        for j in range(8):
            total += gamma[i, j] * gradient[j]
        out[i] = 0.25 * total


@kernel
def twistor_rate(twistor, motor, out):
    """dB/dt = (1/4)(1 + B) V (1 - B) = (1/4) Gamma^T V, to (8,), of a motor V (8,) with zero scalar parts."""
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    c1, c2, c3 = twistor[4], twistor[5], twistor[6]
    w1, w2, w3 = motor[0], motor[1], motor[2]
    a1, a2, a3 = motor[4], motor[5], motor[6]
    plain = 1.0 - b1 * b1 - b2 * b2 - b3 * b3
    plain_dual = -2.0 * (b1 * c1 + b2 * c2 + b3 * c3)
    along = b1 * w1 + b2 * w2 + b3 * w3
    along_dual = b1 * a1 + b2 * a2 + b3 * a3 + c1 * w1 + c2 * w2 + c3 * w3
    out[0] = 0.25 * plain * w1 + 0.5 * (b2 * w3 - b3 * w2 + b1 * along)
    out[1] = 0.25 * plain * w2 + 0.5 * (b3 * w1 - b1 * w3 + b2 * along)
    out[2] = 0.25 * plain * w3 + 0.5 * (b1 * w2 - b2 * w1 + b3 * along)
    out[3] = 0.0
    out[4] = 0.25 * (plain * a1 + plain_dual * w1) + 0.5 * (
        b2 * a3 - b3 * a2 + c2 * w3 - c3 * w2 + b1 * along_dual + c1 * along
    )
    out[5] = 0.25 * (plain * a2 + plain_dual * w2) + 0.5 * (
        b3 * a1 - b1 * a3 + c3 * w1 - c1 * w3 + b2 * along_dual + c2 * along
    )
    out[6] = 0.25 * (plain * a3 + plain_dual * w3) + 0.5 * (
        b1 * a2 - b2 * a1 + c1 * w2 - c2 * w1 + b3 * along_dual + c3 * along
    )
    out[7] = 0.0


@kernel
def position_jacobian(twistor, out):
    """(d r^D / dB^T)^T, to (8, 3), Appendix A (1) as printed: row i is the derivative of r^D to B_i; dU/dB = J dU/dr^D.

    The rows of the scalars b4 and b8 are zero.
    """
    b1, b2, b3 = twistor[0], twistor[1], twistor[2]
    b5, b6, b7 = twistor[4], twistor[5], twistor[6]
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
    cube = s * s * s
    out[0, 0], out[0, 1], out[0, 2] = a11 / cube, a12 / cube, a13 / cube
    out[1, 0], out[1, 1], out[1, 2] = a21 / cube, a22 / cube, a23 / cube
    out[2, 0], out[2, 1], out[2, 2] = a31 / cube, a32 / cube, a33 / cube
    pi_inverse_transpose(twistor, out[4:7])
    for j in range(3):
        out[3, j] = 0.0
        out[7, j] = 0.0
