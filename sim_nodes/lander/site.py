"""The landing site of a scenario and the on-board gravity model: for an ellipsoid in closed form.

`prepare_site` makes the frame D of a site on an ellipsoid from its latitude, longitude and height (see
`sim_nodes.gravity.ellipsoid.ellipsoid_site`). `GravityModel` stands in for a table that flight software would carry:
the true field at the estimated position, times a factor.
"""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_math import Mat3, Quaternion, Vec3, atan2, column, kernel, sincos
from msg_schemas import lander
from sim_nodes.gravity.ellipsoid import EROS_LIKE_SPIN, ellipsoid_site
from sim_nodes.lander.dynamics import site_gravity


class SiteState(State):
    """The frame D in A: its origin, and R_AD with columns x_D (east), y_D, z_D (normal)."""

    site_position: Vec3
    site_rotation: Mat3


@kernel
def prepare_site(p, x):
    """Place the site of an ellipsoid's parameters."""
    x.site_position, x.site_rotation = ellipsoid_site(p)


@kernel
def site_orientation(rotation):
    """Quaternion, D to A, of R_AD: about z_A by 90 deg + atan2(up_y, up_x), then about x by the normal's angle from z_A."""
    up = column(rotation, 2)
    heading = 0.5 * (0.5 * math.pi + atan2(up.y, up.x))
    tilt = 0.5 * atan2(math.sqrt(up.x * up.x + up.y * up.y), up.z)
    sin_heading, cos_heading = sincos(heading)
    sin_tilt, cos_tilt = sincos(tilt)
    return Quaternion(cos_heading * sin_tilt, sin_heading * sin_tilt, sin_heading * cos_tilt, cos_heading * cos_tilt)


class GravityModelParameters(Parameters):
    """The body as the on-board model has it; defaults: the reference body (ours)."""

    semi_axes: Vec3 = field((17740.0, 6470.0, 5300.0), unit="m", gt=0, doc="of the ellipsoid")
    mu: float = field(446300.0, unit="m^3/s^2", gt=0, doc="gravitational parameter of the body")
    body_spin: float = field(EROS_LIKE_SPIN, unit="rad/s", doc="about z_A")
    site_latitude: float = field(math.radians(25.0), unit="rad", gt=-0.5 * math.pi, lt=0.5 * math.pi,
                                 doc="parametric latitude of the mark on the ellipsoid")
    site_longitude: float = field(math.radians(40.0), unit="rad", doc="parametric longitude")
    site_height: float = field(1.5, unit="m", ge=0, doc="of the goal above the ground, along its normal")
    scale: float = field(1.0, unit="1", ge=0, doc="factor of the model's error; 1: perfect")


def gravity_model(site_gravity):
    """The model's kernel for a body's `site_gravity` (see `sim_nodes.lander.dynamics.dynamics`)."""

    @kernel
    def model(t_ns, p, x, odometry, gravity):
        """g^D of the model at the position of the odometry [m/s^2]."""
        gravity.accel.linear = p.scale * site_gravity(p, x, odometry.pose.pose.position)

    return model


class GravityModel(Component):
    """On-board gravity model of the landing: the true field at the estimated position, times a factor.

    Promises: gravity [m/s^2] at the estimated position, in D: the true field of the ellipsoid times `scale`.

    Bad input: it takes the odometry as it is, and before a first one the goal's position.
    """

    parameters, state = GravityModelParameters, SiteState
    inputs, outputs = {"odometry": lander.ODOMETRY}, {"gravity": lander.GRAVITY}
    rate_hz = 10.0
    start, kernel = prepare_site, gravity_model(site_gravity)
