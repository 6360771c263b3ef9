"""Regressor of the space robot: the dynamics as Y pi, linear in the inertial parameters.

Source: Aerospace 2023, 10(10), 679, equation (29) and appendix A, corrected: the inward pass carries force and moment
of each body through every joint (f_p = R f, n_p = R n + P x R f), and the force rows of the base are kept. The only
translational signal is a, the inertial acceleration of the base's origin in base axes; base velocity drops out.

Rows of Y (6+n): base force [N], base moment about the base origin [N m], joint torques [N m].
Columns: ten per body, [Ixx Ixy Ixz Iyy Iyz Izz, m cx, m cy, m cz, m], inertia about the body frame's origin.
"""

from flight_graph.kernel import kernel
from spacerobot_ros.kinematics import body_motion


@kernel
def body_block(motion, b, block):
    """Wrench of body ``b`` about its own origin per unit parameter: ``block`` (6, 10), force rows before moment rows.

    f = m a + al x h + w x (w_r x h);  n = I al + h x a + w_r x (I w);
    force columns [0, S(al) + S(w) S(w_r), a]; moment columns [K(al) + S(w_r) K(w), -S(a), 0].
    """
    wx, wy, wz = motion[b, 0], motion[b, 1], motion[b, 2]
    vx, vy, vz = motion[b, 3], motion[b, 4], motion[b, 5]
    ex, ey, ez = motion[b, 6], motion[b, 7], motion[b, 8]
    ax, ay, az = motion[b, 9], motion[b, 10], motion[b, 11]
    dot = wx * vx + wy * vy + wz * vz
    block[0, 6] = vx * wx - dot
    block[0, 7] = vx * wy - ez
    block[0, 8] = vx * wz + ey
    block[0, 9] = ax
    block[1, 6] = vy * wx + ez
    block[1, 7] = vy * wy - dot
    block[1, 8] = vy * wz - ex
    block[1, 9] = ay
    block[2, 6] = vz * wx - ey
    block[2, 7] = vz * wy + ex
    block[2, 8] = vz * wz - dot
    block[2, 9] = az
    block[3, 0] = ex
    block[3, 1] = ey - vz * wx
    block[3, 2] = ez + vy * wx
    block[3, 3] = -vz * wy
    block[3, 4] = vy * wy - vz * wz
    block[3, 5] = vy * wz
    block[4, 0] = vz * wx
    block[4, 1] = ex + vz * wy
    block[4, 2] = vz * wz - vx * wx
    block[4, 3] = ey
    block[4, 4] = ez - vx * wy
    block[4, 5] = -vx * wz
    block[5, 0] = -vy * wx
    block[5, 1] = vx * wx - vy * wy
    block[5, 2] = ex - vy * wz
    block[5, 3] = vx * wy
    block[5, 4] = ey + vx * wz
    block[5, 5] = ez
    block[3, 6] = 0.0
    block[3, 7] = az
    block[3, 8] = -ay
    block[4, 6] = -az
    block[4, 7] = 0.0
    block[4, 8] = ax
    block[5, 6] = ay
    block[5, 7] = -ax
    block[5, 8] = 0.0
    for row in range(3):
        block[3 + row, 9] = 0.0
        for column in range(6):
            block[row, column] = 0.0


@kernel
def carry_to_parent(rotation, offset, i, block):
    """Carry a body's wrench columns through joint ``i``: f_p = R f, n_p = R n + P x (R f), in place, ``block`` (6, 10).

    The six inertia columns have no force, so only the last four carry one.
    """
    r00, r01, r02 = rotation[i, 0, 0], rotation[i, 0, 1], rotation[i, 0, 2]
    r10, r11, r12 = rotation[i, 1, 0], rotation[i, 1, 1], rotation[i, 1, 2]
    r20, r21, r22 = rotation[i, 2, 0], rotation[i, 2, 1], rotation[i, 2, 2]
    px, py, pz = offset[i, 0], offset[i, 1], offset[i, 2]
    for c in range(10):
        x, y, z = block[3, c], block[4, c], block[5, c]
        block[3, c] = r00 * x + r01 * y + r02 * z
        block[4, c] = r10 * x + r11 * y + r12 * z
        block[5, c] = r20 * x + r21 * y + r22 * z
    for c in range(6, 10):
        x, y, z = block[0, c], block[1, c], block[2, c]
        fx = r00 * x + r01 * y + r02 * z
        fy = r10 * x + r11 * y + r12 * z
        fz = r20 * x + r21 * y + r22 * z
        block[0, c] = fx
        block[1, c] = fy
        block[2, c] = fz
        block[3, c] += py * fz - pz * fy
        block[4, c] += pz * fx - px * fz
        block[5, c] += px * fy - py * fx


@kernel
def regressor(parent, rotation, offset, axis, w, w_r, al_r, a_r, thd, thd_r, thdd_r, y, motion, block):
    """Fill ``y`` (6+n, 10(n+1)) so that y pi is the wrench at base and joints of the given motion.

    ``w``, ``thd``: actual angular velocity (3,) and joint rates (n,); ``w_r``, ``al_r``, ``a_r`` (3,), ``thd_r``,
    ``thdd_r`` (n,): reference velocities and accelerations (the actual ones for estimation). Work: ``motion``
    (n+1, 12), ``block`` (6, 10). Columns of a body are carried along its ancestors only; other joint rows are zero.
    """
    body_motion(parent, rotation, offset, axis, w, w_r, al_r, a_r, thd, thd_r, thdd_r, motion)
    n = parent.shape[0]
    for b in range(n + 1):
        first = 10 * b
        for row in range(n):
            for c in range(10):
                y[6 + row, first + c] = 0.0
        body_block(motion, b, block)
        body = b
        while body > 0:
            i = body - 1
            zx, zy, zz = axis[i, 0], axis[i, 1], axis[i, 2]
            for c in range(10):
                y[6 + i, first + c] = zx * block[3, c] + zy * block[4, c] + zz * block[5, c]
            carry_to_parent(rotation, offset, i, block)
            body = parent[i]
        for row in range(6):
            for c in range(10):
                y[row, first + c] = block[row, c]
