"""Rigid-body dynamics of the tree: inverse dynamics, mass matrix, the mass matrix with linear momentum eliminated.

Source: Aerospace 2023, 10(8), 679, equations (16)-(20), (26), written in the inertial parameters pi (ten per body,
see `spacerobot_ros.regressor`). Generalised accelerations are [a (base origin, base axes), omega_dot, theta_ddot],
wrenches [base force (N), base moment (N m), joint torques (N m)].
"""

from typing import NamedTuple

from flight_math import Mat3, Vec3, cross, dot, identity3, kernel, mat3, outer, skew, stack_array, transpose, vec3
from spacerobot_ros.kinematics import Bodies, body_motion, to_parent


class Inertia(NamedTuple):
    """A body's parameters about the origin of its frame, its axes: inertia I [kg m^2], first moment h [kg m], mass m."""

    tensor: Mat3
    moment: Vec3
    mass: float


@kernel
def body_inertia(pi, b):
    """Body ``b`` of a parameter vector (10(n+1),)."""
    k = 10 * b
    tensor = Mat3(pi[k], pi[k + 1], pi[k + 2],
                  pi[k + 1], pi[k + 3], pi[k + 4],
                  pi[k + 2], pi[k + 4], pi[k + 5])
    return Inertia(tensor, Vec3(pi[k + 6], pi[k + 7], pi[k + 8]), pi[k + 9])


@kernel
def add_inertia(pi, b, inertia):
    """Add to body ``b`` of a parameter vector what becomes part of it."""
    k = 10 * b
    for row in range(3):
        for column in range(row, 3):
            pi[k] += inertia.tensor[row, column]
            k += 1
    for row in range(3):
        pi[k + row] += inertia.moment[row]
    pi[k + 3] += inertia.mass


@kernel
def total_mass(pi):
    """Mass of all bodies [kg]."""
    mass = 0.0
    for b in range(len(pi) // 10):
        mass += pi[10 * b + 9]
    return mass


@kernel
def body_wrench(inertia, w, w_r, al_r, a_r):
    """f = m a + al x h + w x (w_r x h);  n = I al + h x a + w_r x (I w): force and moment about the body's origin."""
    tensor, h, m = inertia
    return (m * a_r + cross(al_r, h) + cross(w, cross(w_r, h)),
            tensor @ al_r + cross(h, a_r) + cross(w_r, tensor @ w))


@kernel
def inverse_dynamics(tree, pi, motion, wrench):
    """Newton-Euler, equations (16)-(20): ``wrench`` (6+n,) = Y pi without forming Y, of a `Motion`."""
    n = len(tree.parent)
    bodies = Bodies(stack_array(n + 1, 3), stack_array(n + 1, 3), stack_array(n + 1, 3), stack_array(n + 1, 3))
    forces, moments = stack_array(n + 1, 3), stack_array(n + 1, 3)
    body_motion(tree, motion, bodies)
    for b in range(n + 1):
        forces[b], moments[b] = body_wrench(
            body_inertia(pi, b), vec3(bodies.w[b]), vec3(bodies.w_r[b]), vec3(bodies.al_r[b]), vec3(bodies.a_r[b]))
    for i in range(n - 1, -1, -1):
        b, moment = tree.parent[i], vec3(moments[i + 1])
        wrench[6 + i] = dot(vec3(tree.axis[i]), moment)
        force, moment = to_parent(tree, i, vec3(forces[i + 1]), moment)
        forces[b] = vec3(forces[b]) + force
        moments[b] = vec3(moments[b]) + moment
    wrench[0:3] = vec3(forces[0])
    wrench[3:6] = vec3(moments[0])


@kernel
def carried_inertia(tree, i, inertia):
    """Body i+1 seen from its parent: R I R^T + 2 (P.g) E - P g^T - g P^T + m (P.P E - P P^T), g = R h."""
    rotation, offset = mat3(tree.rotation[i]), vec3(tree.offset[i])
    tensor, h, m = inertia
    g = rotation @ h
    moved = (rotation @ tensor @ transpose(rotation) + (2.0 * dot(offset, g) + m * dot(offset, offset)) * identity3()
             - outer(offset, g) - outer(g, offset) - m * outer(offset, offset))
    return Inertia(moved, g + m * offset, m)


@kernel
def composite_parameters(tree, pi, composite):
    """``composite`` (10(n+1),): parameters of each body and all that it carries, about its origin, in its axes."""
    for k in range(len(pi)):
        composite[k] = pi[k]
    for i in range(len(tree.parent) - 1, -1, -1):
        add_inertia(composite, tree.parent[i], carried_inertia(tree, i, body_inertia(composite, i + 1)))


@kernel
def mass_matrix(tree, pi, h):
    """Composite-rigid-body algorithm: ``h`` (6+n, 6+n) of [a, omega_dot, theta_ddot] (equation (26) with force rows)."""
    n = len(tree.parent)
    composite = stack_array(10 * (n + 1))
    composite_parameters(tree, pi, composite)
    whole = body_inertia(composite, 0)
    coupling = skew(whole.moment)
    for row in range(3):
        for column in range(3):
            h[row, column] = whole.mass if row == column else 0.0
            h[row, 3 + column] = coupling[column, row]
            h[3 + row, 3 + column] = whole.tensor[row, column]
    for i in range(n):
        _joint_column(tree, composite, i, h)
    for row in range(6 + n):
        for column in range(row):
            h[row, column] = h[column, row]


@kernel
def _joint_column(tree, composite, i, h):
    """Column 6+i, down to the diagonal: wrench of joint i's composite body under a unit joint acceleration."""
    for row in range(i):
        h[6 + row, 6 + i] = 0.0
    carried, axis = body_inertia(composite, i + 1), vec3(tree.axis[i])
    force, moment = cross(axis, carried.moment), carried.tensor @ axis
    b = i + 1
    while b > 0:
        j = b - 1
        h[6 + j, 6 + i] = dot(vec3(tree.axis[j]), moment)
        force, moment = to_parent(tree, j, force, moment)
        b = tree.parent[j]
    for row in range(3):
        h[row, 6 + i] = force[row]
        h[3 + row, 6 + i] = moment[row]


@kernel
def reduced_mass_matrix(h, reduced):
    """M_r = H_qq - H_ql H_lq / M, shape (3+n, 3+n): linear momentum eliminated (l: base translation, H_ll = M E)."""
    size = len(reduced)
    for row in range(size):
        for column in range(size):
            value = h[3 + row, 3 + column]
            for k in range(3):
                value -= h[k, 3 + row] * h[k, 3 + column] / h[k, k]
            reduced[row, column] = value
