"""The closed-form ellipsoid against scipy's R_D, quadrature, the point mass, Laplace and Poisson; the site's frame."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import elliprd

from flight_math import Vec3
from sim_nodes.gravity.ellipsoid import (
    Ellipsoid,
    carlson_rd,
    checked_ellipsoid_site,
    ellipsoid_gravity,
    ellipsoid_lambda,
    eros_like,
    require_outside,
)

size = st.floats(1e-3, 1e3)


@settings(max_examples=60, deadline=None)
@given(size, size, size)
def test_carlson_rd_is_scipys(x, y, z):
    assert carlson_rd(x, y, z) == pytest.approx(float(elliprd(x, y, z)), rel=5e-15)


def test_carlson_rd_with_a_zero():
    assert carlson_rd(0.0, 2.0, 1.0) == pytest.approx(1.7972103521033883112, rel=5e-15)  # Carlson (1995), section 3


@pytest.mark.parametrize("point", [(14000.0, 5000.0, 3000.0), (-500.0, 9000.0, -100.0), (0.0, 0.0, 5301.0)])
def test_gravity_against_quadrature(point):
    """g_i = -(3/2) mu x_i int_lambda^inf du / [(a_i^2 + u) Delta(u)], lambda by bisection."""
    body = eros_like()
    a2 = np.array(body.semi_axes) ** 2
    x = np.array(point)
    low, high = 0.0, 1e9
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.sum(x**2 / (a2 + middle)) > 1.0 else (low, middle)
    assert ellipsoid_lambda(body.semi_axes, Vec3(*point)) == pytest.approx(low, rel=1e-12, abs=1e-6)

    def integral(i):
        scale = a2[0]  # u = scale s/(1 - s) + lambda takes the half line to [0, 1)
        return quad(
            lambda s: scale
            / (1 - s) ** 2
            / ((a2[i] + low + scale * s / (1 - s)) * math.sqrt(np.prod(a2 + low + scale * s / (1 - s)))),
            0.0,
            1.0,
            epsabs=0.0,
            epsrel=1e-12,
            limit=200,
        )[0]

    expected = [-1.5 * body.mu * x[i] * integral(i) for i in range(3)]
    np.testing.assert_allclose(ellipsoid_gravity(body, Vec3(*point)), expected, rtol=1e-10)


def test_a_sphere_is_a_point_mass_outside_and_linear_inside():
    body = Ellipsoid(mu=5.0, semi_axes=Vec3(2.0, 2.0, 2.0))
    x = np.array([1.5, -2.0, 3.0])
    np.testing.assert_allclose(ellipsoid_gravity(body, Vec3(*x)), -5.0 * x / np.linalg.norm(x) ** 3, rtol=1e-14)
    x = np.array([0.5, 0.2, -0.1])
    np.testing.assert_allclose(ellipsoid_gravity(body, Vec3(*x)), -5.0 / 8.0 * x, rtol=1e-14)


def test_field_is_divergence_free_outside_and_poissons_inside():
    body = Ellipsoid(mu=3.0, semi_axes=Vec3(3.0, 2.0, 1.0))
    step = 1e-4

    def divergence(point):
        total = 0.0
        for i in range(3):
            offset = step * np.eye(3)[i]
            high, low = (ellipsoid_gravity(body, Vec3(*(point + sign * offset))) for sign in (1.0, -1.0))
            total += (high[i] - low[i]) / (2.0 * step)
        return total

    density_mu = 3.0 / (4.0 / 3.0 * math.pi * 6.0)
    assert divergence(np.array([1.0, 2.0, 1.5])) == pytest.approx(0.0, abs=1e-8)
    assert divergence(np.array([0.5, 0.4, 0.2])) == pytest.approx(-4.0 * math.pi * density_mu, rel=1e-8)


def test_field_is_continuous_at_the_surface_and_falls_as_a_point_mass():
    body = eros_like()
    outside, inside = (ellipsoid_gravity(body, Vec3(0.0, 0.0, 5300.0 + step)) for step in (1e-6, -1e-6))
    np.testing.assert_allclose(outside, inside, rtol=1e-8)
    far = np.array([4e8, -3e8, 5e8])
    np.testing.assert_allclose(
        ellipsoid_gravity(body, Vec3(*far)), -body.mu * far / np.linalg.norm(far) ** 3, rtol=1e-8
    )


def site(semi_axes, latitude, longitude, height):
    return checked_ellipsoid_site(SimpleNamespace(semi_axes=Vec3(*semi_axes), site_latitude=latitude,
                                                  site_longitude=longitude, site_height=height))


def test_site_frame_is_right_handed_and_normal_to_the_surface():
    axes = np.array(eros_like().semi_axes)
    rho, rotation = site(axes, 0.3, -2.0, 0.0)
    rho, rotation = np.array(rho), np.reshape(rotation.parts(), (3, 3))
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), rtol=0.0, atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert np.sum((rho / axes) ** 2) == pytest.approx(1.0)
    gradient = rho / axes**2
    np.testing.assert_allclose(np.cross(rotation[:, 2], gradient), 0.0, rtol=0.0, atol=1e-18)
    assert rotation[2, 0] == 0.0 and rotation[:, 2] @ gradient > 0.0


def test_bad_sites_are_refused():
    with pytest.raises(ValueError, match="inside the body"):
        site([3.0, 2.0, 1.0], 0.1, 0.1, -1.0)
    with pytest.raises(ValueError, match="inside the body"):
        require_outside(Vec3(3.0, 2.0, 1.0), Vec3(0.0, 0.0, 0.9))
    with pytest.raises(ValueError, match="semi_axes"):
        site([3.0, 0.0, 1.0], 0.1, 0.1, 1.0)
    with pytest.raises(ValueError, match="latitude"):
        site([3.0, 2.0, 1.0], math.pi / 2, 0.1, 1.0)
