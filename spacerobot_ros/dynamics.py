"""Rigid-body dynamics of the tree: inverse dynamics, mass matrix, the mass matrix with linear momentum eliminated.

Source: Aerospace 2023, 10(10), 679, equations (16)-(20), (26), written in the inertial parameters pi (ten per body,
see `spacerobot_ros.regressor`). Generalised accelerations are [a (base origin, base axes), omega_dot, theta_ddot].
"""

from flight_graph.kernel import kernel
from spacerobot_ros.kinematics import body_motion


@kernel
def inverse_dynamics(parent, rotation, offset, axis, pi, w, w_r, al_r, a_r, thd, thd_r, thdd_r, wrench, motion, load):
    """Newton-Euler, equations (16)-(20): ``wrench`` (6+n,) = Y pi without forming Y; same signals as `regressor`.

    ``wrench``: base force [N], base moment [N m], joint torques [N m]. Work: ``motion`` (n+1, 12), ``load`` (n+1, 6).
    """
    body_motion(parent, rotation, offset, axis, w, w_r, al_r, a_r, thd, thd_r, thdd_r, motion)
    n = parent.shape[0]
    for b in range(n + 1):
        _body_wrench(motion, pi, b, load)
    for i in range(n - 1, -1, -1):
        fx, fy, fz = load[i + 1, 0], load[i + 1, 1], load[i + 1, 2]
        nx, ny, nz = load[i + 1, 3], load[i + 1, 4], load[i + 1, 5]
        wrench[6 + i] = axis[i, 0] * nx + axis[i, 1] * ny + axis[i, 2] * nz
        _add_to_parent(rotation, offset, i, parent[i], fx, fy, fz, nx, ny, nz, load)
    for k in range(6):
        wrench[k] = load[0, k]


@kernel
def _body_wrench(motion, pi, b, load):
    """f = m a + al x h + w x (w_r x h);  n = I al + h x a + w_r x (I w), about the body's origin, into load[b]."""
    wx, wy, wz = motion[b, 0], motion[b, 1], motion[b, 2]
    vx, vy, vz = motion[b, 3], motion[b, 4], motion[b, 5]
    ex, ey, ez = motion[b, 6], motion[b, 7], motion[b, 8]
    ax, ay, az = motion[b, 9], motion[b, 10], motion[b, 11]
    first = 10 * b
    ixx, ixy, ixz = pi[first], pi[first + 1], pi[first + 2]
    iyy, iyz, izz = pi[first + 3], pi[first + 4], pi[first + 5]
    hx, hy, hz, m = pi[first + 6], pi[first + 7], pi[first + 8], pi[first + 9]
    cx = vy * hz - vz * hy
    cy = vz * hx - vx * hz
    cz = vx * hy - vy * hx
    load[b, 0] = m * ax + (ey * hz - ez * hy) + (wy * cz - wz * cy)
    load[b, 1] = m * ay + (ez * hx - ex * hz) + (wz * cx - wx * cz)
    load[b, 2] = m * az + (ex * hy - ey * hx) + (wx * cy - wy * cx)
    lx = ixx * wx + ixy * wy + ixz * wz
    ly = ixy * wx + iyy * wy + iyz * wz
    lz = ixz * wx + iyz * wy + izz * wz
    load[b, 3] = ixx * ex + ixy * ey + ixz * ez + (hy * az - hz * ay) + (vy * lz - vz * ly)
    load[b, 4] = ixy * ex + iyy * ey + iyz * ez + (hz * ax - hx * az) + (vz * lx - vx * lz)
    load[b, 5] = ixz * ex + iyz * ey + izz * ez + (hx * ay - hy * ax) + (vx * ly - vy * lx)


@kernel
def _add_to_parent(rotation, offset, i, b, fx, fy, fz, nx, ny, nz, load):
    """load[b] += [R f, R n + P x (R f)] of joint i, equations (18), (19)."""
    gx = rotation[i, 0, 0] * fx + rotation[i, 0, 1] * fy + rotation[i, 0, 2] * fz
    gy = rotation[i, 1, 0] * fx + rotation[i, 1, 1] * fy + rotation[i, 1, 2] * fz
    gz = rotation[i, 2, 0] * fx + rotation[i, 2, 1] * fy + rotation[i, 2, 2] * fz
    px, py, pz = offset[i, 0], offset[i, 1], offset[i, 2]
    load[b, 0] += gx
    load[b, 1] += gy
    load[b, 2] += gz
    turned = rotation[i, 0, 0] * nx + rotation[i, 0, 1] * ny + rotation[i, 0, 2] * nz
    load[b, 3] += turned + (py * gz - pz * gy)
    turned = rotation[i, 1, 0] * nx + rotation[i, 1, 1] * ny + rotation[i, 1, 2] * nz
    load[b, 4] += turned + (pz * gx - px * gz)
    turned = rotation[i, 2, 0] * nx + rotation[i, 2, 1] * ny + rotation[i, 2, 2] * nz
    load[b, 5] += turned + (px * gy - py * gx)


@kernel
def composite_parameters(parent, rotation, offset, pi, composite):
    """Row b of ``composite`` (n+1, 10): parameters of body b and all bodies it carries, about b's origin, b's axes."""
    n = parent.shape[0]
    for b in range(n + 1):
        for k in range(10):
            composite[b, k] = pi[10 * b + k]
    for i in range(n - 1, -1, -1):
        _add_composite(rotation, offset, i, parent[i], composite)


