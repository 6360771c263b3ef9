"""Gravity of a polyhedron against quadrature, the sphere, the ellipsoid, its own derivative and Laplace's equation."""

import math

import numpy as np
import pytest
from scipy.special import beta as scipy_beta

from flight_math import Vec3, uncompiled
from sim_nodes.gravity import mesh
from sim_nodes.gravity.ellipsoid import Ellipsoid, ellipsoid_gravity
from sim_nodes.gravity.polyhedron import Polyhedron, evaluate
from sim_nodes.gravity.superellipsoid import Superellipsoid, beta

RADIUS = 245.0  # [m]
BOX = np.array([2.0, 3.0, 5.0])  # [m] edges of a box with a corner at the origin


def box() -> Polyhedron:
    vertices = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float) * BOX
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    mesh.require_closed(vertices, faces, "box")
    return Polyhedron(vertices, faces, 0.7)


def box_by_quadrature(point, strength=0.7, order=40):
    """Gauss-Legendre over the volume: g = strength int (r' - r) / |r' - r|^3 dV'."""
    node, weight = np.polynomial.legendre.leggauss(order)
    axes = [0.5 * edge * (node + 1.0) for edge in BOX]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) - point
    w = np.einsum("i,j,k->ijk", weight, weight, weight) * BOX.prod() / 8.0
    return strength * (w[..., None] * grid / np.linalg.norm(grid, axis=-1, keepdims=True) ** 3).sum(axis=(0, 1, 2))


@pytest.mark.parametrize("point", [(7.0, 1.0, 2.0), (-1.5, 4.5, 6.0), (1.0, 1.5, 9.0), (1.0, -2.0, 2.5)])
def test_box(point):
    gravity, _ = evaluate(box(), point)
    np.testing.assert_allclose(gravity[0], box_by_quadrature(np.array(point)), rtol=1e-9, atol=1e-13)


def test_gradient_is_the_derivative_and_obeys_laplace_and_poisson():
    body, rng = box(), np.random.default_rng(3)
    outside = rng.uniform(-4.0, 9.0, (40, 3))
    outside = outside[((outside < -0.3) | (outside > BOX + 0.3)).any(axis=1)]
    _, gradient = evaluate(body, outside)
    h = 1e-5  # [m]
    for axis in range(3):
        step = h * np.eye(3)[axis]
        slope = (evaluate(body, outside + step)[0] - evaluate(body, outside - step)[0]) / (2.0 * h)
        np.testing.assert_allclose(gradient[:, :, axis], slope, atol=2e-9)
    assert np.abs(np.trace(gradient, axis1=1, axis2=2)).max() < 1e-13
    _, inside = evaluate(body, [(1.0, 1.0, 1.0), (0.5, 2.5, 4.0)])
    np.testing.assert_allclose(np.trace(inside, axis1=1, axis2=2), -4.0 * math.pi * 0.7, rtol=1e-12)


def test_gravity_is_finite_and_continuous_on_faces_edges_and_vertices():
    body = box()
    for point in [(2.0, 1.0, 1.0), (2.0, 3.0, 1.0), (2.0, 3.0, 5.0), (0.0, 0.0, 0.0), (2.0, 1.5, 2.5)]:
        on, near = evaluate(body, point)[0], evaluate(body, np.array(point) * (1.0 + 1e-9) + 1e-9)[0]
        np.testing.assert_allclose(on, near, atol=1e-6)


# Largest relative error at 1.004, 1.05, 1.5 and 3 radii of a sphere of equal volume, measured with another code.
@pytest.mark.parametrize(("frequency", "errors"), [
    (7, (4.6e-3, 1.6e-3, 1.4e-4, 2e-6)), (16, (7e-4, 3e-4, 3e-5, 4e-7)), (32, (1.3e-4, 7e-5, 7e-6, 1e-7))])
