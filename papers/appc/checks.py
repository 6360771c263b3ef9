"""Statements of the Cubli paper that are no metric of a run: equations against each other, and gravity at Bennu.

Source: Aerospace 2022, 9(11), 728. Each function returns (whether the paper's statement holds, what was found).
"""

import math

import numpy as np

from cubli_ros.attitude import body_rates, cardan_rates, rotation_matrix
from flight_math import Vec3, plain, sincos
from sim_nodes.gravity import bodies
from sim_nodes.gravity.site import effective_gravity

MASS, LENGTH = 2.0, 0.2  # [kg], [m] section 5
PAPER_DENSITY, PAPER_CONSTANT = 2670.0, 6.67e-11  # [kg/m^3], [m^3/(kg s^2)] section 3.1
ANGLES = (-0.3, 0.3, 0.3)  # [rad]
STEP = 1e-6  # [rad] of central differences


def printed_attitude(angles) -> np.ndarray:
    """A (3, 3) of eq. (1), entry by entry as printed."""
    (s1, s2, s3), (c1, c2, c3) = np.sin(angles), np.cos(angles)
    return np.array([[c2 * c3, s1 * s2 * c3 + c1 * s3, -c1 * c3 * s2 + s1 * s3],
                     [-c2 * s3, -s1 * s2 * s3 + c1 * c3, c1 * s2 * s3 + s1 * c3],
                     [s2, -s1 * c2, c1 * c2]])


def attitude_matrix():
    """Eq. (1) is a rotation, and the one that the code has."""
    printed, own = printed_attitude(ANGLES), np.reshape(plain(rotation_matrix)(sincos(Vec3(*ANGLES))).parts(), (3, 3))
    error = max(np.abs(printed @ printed.T - np.eye(3)).max(), abs(np.linalg.det(printed) - 1.0),
                min(np.abs(printed - own).max(), np.abs(printed.T - own).max()))
    return error < 1e-12, f"largest deviation from a rotation, and from the code: {error:.1e}"


def kinematics():
    """Eq. (2) is the kinematics of eq. (1): dA/dt = -[omega] A."""
    omega = np.array([0.1, -0.2, 0.3])  # [rad/s]
    rates = np.array(plain(cardan_rates)(sincos(Vec3(*ANGLES)), Vec3(*omega)))
    change = (printed_attitude(np.array(ANGLES) + STEP * rates) - printed_attitude(np.array(ANGLES) - STEP * rates))
    cross = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    error = np.abs(change / (2.0 * STEP) + cross @ printed_attitude(ANGLES)).max()
    return error < 1e-9, f"largest difference {error:.1e} rad/s"


def printed_moment(angles, gravity, arm) -> np.ndarray:
    """M_g of eq. (4) with r = arm [1, 1, 1]."""
    return np.cross(np.full(3, arm), printed_attitude(angles) @ np.full(3, -MASS * gravity / math.sqrt(3.0)))


def _eigenvalue(arm):
    """Largest eigenvalue [1/s] (by real, then imaginary part) of eq. (2), (4), (5), linearised, at g = 0.002 m/s^2."""
    moments = [(printed_moment(small, 0.002, arm) - printed_moment(-small, 0.002, arm)) / (2.0 * STEP)
               for small in STEP * np.eye(3)]
    stiffness = np.array(moments).T / (MASS * LENGTH * LENGTH / 6.0)
    values = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [stiffness, np.zeros((3, 3))]]))
    return max(values, key=lambda value: (round(value.real, 6), value.imag))


def inverted_pendulum():
    """Eq. (4) with r = -l/2 [1, 1, 1] falls over."""
    printed, standing = _eigenvalue(-LENGTH / 2.0), _eigenvalue(LENGTH / 2.0)
    return printed.real > 1e-6, (f"eigenvalues as printed +-{abs(printed.imag):.4f}i 1/s (it swings); with r = +l/2 "
                                 f"+-{standing.real:.4f} 1/s")


def equal_disturbance_is_seen():
    """A disturbance equal on all axes works against gravity."""
    moment = np.cross(np.full(3, 0.5 * LENGTH), MASS * printed_attitude(ANGLES) @ np.full(3, -0.002))
    along = abs(moment.sum()) / math.sqrt(3.0) / np.linalg.norm(moment)
    return along > 0.1, f"part of M_g along the disturbance: {along:.1e}"


