"""The parameters by which a plant names its place, and what follows from them before a run.

`resolve_site` fills gravity, tilt, azimuth, gravity_gradient and spin for every model but ``constant``.
"""

import math
import os
from pathlib import Path

from flight_graph.components.records import Choice, Mat3, Parameters, Vec3, field
from flight_graph.errors import FlightError
from sim_nodes.gravity import bodies
from sim_nodes.gravity.site import site

POLE = 1.5708  # [rad] pi/2, as one writes it


class SiteParameters(Parameters):
    gravity_model: Choice("constant", "paper", "point_mass", "bennu", "mesh") = field(
        "constant", doc="where gravity and slope come from: the five parameters below as given, the paper's 0.002 "
                        "m/s^2 on level ground, or a site on a body")
    gravity: float = field(0.002, unit="m/s^2", gt=0, source="section 5.2", doc="size of gravity at the site")
    tilt: float = field(0.0, unit="rad", ge=0, lt=1.5, doc="angle between up (against gravity) and the ground's normal")
    azimuth: float = field(0.0, unit="rad", doc="where that normal leans, from east to north")
    gravity_gradient: Mat3 = field(0.0, unit="1/s^2", doc="of gravity, in the site frame; matters in flight")
    spin: Vec3 = field(0.0, unit="rad/s", doc="of the ground, in the site frame; matters in flight (Coriolis)")
    latitude: float = field(0.0, unit="rad", ge=-POLE, le=POLE, doc="of the site, planetocentric")
    longitude: float = field(0.0, unit="rad", doc="of the site")
    gm: float = field(bodies.BENNU_GM, unit="m^3/s^2", gt=0, source="Bennu", doc="the body's gravitational parameter")
    body_radius: float = field(bodies.BENNU_MEAN_RADIUS, unit="m", gt=0, source="Bennu", doc="of point_mass")
    spin_rate: float = field(bodies.BENNU_SPIN, unit="rad/s", source="Bennu, 4.296 h", doc="of the body about z")
    mesh: str = field("", doc="Wavefront .obj file of mesh, centred where the spin axis crosses the equator's plane")
    mesh_scale: float = field(1.0, unit="m", gt=0, doc="of one unit of that file; 1000 for kilometres")


def resolve_site(values: dict, where: str, folder: Path | None = None) -> dict:
    """The values with the site's gravity filled in. Raises FlightError that names the parameter."""
    model = values["gravity_model"]
    if model == "constant":
        return values
    zero = {"tilt": 0.0, "azimuth": 0.0, "gravity_gradient": [[0.0] * 3] * 3, "spin": [0.0] * 3}
    if model == "paper":
        return {**values, **zero, "gravity": 0.002}  # [m/s^2]
    values = dict(values)
    if model == "point_mass":
        body = bodies.PointMass(values["gm"], values["body_radius"])
    elif model == "bennu":
        body = bodies.top(values["gm"], bodies.BENNU_SEMI_AXES, bodies.BENNU_MEAN_RADIUS)
    else:
        if not values["mesh"]:
            raise FlightError(f"{where}.mesh: gravity_model mesh needs a Wavefront .obj file")
        path = Path(values["mesh"])
        if not path.is_absolute() and folder is not None and os.path.isfile(folder / path):
            path = folder / path
        values["mesh"] = str(path.resolve())
        try:
            body = bodies.from_obj(path.resolve(), values["gm"], values["mesh_scale"])
        except FlightError as error:
            raise FlightError(f"{where}.mesh: {error}") from None
    try:
        place = site(body, values["spin_rate"], values["latitude"], values["longitude"])
    except FlightError as error:
        raise FlightError(f"{where}: {error}") from None
    if place.tilt >= 1.5:
        raise FlightError(f"{where}: the ground at this site leans by {math.degrees(place.tilt):.1f} degrees against "
                          "gravity; allowed: less than 86")
    return {**values, "gravity": place.size, "tilt": place.tilt, "azimuth": place.azimuth,
            "gravity_gradient": place.gradient.tolist(), "spin": place.spin.tolist()}
