"""The landing site of a scenario and the on-board gravity model: for an ellipsoid in closed form.

`prepare_site` makes the frame D of a site on an ellipsoid from its latitude, longitude and height (see
`sim_nodes.ellipsoid_gravity.ellipsoid_site`). `GravityModel` stands in for a table that flight software would carry:
the true field at the estimated position, times a factor.
"""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import lander
from sim_nodes.ellipsoid_gravity import EROS_LIKE_SPIN
from sim_nodes.lander_dynamics import site_gravity


@kernel
def prepare_site(p, x):
    """Site position rho in A [m], R_AD with columns x_D (east), y_D, z_D (normal), its quaternion, spin, into ``x``.

    p: semi_axes, site_latitude, site_longitude, site_height, body_spin.
    """
    unit_x = math.cos(p.site_latitude) * math.cos(p.site_longitude)
    unit_y = math.cos(p.site_latitude) * math.sin(p.site_longitude)
    unit_z = math.sin(p.site_latitude)
    x.site_position[0] = unit_x / p.semi_axes[0]
    x.site_position[1] = unit_y / p.semi_axes[1]
    x.site_position[2] = unit_z / p.semi_axes[2]
    norm = math.sqrt(x.site_position[0] * x.site_position[0] + x.site_position[1] * x.site_position[1]
                     + x.site_position[2] * x.site_position[2])
    up_x, up_y, up_z = x.site_position[0] / norm, x.site_position[1] / norm, x.site_position[2] / norm
    level = math.sqrt(up_x * up_x + up_y * up_y)
    east_x, east_y = -up_y / level, up_x / level
    x.site_rotation[0, 0], x.site_rotation[1, 0], x.site_rotation[2, 0] = east_x, east_y, 0.0
    x.site_rotation[0, 1], x.site_rotation[1, 1] = -up_z * east_y, up_z * east_x
    x.site_rotation[2, 1] = up_x * east_y - up_y * east_x
    x.site_rotation[0, 2], x.site_rotation[1, 2], x.site_rotation[2, 2] = up_x, up_y, up_z
    x.site_position[0] = p.semi_axes[0] * unit_x + p.site_height * up_x
    x.site_position[1] = p.semi_axes[1] * unit_y + p.site_height * up_y
    x.site_position[2] = p.semi_axes[2] * unit_z + p.site_height * up_z
    x.spin = p.body_spin
    # D from A: about z_A by 90 deg + atan2(up_y, up_x), then about x by the angle of the normal from z_A
    heading = 0.5 * (0.5 * math.pi + math.atan2(up_y, up_x))
    tilt = 0.5 * math.atan2(level, up_z)
    x.site_orientation[0] = math.cos(heading) * math.sin(tilt)
    x.site_orientation[1] = math.sin(heading) * math.sin(tilt)
    x.site_orientation[2] = math.sin(heading) * math.cos(tilt)
    x.site_orientation[3] = math.cos(heading) * math.cos(tilt)


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


class GravityModelState(State):
    site_rotation: Array(3, 3)
    site_position: Vec3
    spin: float
    site_orientation: Array(4)
    place: Array(3)
    acceleration: Vec3


def gravity_model(site_gravity):
    """The model's kernel for a body's `site_gravity` (see `sim_nodes.lander_dynamics.dynamics`)."""

    @kernel
    def model(t_ns, p, x, odometry, gravity):
        """g^D of the model at the position of the odometry [m/s^2]."""
        for i in range(3):
            x.place[i] = odometry.pose.pose.position[i]
        site_gravity(p, x, x.place, x.acceleration)
        for i in range(3):
            gravity.accel.linear[i] = p.scale * x.acceleration[i]

    return model


class GravityModel(Component):
    """On-board gravity model of the landing: the true field at the estimated position, times a factor."""

    parameters, state = GravityModelParameters, GravityModelState
    inputs, outputs = {"odometry": lander.ODOMETRY}, {"gravity": lander.GRAVITY}
    rate_hz = 10.0
    start, kernel = prepare_site, gravity_model(site_gravity)
