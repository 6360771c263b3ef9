"""What section 3.1 of the Cubli paper says of Bennu's gravity, against a homogeneous body of Bennu's axes and mass.

Source: Aerospace 2022, 9(11), 728, section 3.1; the body is that of `sim_nodes.gravity.bodies`. Checks as in
`papers.appc.checks`; factor: mass of both bodies over what it is; spin: over Bennu's.
"""

import math

import numpy as np

from papers.appc.printed_law import GRAVITY
from sim_nodes.gravity import bodies
from sim_nodes.gravity.site import effective_gravity, site

PAPER_DENSITY, PAPER_CONSTANT = 2670.0, 6.67e-11  # [kg/m^3], [m^3/(kg s^2)] section 3.1
RANGE = (1e-4, 1e-3)  # [m/s^2] section 3.1
GM = {"measured mass": bodies.BENNU_GM,
      "the paper's density": PAPER_CONSTANT * PAPER_DENSITY * bodies.sphere_volume(bodies.BENNU_MEAN_RADIUS)}


def by_latitude(degrees, gm=bodies.BENNU_GM, spin=1.0) -> list[float]:
    """Gravity [m/s^2] just above the ground at latitudes, each the mean over eight longitudes."""
    body = bodies.top(gm, bodies.BENNU_SEMI_AXES, bodies.BENNU_MEAN_RADIUS)
    longitudes = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
    return [float(np.mean([np.linalg.norm(effective_gravity(
        body, spin * bodies.BENNU_SPIN, body.surface(math.radians(latitude), float(longitude))[0] * 1.0002))
        for longitude in longitudes])) for latitude in degrees]


def density(gm=bodies.BENNU_GM):
    """Bennu's density from its mass (gm [m^3/s^2]) and volume, against 2670 kg/m^3."""
    found = gm / PAPER_CONSTANT / bodies.sphere_volume(bodies.BENNU_MEAN_RADIUS)
    return abs(found / PAPER_DENSITY - 1.0) < 0.05, f"{found:.0f} kg/m^3"


def gravity_at_poles(factor=1.0):
    """Between 2e-3 and 2.6e-3 at the poles."""
    found = {}
    for label, gm in GM.items():
        pole, = by_latitude([90], factor * gm)
        found[label] = 2e-3 <= pole <= 2.6e-3, f"{pole:.3g} m/s^2; on 2 kg {2.0 * pole:.2g} N"
    return found


def gravity_range(factor=1.0):
    """Between 1e-4 and 1e-3 m/s^2 everywhere."""
    found = {}
    for label, gm in GM.items():
        pole, equator = by_latitude([90, 0], factor * gm)
        found[label] = RANGE[0] <= equator and pole <= RANGE[1], f"{equator:.3g} to {pole:.3g} m/s^2"
    return found


def simulated_gravity(gravity=GRAVITY):
    """The gravity of section 5.2 [m/s^2] is Bennu's, at its poles, within a factor of two."""
    found = {}
    for label, gm in GM.items():
        pole, = by_latitude([90], gm)
        found[label] = 0.5 < gravity / pole < 2.0, f"{gravity / pole:.0f} times that of the poles"
    return found


def simulated_in_range(gravity=GRAVITY):
    """The gravity of section 5.2 [m/s^2] is in the range of section 3.1."""
    return RANGE[0] <= gravity <= RANGE[1], f"{gravity:g} m/s^2 against {RANGE[0]:g} to {RANGE[1]:g} m/s^2"


def gravity_largest_at_poles(spin=1.0):
    """Largest at the poles, and smaller the nearer to the equator."""
    degrees = [90, 60, 45, 30, 15, 0]
    found = by_latitude(degrees, spin=spin)
    return all(a > b for a, b in zip(found, found[1:])), ", ".join(
        f"{latitude} degrees {1e5 * value:.2f}" for latitude, value in zip(degrees, found, strict=True)) + "e-5 m/s^2"


def gravity_cause(spin=1.0):
    """Two causes, each of which makes a tenth of the difference between poles and equator or more."""
    pole, equator = by_latitude([90, 0], spin=spin)
    still_pole, still_equator = by_latitude([90, 0], spin=0.0)
    shape = (still_pole - still_equator) / (pole - equator)
    return {"the poles are nearer to the centre": (abs(shape) > 0.1, f"{100.0 * shape:.0f} % of the difference"),
            "it turns about the line of the poles": (abs(1.0 - shape) > 0.1, f"{100.0 * (1.0 - shape):.0f} %")}


def sites(latitudes):
    """Sites of Bennu at latitudes [rad], longitude zero."""
    return [site(bodies.bennu(), bodies.BENNU_SPIN, latitude, 0.0) for latitude in latitudes]


def gravity_not_along_normal(latitude=0.7854):
    """Gravity leans from the ground's normal by more than a degree at a latitude [rad]."""
    tilt = math.degrees(sites([latitude])[0].tilt)
    return tilt > 1.0, f"slope of {tilt:.1f} degrees"


def gravity_over_the_rover(edge=0.15):
    """Gravity changes by less than 1 % over an edge [m], at pole, 45 degrees and equator."""
    change = max(edge * np.abs(np.linalg.eigvalsh(one.gradient)).max() / one.size
                 for one in sites((0.5 * math.pi, 0.25 * math.pi, 0.0)))
    return change < 0.01, f"{100.0 * change:.2f} % at most"
