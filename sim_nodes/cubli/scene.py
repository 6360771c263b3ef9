"""What the Cubli rover looks like: a cube on its corner with three reaction wheels, on the ground of its site.

The model's numbers are the dynamics': the whole has the mass m and the inertia m l^2 / 6 about the cube's centre (a solid
cube's, wheels locked), each wheel the inertia J_w about its axis. What the dynamics do not need is chosen so that these
come out: a wheel is a thin ring of radius 0.4 l, which gives its mass, and the cube makes up for where the wheels are.
"""

import math

from flight_graph.errors import FlightError
from flight_graph.scenes.scene import MAP, Arrow, Body, Box, Cylinder, Frame, Joint, Mesh, Pose, Scene, Shape, Sphere, Trail
from flight_graph.scenes.shapes import opposite, pose_of, rounded, thinned, turned
from msg_schemas import cubli
from sim_nodes.gravity import bodies
from sim_nodes.gravity.site import site

RING, SEAT = 0.4, 0.25  # [-] of the edge: radius of a wheel, and where it sits on its axis from the centre
COLOURS = ((0.85, 0.25, 0.2, 1.0), (0.25, 0.65, 0.3, 1.0), (0.2, 0.4, 0.85, 1.0))  # of x, y, z
GROUND, STONE, CASE = (0.45, 0.42, 0.38, 1.0), (0.38, 0.36, 0.34, 1.0), (0.75, 0.77, 0.8, 0.45)
ASTEROID = "asteroid"
SURFACE_FREQUENCY = 4  # of the body's mesh: 320 faces


def scene(values: dict, site_from_balance) -> Scene:
    """The scene of a rover's resolved parameters. site_from_balance: quaternion x, y, z, w."""
    length = values["length"]
    frames = [Frame(cubli.SITE, MAP), Frame(cubli.BALANCE, cubli.SITE, Pose(orientation=tuple(site_from_balance.parts()))),
              Frame(cubli.BASE, cubli.SITE, None), Frame(cubli.IMU_LINK, cubli.BASE)]
    shapes = [Shape("cube", cubli.BASE, Box((length, length, length)), colour=CASE)]
    arrows = []
    for k, name in enumerate(cubli.WHEELS):
        axis = tuple(float(i == k) for i in range(3))
        frames.append(Frame(cubli.WHEEL_LINKS[k], cubli.BASE, Pose(tuple(SEAT * length * part for part in axis)),
                            Joint(name, axis, effort=values["torque_limit"], velocity=values["speed_limit"])))
        shapes += _wheel(k, length)
        arrows.append(Arrow(f"torque of {name}", cubli.TRUTH.topic, "position", cubli.BASE, "N m",
                            0.75 * length / values["torque_limit"], (f"torque[{k}]",), (axis,), tuple(
                                0.5 * length * part for part in axis), colour=COLOURS[k]))
    if "friction" in values:
        arrows.append(Arrow("force of the ground", cubli.TRUTH_CONTACT.topic, "position", cubli.BASE, "N",
                            length / (values["mass"] * values["gravity"]), tuple(f"force[{i}]" for i in range(3)),
                            origin=(-0.5 * length,) * 3, axes=cubli.SITE, colour=(0.95, 0.7, 0.1, 1.0)))
    ground = _ground(values, 10.0 * length)
    found = _asteroid(values)
    return Scene("cubli_rover", cubli.BASE, (*frames, *(frame for frame, _ in found)), _bodies(values),
                 (*shapes, ground, *(shape for _, shape in found)), tuple(arrows), (Trail(cubli.BASE),), 3.0 * length)


def _wheel(k, length):
    """A wheel with its axis along x, y or z, and a mark on it that shows it turning."""
    turn = (turned(1, 0.5 * math.pi), turned(0, -0.5 * math.pi), turned(2, 0.0))[k]
    spoke = [0.2 * RING * length] * 3
    spoke[k], spoke[(k + 1) % 3] = 0.06 * length, 1.9 * RING * length
    return [Shape(cubli.WHEELS[k], cubli.WHEEL_LINKS[k], Cylinder(RING * length, 0.05 * length), Pose(orientation=turn),
                  COLOURS[k]),
            Shape(f"{cubli.WHEELS[k]}_mark", cubli.WHEEL_LINKS[k], Box(tuple(spoke)), colour=(0.95, 0.95, 0.95, 1.0))]


def _bodies(values):
    """Cube and wheels, whose whole is the dynamics' rover; the inertial unit has no mass of its own."""
    mass, length, axial = values["mass"], values["length"], values["wheel_inertia"]
    radius, seat = RING * length, SEAT * length
    wheel = min(axial / (radius * radius), mass / 6.0)  # [kg]
    rest = mass - 3.0 * wheel
    center = -wheel * seat / rest  # [m] of the rest, along each axis, so that the whole has its centre in the middle
    whole = mass * length * length / 6.0
    # Wheel k adds about the cube's centre: J_w or J_w / 2 on the diagonal, and m_w seat^2 across its own axis.
    own = whole - 2.0 * axial - 2.0 * wheel * seat * seat - 2.0 * rest * center * center
    product = rest * center * center
    inertia = tuple(tuple(own if i == j else product for j in range(3)) for i in range(3))
    wheels = (Body(name, wheel, (0.0, 0.0, 0.0), tuple(
        tuple((axial if i == k else 0.5 * axial) if i == j else 0.0 for j in range(3)) for i in range(3)))
        for k, name in enumerate(cubli.WHEEL_LINKS))
    return Body(cubli.BASE, rest, (center, center, center), inertia), *wheels


def _ground(values, radius):
    """The ground at the corner, as far as the rover gets; it leans where the plant's does."""
    thickness = 0.01 * radius
    lean = _lean(values.get("tilt", 0.0), values.get("azimuth", 0.0))
    x, y, z, w = lean
    normal = (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
    return Shape("ground", cubli.SITE, Cylinder(radius, thickness),
                 Pose(tuple(0.0 - 0.5 * thickness * part for part in normal), lean), GROUND, "terrain")


def _lean(tilt, azimuth):
    """Quaternion that takes z to the ground's normal, which leans by tilt towards azimuth [rad]."""
    _, _, sine, cosine = turned(2, 2.0 * azimuth)
    half = turned(1, tilt)
    return 0.0 - half[1] * sine, half[1] * cosine, 0.0, half[3]


def _asteroid(values):
    """The body under the site, where the plant names one: its frame and its surface. Nothing where it cannot be known."""
    model = values.get("gravity_model", "constant")
    if model in ("constant", "paper"):
        return []
    try:
        if model == "point_mass":
            body, surface = bodies.PointMass(values["gm"], values["body_radius"]), Sphere((values["body_radius"],) * 3)
        elif model == "bennu":
            body = bodies.top(values["gm"], bodies.BENNU_SEMI_AXES, bodies.BENNU_MEAN_RADIUS)
            surface = rounded(Mesh(*body.shape.mesh(SURFACE_FREQUENCY)))
        else:
            body = bodies.from_obj(values["mesh"], values["gm"], values["mesh_scale"])
            surface = thinned(body.polyhedron.vertices, body.polyhedron.faces, 320)
        place = site(body, values["spin_rate"], values["latitude"], values["longitude"])
    except FlightError:  # a bag on a machine without its mesh
        return []
    there = opposite(pose_of(place.position, place.to_site.T))
    return [(Frame(ASTEROID, MAP, there), Shape(ASTEROID, ASTEROID, surface, colour=STONE, kind="terrain"))]