@kernel
def _add_composite(rotation, offset, i, b, composite):
    """Add body i+1 to its parent b: I_p = R I R^T + 2 (P.g) E - P g^T - g P^T + m (P.P E - P P^T), g = R h."""
    c = i + 1
    m = composite[c, 9]
    px, py, pz = offset[i, 0], offset[i, 1], offset[i, 2]
    r = rotation
    hx, hy, hz = composite[c, 6], composite[c, 7], composite[c, 8]
    gx = r[i, 0, 0] * hx + r[i, 0, 1] * hy + r[i, 0, 2] * hz
    gy = r[i, 1, 0] * hx + r[i, 1, 1] * hy + r[i, 1, 2] * hz
    gz = r[i, 2, 0] * hx + r[i, 2, 1] * hy + r[i, 2, 2] * hz
    trace = 2.0 * (px * gx + py * gy + pz * gz) + m * (px * px + py * py + pz * pz)
    entry = 0
    for row in range(3):
        ux = r[i, row, 0] * composite[c, 0] + r[i, row, 1] * composite[c, 1] + r[i, row, 2] * composite[c, 2]
        uy = r[i, row, 0] * composite[c, 1] + r[i, row, 1] * composite[c, 3] + r[i, row, 2] * composite[c, 4]
        uz = r[i, row, 0] * composite[c, 2] + r[i, row, 1] * composite[c, 4] + r[i, row, 2] * composite[c, 5]
        p_row = px if row == 0 else (py if row == 1 else pz)
        g_row = gx if row == 0 else (gy if row == 1 else gz)
        for column in range(row, 3):
            p_column = px if column == 0 else (py if column == 1 else pz)
            g_column = gx if column == 0 else (gy if column == 1 else gz)
            value = ux * r[i, column, 0] + uy * r[i, column, 1] + uz * r[i, column, 2]
            value -= p_row * g_column + g_row * p_column + m * p_row * p_column
            if row == column:
                value += trace
            composite[b, entry] += value
            entry += 1
    composite[b, 6] += gx + m * px
    composite[b, 7] += gy + m * py
    composite[b, 8] += gz + m * pz
    composite[b, 9] += m


@kernel
def mass_matrix(parent, rotation, offset, axis, pi, h, composite, load):
    """Composite-rigid-body algorithm: ``h`` (6+n, 6+n) of [a, omega_dot, theta_ddot] (equation (26) with force rows).

    Work: ``composite`` (n+1, 10), ``load`` (n+1, 6). Afterwards composite[0] holds the whole system's parameters.
    """
    n = parent.shape[0]
    composite_parameters(parent, rotation, offset, pi, composite)
    for row in range(6 + n):
        for column in range(6 + n):
            h[row, column] = 0.0
    hx, hy, hz, m = composite[0, 6], composite[0, 7], composite[0, 8], composite[0, 9]
    for k in range(3):
        h[k, k] = m
    h[0, 4], h[0, 5] = hz, -hy
    h[1, 3], h[1, 5] = -hz, hx
    h[2, 3], h[2, 4] = hy, -hx
    h[3, 3], h[3, 4], h[3, 5] = composite[0, 0], composite[0, 1], composite[0, 2]
    h[4, 4], h[4, 5], h[5, 5] = composite[0, 3], composite[0, 4], composite[0, 5]
    for i in range(n):
        _joint_column(parent, rotation, offset, axis, i, h, composite, load)
    for row in range(6 + n):
        for column in range(row):
            h[row, column] = h[column, row]


@kernel
def _joint_column(parent, rotation, offset, axis, i, h, composite, load):
    """Column 6+i of the mass matrix: wrench of joint i's composite body under a unit joint acceleration."""
    b = i + 1
    zx, zy, zz = axis[i, 0], axis[i, 1], axis[i, 2]
    hx, hy, hz = composite[b, 6], composite[b, 7], composite[b, 8]
    fx = zy * hz - zz * hy
    fy = zz * hx - zx * hz
    fz = zx * hy - zy * hx
    nx = composite[b, 0] * zx + composite[b, 1] * zy + composite[b, 2] * zz
    ny = composite[b, 1] * zx + composite[b, 3] * zy + composite[b, 4] * zz
    nz = composite[b, 2] * zx + composite[b, 4] * zy + composite[b, 5] * zz
    while b > 0:
        j = b - 1
        h[6 + j, 6 + i] = axis[j, 0] * nx + axis[j, 1] * ny + axis[j, 2] * nz
        b = parent[j]
        for k in range(6):
            load[b, k] = 0.0
        _add_to_parent(rotation, offset, j, b, fx, fy, fz, nx, ny, nz, load)
        fx, fy, fz = load[b, 0], load[b, 1], load[b, 2]
        nx, ny, nz = load[b, 3], load[b, 4], load[b, 5]
    h[0, 6 + i], h[1, 6 + i], h[2, 6 + i] = fx, fy, fz
    h[3, 6 + i], h[4, 6 + i], h[5, 6 + i] = nx, ny, nz


@kernel
def reduced_mass_matrix(h, reduced):
    """M_r = H_qq - H_ql H_lq / M, shape (3+n, 3+n): linear momentum eliminated (l: base translation, H_ll = M E)."""
    size = reduced.shape[0]
    for row in range(size):
        for column in range(size):
            value = h[3 + row, 3 + column]
            for k in range(3):
                value -= h[k, 3 + row] * h[k, 3 + column] / h[k, k]
            reduced[row, column] = value
