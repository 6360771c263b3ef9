"""Inertial parameters of a body: physical consistency, pseudo-inertia, and the wrong priors of equation (46).

Per body ten numbers pi = [Ixx Ixy Ixz Iyy Iyz Izz, m cx, m cy, m cz, m]: tensor elements (products carry the tensor's
sign) about the origin of the body's frame [kg m^2], first moments [kg m], mass [kg]. A body made of positive masses
has a positive-definite pseudo-inertia P = [[S, h], [h^T, m]], S = 1/2 tr(I) E - I (Wensing, Kim, Slotine 2018).
"""

import numpy as np

from flight_graph.errors import FlightError

NAMES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "hx", "hy", "hz", "m")


class ModelError(FlightError):
    """A robot model that cannot be: the sentence names the body or joint, what is wrong and what is allowed."""


def tensor(six) -> np.ndarray:
    """Symmetric (3, 3) matrix of the six elements [xx, xy, xz, yy, yz, zz]."""
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)


def body_parameters(mass: float, center_of_mass, inertia_about_center) -> np.ndarray:
    """pi (10,) of one body from mass [kg], centre of mass (3,) [m], inertia (3, 3) about it [kg m^2], body axes."""
    c = np.asarray(center_of_mass, float)
    about_origin = np.asarray(inertia_about_center, float) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.concatenate([about_origin[np.triu_indices(3)], mass * c, [mass]])


def pseudo_inertia(pi) -> np.ndarray:
    """Pseudo-inertia (4, 4) of one body's ten parameters."""
    inertia = tensor(pi[:6])
    result = np.empty((4, 4))
    result[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    result[:3, 3] = result[3, :3] = pi[6:9]
    result[3, 3] = pi[9]
    return result


def smallest_pseudo_inertia_eigenvalues(pi) -> np.ndarray:
    """Smallest eigenvalue of each body's pseudo-inertia, shape (bodies,); positive for a body that can exist."""
    return np.array([np.linalg.eigvalsh(pseudo_inertia(body))[0] for body in np.reshape(pi, (-1, 10))])


def check_body(name: str, mass: float, inertia_about_center) -> None:
    """Refuse a body without mass or with an inertia that no mass distribution has. Raises `ModelError`."""
    inertia = np.asarray(inertia_about_center, float)
    if not np.isfinite(mass) or not np.all(np.isfinite(inertia)):
        raise ModelError(f"body '{name}': mass and inertia must be finite numbers")
    if mass <= 0.0:
        raise ModelError(f"body '{name}': mass is {mass:g} kg; every body needs a positive mass")
    principal = np.linalg.eigvalsh(inertia)
    if principal[0] <= 0.0:
        raise ModelError(f"body '{name}': principal moment of inertia {principal[0]:g} kg m^2; all must be positive")
    if principal[2] >= principal[0] + principal[1]:
        raise ModelError(
            f"body '{name}': principal moments of inertia {principal[0]:g}, {principal[1]:g}, {principal[2]:g} kg m^2 "
            "break the triangle inequality (the largest must be less than the sum of the others), so its "
            "pseudo-inertia is not positive definite"
        )


def prior(pi, eta: float, seed: int, reading: str = "standard_deviation") -> np.ndarray:
    """Wrong parameters known before flight, equation (46): pi_prior ~ N(pi, eta pi / 3), one draw for ``seed``.

    ``reading``: the text calls eta pi / 3 a standard deviation ("three-time standard deviation"); "variance" takes it
    as the second argument of N(mean, variance), sigma = sqrt(eta |pi| / 3) in the SI number of each parameter.
    """
    pi = np.asarray(pi, float)
    if not 0.0 <= eta < np.inf:
        raise ModelError(f"prior: eta is {eta!r}; it must be a finite number, 0 or more")
    z = np.random.default_rng(seed).standard_normal(pi.shape[0])
    if reading == "standard_deviation":
        return pi * (1.0 + eta / 3.0 * z)
    if reading == "variance":
        return pi + np.sqrt(eta / 3.0 * np.abs(pi)) * z
    raise ModelError(f"prior: reading is {reading!r}; allowed: 'standard_deviation', 'variance'")