def test_sphere(frequency, errors):
    vertices, faces = mesh.icosphere(frequency)
    assert len(faces) == 20 * frequency**2
    exact = 4.0 / 3.0 * math.pi * RADIUS**3
    vertices = vertices * RADIUS
    vertices = vertices * (exact / mesh.volume(vertices, faces)) ** (1.0 / 3.0)
    directions = np.random.default_rng(1).normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    body = Polyhedron(vertices, faces, 1.0 / exact)
    for ratio, error in zip((1.004, 1.05, 1.5, 3.0), errors):
        gravity, _ = evaluate(body, ratio * RADIUS * directions)
        found = np.linalg.norm(gravity * (ratio * RADIUS) ** 2 + directions, axis=1).max()
        assert found < 1.25 * error
        assert found > 0.25 * error


def test_ellipsoid():
    """A superellipsoid with p = 2 against Carlson's closed form, at and above the surface."""
    shape = Superellipsoid(282.5, 267.5, 254.0, 2.0)
    vertices, faces = shape.mesh(32)
    body = Polyhedron(vertices, faces, 4.8904 / mesh.volume(vertices, faces))
    exact = Ellipsoid(4.8904, Vec3(282.5, 267.5, 254.0))
    for direction, height in [((1, 0, 0), 1.02), ((0.3, -0.5, 0.8), 1.02), ((0.1, 0.7, -0.7), 1.2), ((0, 0, 1), 1.02)]:
        d = np.array(direction) / np.linalg.norm(direction)
        point = height * float(shape.radius(d)) * d
        expected = np.array(ellipsoid_gravity(exact, Vec3(*point)))
        assert np.linalg.norm(evaluate(body, point)[0][0] - expected) < 1.5e-4 * np.linalg.norm(expected)


def test_against_polyhedral_gravity():
    """ESA's polyhedral-gravity (GPL-3, so never a dependency) as an oracle where it happens to be installed."""
    oracle = pytest.importorskip("polyhedral_gravity", reason="polyhedral-gravity is GPL-3 and not installed here")
    vertices, faces = mesh.icosphere(3)
    vertices = vertices * np.array([282.5, 267.5, 254.0])
    solid = oracle.Polyhedron((vertices, faces), 1195.0,
                              integrity_check=oracle.PolyhedronIntegrity.DISABLE)  # its check refuses metres
    point = np.array([300.0, 40.0, -20.0])
    _, expected, _ = oracle.GravityEvaluable(solid)(point, parallel=False)
    body = Polyhedron(vertices, faces, 6.67430e-11 * 1195.0)
    np.testing.assert_allclose(evaluate(body, point)[0][0], expected, rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize(("x", "y"), [(0.04, 1.02), (1.0, 1.5), (1.415, 1.708), (4.0, 3.0)])
def test_beta_function_is_scipys(x, y):
    assert uncompiled(beta)(x, y) == pytest.approx(float(scipy_beta(x, y)), rel=1e-14)


def test_volume_and_normal_of_the_superellipsoid():
    """p = 2: the ellipsoid's 4/3 pi abc; p = 1: a double cone's 2/3 pi abc. The normal is across small steps."""
    for p, factor in ((2.0, 4.0 / 3.0), (1.0, 2.0 / 3.0)):
        assert Superellipsoid(3.0, 4.0, 5.0, p).volume() == pytest.approx(factor * math.pi * 60.0, rel=1e-14)
    shape = Superellipsoid(282.5, 267.5, 254.0, 1.41327)
    for latitude, longitude in [(0.3, 0.2), (-1.0, 2.0), (1.3, -0.5)]:
        def surface(i, j, latitude=latitude, longitude=longitude):
            lat, lon = latitude + i, longitude + j
            d = np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])
            return float(shape.radius(d)) * d
        across = np.cross(surface(0, 1e-5) - surface(0, -1e-5), surface(1e-5, 0) - surface(-1e-5, 0))
        normal = shape.normal(surface(0, 0))
        np.testing.assert_allclose(normal, across / np.linalg.norm(across), atol=1e-8)
