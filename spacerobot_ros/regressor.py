"""Regressor of the space robot: the dynamics as Y pi, linear in the inertial parameters.

Source: Aerospace 2023, 10(8), 679, equation (29) and appendix A, corrected: the inward pass carries force and moment
of each body through every joint (f_p = R f, n_p = R n + P x R f), and the force rows of the base are kept. The only
translational signal is a, the inertial acceleration of the base's origin in base axes; base velocity drops out.

Rows of Y (6+n): base force [N], base moment about the base origin [N m], joint torques [N m].
Columns: ten per body, [Ixx Ixy Ixz Iyy Iyz Izz, m cx, m cy, m cz, m], inertia about the body frame's origin.
"""

from typing import NamedTuple

from flight_math import Mat3, Vec3, cross, diagonal, dot, kernel, mat3, row, skew, stack_array, transpose, vec3
from spacerobot_ros.kinematics import Bodies, body_motion

ZERO = Vec3(0.0, 0.0, 0.0)


class Columns(NamedTuple):
    """Wrench of one body per unit of its ten parameters. Moment per Ixx, Iyy, Izz (``diagonal``), per Ixy, Ixz, Iyz
    (``products``), per h (``first``), per m (``mass``); force per h (``first_force``), per m (``mass_force``)."""

    diagonal: Mat3
    products: Mat3
    first: Mat3
    mass: Vec3
    first_force: Mat3
    mass_force: Vec3


class Row(NamedTuple):
    """Ten neighbouring elements of a row of Y, in the parts of `Columns`."""

    diagonal: Vec3
    products: Vec3
    first: Vec3
    mass: float


@kernel
def products(v):
    """Columns Ixy, Ixz, Iyz of K(v), where I v = K(v) [Ixx Ixy Ixz Iyy Iyz Izz]; the others are diagonal(v)."""
    return Mat3(v.y, v.z, 0.0,
                v.x, 0.0, v.z,
                0.0, v.x, v.y)


@kernel
def acceleration_columns(al, a):
    """Of a body that does not turn yet: f = m a + al x h, n = I al + h x a."""
    return Columns(diagonal(al), products(al), -skew(a), ZERO, skew(al), a)


@kernel
def body_columns(w, w_r, al, a):
    """f = m a + al x h + w x (w_r x h);  n = I al + h x a + w_r x (I w);
    force columns [0, S(al) + S(w) S(w_r), a]; moment columns [K(al) + S(w_r) K(w), -S(a), 0]."""
    turning = skew(w_r)
    return Columns(diagonal(al) + turning @ diagonal(w), products(al) + turning @ products(w), -skew(a), ZERO,
                   skew(al) + skew(w) @ turning, a)


@kernel
def columns_to_parent(tree, i, c):
    """Columns carried through joint ``i``: f_p = R f, n_p = R n + P x (R f). Inertia has no force."""
    rotation, offset = mat3(tree.rotation[i]), vec3(tree.offset[i])
    first_force, mass_force = rotation @ c.first_force, rotation @ c.mass_force
    return Columns(rotation @ c.diagonal, rotation @ c.products, rotation @ c.first + skew(offset) @ first_force,
                   rotation @ c.mass + cross(offset, mass_force), first_force, mass_force)


@kernel
def moment_along(c, axis):
    """Row of the moment about ``axis``."""
    return Row(transpose(c.diagonal) @ axis, transpose(c.products) @ axis, transpose(c.first) @ axis, dot(axis, c.mass))


@kernel
def moment_row(c, k):
    """Row of the moment's component ``k``."""
    return Row(row(c.diagonal, k), row(c.products, k), row(c.first, k), c.mass[k])


@kernel
def force_row(c, k):
    """Row of the force's component ``k``."""
    return Row(ZERO, ZERO, row(c.first_force, k), c.mass_force[k])


@kernel
def put(ten, y, r, b):
    """Ten elements into row ``r`` of ``y``, columns of body ``b``."""
    k = 10 * b
    y[r, k], y[r, k + 3], y[r, k + 5] = ten.diagonal.x, ten.diagonal.y, ten.diagonal.z
    y[r, k + 1], y[r, k + 2], y[r, k + 4] = ten.products.x, ten.products.y, ten.products.z
    y[r, k + 6], y[r, k + 7], y[r, k + 8], y[r, k + 9] = ten.first.x, ten.first.y, ten.first.z, ten.mass


@kernel
def put_moments(c, y, r, b):
    """Three rows from ``r`` on: the moment's components."""
    put(moment_row(c, 0), y, r, b)
    put(moment_row(c, 1), y, r + 1, b)
    put(moment_row(c, 2), y, r + 2, b)


@kernel
def put_forces(c, y, r, b):
    """Three rows from ``r`` on: the force's components."""
    put(force_row(c, 0), y, r, b)
    put(force_row(c, 1), y, r + 1, b)
    put(force_row(c, 2), y, r + 2, b)


@kernel
def clear(y):
    """Fill ``y`` with zeros."""
    for r in range(y.shape[0]):
        for c in range(y.shape[1]):
            y[r, c] = 0.0


@kernel
def regressor(tree, motion, y):
    """Fill ``y`` (6+n, 10(n+1)) so that y pi is the wrench at base and joints of the given `Motion`.

    Columns of a body are carried along its ancestors only; its other joint rows are zero.
    """
    n = len(tree.parent)
    bodies = Bodies(stack_array(n + 1, 3), stack_array(n + 1, 3), stack_array(n + 1, 3), stack_array(n + 1, 3))
    body_motion(tree, motion, bodies)
    clear(y)
    for b in range(n + 1):
        c = body_columns(vec3(bodies.w[b]), vec3(bodies.w_r[b]), vec3(bodies.al_r[b]), vec3(bodies.a_r[b]))
        body = b
        while body > 0:
            i = body - 1
            put(moment_along(c, vec3(tree.axis[i])), y, 6 + i, b)
            c = columns_to_parent(tree, i, c)
            body = tree.parent[i]
        put_forces(c, y, 0, b)
        put_moments(c, y, 3, b)