def rate_funnel_as_printed():
    """rho_u = (rho_0 - rho_inf) exp(l) + rho_inf t, as printed, is a funnel that narrows."""
    at_end = (0.1 - 0.005) * math.exp(-0.25) + 0.005 * 60.0
    return at_end < 0.1, f"0.1 rad/s at the start of Table 2's run, {at_end:.3f} rad/s at 60 s"


def inertia_about_corner():
    """I0 = m l^2 / 6 is the inertia of the cube that turns about its corner."""
    theta = MASS * LENGTH**2 * (11.0 / 12.0 * np.eye(3) - 0.25 * np.ones((3, 3)))
    ratio = np.linalg.eigvalsh(theta).max() / (MASS * LENGTH**2 / 6.0)
    return abs(ratio - 1.0) < 0.01, f"a homogeneous cube has {ratio:.2f} times that across its diagonal"


def invertible():
    """Remark 1: G_a is invertible for |theta| < pi / 2: G^-1 G = 1."""
    errors = []
    for theta in np.linspace(-1.5, 1.5, 7):
        turn, rates = sincos(Vec3(0.3, theta, -0.4)), Vec3(0.1, -0.2, 0.3)
        errors.append(max(abs(plain(body_rates)(turn, plain(cardan_rates)(turn, rates)) - rates)))
    return max(errors) < 1e-9, f"largest |G^-1 G omega - omega| up to |theta| = 1.5 rad: {max(errors):.1e} rad/s"


def _surface(gm):
    """Attraction and effective gravity [m/s^2] of the Bennu-shaped body at pole and along the equator: two pairs."""
    body = bodies.top(gm, bodies.BENNU_SEMI_AXES, bodies.BENNU_MEAN_RADIUS)
    found = []
    for latitude, longitudes in ((math.pi / 2.0, (0.0,)), (0.0, np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False))):
        points = [body.surface(latitude, float(longitude))[0] * 1.0002 for longitude in longitudes]
        found.append([np.mean([np.linalg.norm(effective_gravity(body, spin, point)) for point in points])
                      for spin in (0.0, bodies.BENNU_SPIN)])
    return found


def _paper_gm():
    return PAPER_CONSTANT * PAPER_DENSITY * bodies.sphere_volume(bodies.BENNU_MEAN_RADIUS)


def gravity_at_poles():
    """Section 3.1: 2 to 2.6e-3 at the poles."""
    (_, pole), _ = _surface(_paper_gm())
    (_, measured), _ = _surface(bodies.BENNU_GM)
    return 2e-3 <= pole <= 2.6e-3, (f"{pole:.3g} m/s^2 with the paper's own density, {measured:.3g} with the measured "
                                    f"GM; on 2 kg {2.0 * pole:.2g} N")


def gravity_range():
    """Section 3.1: between 1e-4 and 1e-3 m/s^2."""
    (_, pole), (_, equator) = _surface(bodies.BENNU_GM)
    mine = _surface(_paper_gm())
    return equator >= 1e-4 and pole <= 1e-3, (f"{equator:.3g} to {pole:.3g} m/s^2; with the paper's density "
                                              f"{mine[1][1]:.3g} to {mine[0][1]:.3g}")


def simulated_gravity():
    """Section 5.2: g = 0.002 m/s^2 stands for Bennu."""
    (_, pole), _ = _surface(bodies.BENNU_GM)
    return 0.5 < 0.002 / pole < 2.0, f"{0.002 / pole:.0f} times Bennu's largest"


def gravity_largest_at_poles():
    """Section 3.1: gravity is largest at the poles."""
    (_, pole), (_, equator) = _surface(bodies.BENNU_GM)
    return pole > equator, f"pole {pole:.3g}, equator {equator:.3g} m/s^2"


def gravity_because_of_shape():
    """Section 3.1: because the poles are nearer to the centre of mass."""
    (pull_pole, pole), (pull_equator, equator) = _surface(bodies.BENNU_GM)
    share = (pull_pole - pull_equator) / (pole - equator)
    return share > 0.5, f"attraction alone gives {100.0 * share:.0f} % of the difference; the spin gives the rest"
