"""The lander near a homogeneous polyhedron, a superellipsoid's mesh or a user's own, and its gravity model on board.

Plant and gravity model are those of `sim_nodes.lander.plant` and `sim_nodes.lander.site`; body, surface and field are
those of `sim_nodes.gravity`. A mesh is no parameter: it stands in tables of the state. They have room for 1280 faces; a
scenario with a larger mesh runs with a class of more room (`with_room`), four times as much each, called by it:
``plant_5120``. A superellipsoid's surface is taken in closed form, its gravity from the inscribed mesh with the same mass.
Frames: A is the body's (z along the spin; latitude and longitude are planetocentric), D stands on the surface's normal.
"""

import math
import os
from functools import lru_cache
from pathlib import Path

import numpy as np

from flight_graph.components.records import Array, Choice, field
from flight_graph.errors import FlightError
from flight_graph.scenes.scene import Mesh
from flight_graph.scenes.shapes import rounded, thinned
from flight_math import Mat3, Vec3, kernel
from sim_nodes.gravity import bodies
from sim_nodes.gravity.ellipsoid import site_frame
from sim_nodes.gravity.polyhedron import Polyhedron, evaluate, faces_gravity
from sim_nodes.gravity.superellipsoid import Superellipsoid, exponent_for_volume
from sim_nodes.lander.dynamics import dynamics
from sim_nodes.lander.plant import LanderPlant, LanderPlantParameters, LanderPlantState, motion_kernels
from sim_nodes.lander.site import GravityModel, GravityModelParameters, SiteState, gravity_model

SURFACE_FREQUENCY, SURFACE_FACES = 4, 320  # of the body as it looks
ROOM = 1280  # faces, and vertices; a closed surface in one piece has half as many vertices as faces
GROWTH = 4  # of the room, so that a machine code serves many meshes
BENNU_EXPONENT = exponent_for_volume(*bodies.BENNU_SEMI_AXES, bodies.sphere_volume(bodies.BENNU_MEAN_RADIUS))
RIGHT_ANGLE = 0.5 * math.pi  # [rad]


def polyhedral_parameters(base):
    """The parameters of the plant or of the gravity model, and those of the body."""

    class PolyhedralParameters(base):
        gravity_model: Choice("superellipsoid", "mesh") = field(
            "superellipsoid", doc="semi_axes and exponent as a mesh, or the mesh of a file")
        semi_axes: Vec3 = field(
            bodies.BENNU_SEMI_AXES, unit="m", gt=0, source="Bennu", doc="of the superellipsoid")
        exponent: float = field(BENNU_EXPONENT, unit="1", ge=1, le=50, source="Bennu's volume",
                                doc="of the superellipsoid: 1 a double cone, 2 the ellipsoid")
        mesh_frequency: int = field(
            7, ge=2, le=8,
            doc="of the superellipsoid's mesh: an icosahedron's edges cut into so many parts, 20 n^2 faces")
        mesh: str = field("", doc="Wavefront .obj file of mesh, centred on its mass")
        mesh_scale: float = field(1.0, unit="m", gt=0, doc="of one unit of that file; 1000 for kilometres")
        mu: float = field(
            bodies.BENNU_GM, unit="m^3/s^2", gt=0, source="Bennu", doc="gravitational parameter of the body")
        body_spin: float = field(bodies.BENNU_SPIN, unit="rad/s", source="Bennu, 4.296 h", doc="about z_A")
        site_latitude: float = field(math.radians(25.0), unit="rad", gt=-RIGHT_ANGLE, lt=RIGHT_ANGLE,
                                     doc="of the mark, planetocentric")
        site_longitude: float = field(math.radians(40.0), unit="rad", doc="of the mark")

    return PolyhedralParameters


def polyhedral_state(base, room: int = ROOM):
    """The state of the plant or of the gravity model, and the tables of the mesh. room: for so many faces and vertices."""

    class PolyhedralState(base):
        vertices: Array(room, 3)
        faces: Array(room, 3)
        face_count: int
        strength: float

    return PolyhedralState


@lru_cache(maxsize=8)
def _superellipsoid(mu, semi_axes, exponent, frequency):
    return bodies.SuperellipsoidBody(mu, Superellipsoid(*semi_axes, exponent), frequency)


def body_of(values: dict, where: str):
    """The body (see `sim_nodes.gravity.bodies`) that the parameters name. Raises FlightError."""
    if values["gravity_model"] == "superellipsoid":
        return _superellipsoid(values["mu"], tuple(values["semi_axes"]), values["exponent"], values["mesh_frequency"])
    if not values["mesh"]:
        raise FlightError(f"{where}.mesh: gravity_model mesh needs a Wavefront .obj file")
    try:
        return bodies.from_obj(Path(values["mesh"]), values["mu"], values["mesh_scale"])
    except FlightError as error:
        raise FlightError(f"{where}.mesh: {error}") from None


def room_for(values: dict, where: str) -> int:
    """The room that the tables of these parameters need: `ROOM`, or more by powers of `GROWTH`. Raises FlightError."""
    faces, room = body_of(values, where).polyhedron.faces, ROOM
    while room < max(len(faces), len(np.unique(faces))):
        room *= GROWTH
    return room


def site_of(values: dict, where: str) -> tuple[Vec3, Mat3]:
    """rho [m] in A and R_AD of the goal over the body's surface. Raises FlightError."""
    body, height = body_of(values, where), values["site_height"]
    if height < 0.0:
        raise FlightError(f"{where}.site_height: the landing site lies inside the body: height is {height} m; "
                          "it must be >= 0 m")
    try:
        point, normal = body.surface(values["site_latitude"], values["site_longitude"])
        position, rotation = Vec3(*(point + height * normal)), site_frame(Vec3(*normal))
        require_outside(body.polyhedron, position)
    except FlightError as error:
        raise FlightError(f"{where}: {error}") from None
    return position, rotation


def require_outside(polyhedron: Polyhedron, position) -> None:
    """Refuse a point (3,) [m] inside: there the trace of the gravity gradient is -4 pi G sigma, outside it is 0."""
    turns = -float(np.trace(evaluate(polyhedron, position)[1][0])) / (4.0 * math.pi * polyhedron.strength)
    if turns > 0.9:  # [-] on a face it is 0.5
        place = tuple(round(float(part), 3) for part in position)
        raise FlightError(f"the landing site {place} m lies inside the body; "
                          "another latitude, longitude or height puts it outside")


def located(values: dict, folder: Path | None) -> dict:
    """The values with the mesh file's whole path: a relative one starts at ``folder`` if it is there."""
    if values["gravity_model"] != "mesh" or not values["mesh"]:
        return values
    path = Path(values["mesh"])
    if not path.is_absolute() and folder is not None and os.path.isfile(folder / path):
        path = folder / path
    return {**values, "mesh": str(path.resolve())}


def body_tables(values: dict, where: str, room: int) -> dict:
    """Mesh and site, for the entries of `polyhedral_state`. Raises FlightError."""
    polyhedron = body_of(values, where).polyhedron
    if (needed := room_for(values, where)) > room:
        raise FlightError(f"{where}.mesh: {values['mesh']} has {len(polyhedron.faces)} faces, and this node has room for "
                          f"{room}; start it as {__name__}:{where}_{needed} (a scenario does so by itself)")
    position, rotation = site_of(values, where)
    used, faces = np.unique(polyhedron.faces, return_inverse=True)
    tables = {"vertices": np.zeros((room, 3)), "faces": np.zeros((room, 3)), "face_count": len(polyhedron.faces),
              "strength": polyhedron.strength, "site_position": np.array(position.parts()),
              "site_rotation": np.reshape(rotation.parts(), (3, 3))}
    tables["vertices"][:len(used)] = polyhedron.vertices[used]
    tables["faces"][:len(polyhedron.faces)] = faces.reshape(-1, 3)
    return tables


@kernel
def gravity_of_faces(p, x, place):
    """`faces_gravity` of the tables in the state."""
    return faces_gravity(x.vertices, x.faces, x.face_count, x.strength, place)


@kernel
def prepare_site(p, x):
    """The site stands in the tables already."""


POLYHEDRON = dynamics(gravity_of_faces)


class PolyhedralPlant(LanderPlant):
    """The lander near a rotating polyhedron, a superellipsoid's or a user's mesh: body, thrusters, contact trigger.

    Promises: what lander_plant gives, near a homogeneous polyhedron: a superellipsoid's, or a user's own mesh.

    Bad input: as lander_plant; a mesh that is not closed, too large or no mesh at all is refused before anything runs.
    """

    parameters, state, room = polyhedral_parameters(LanderPlantParameters), polyhedral_state(LanderPlantState), ROOM
    start, update, place = motion_kernels(prepare_site, POLYHEDRON)

    @classmethod
    def resolve(cls, values, where, folder=None):
        return super().resolve(located(values, folder), where, folder)

    @classmethod
    def site(cls, values, where):
        position, rotation = site_of(values, where)
        return position, rotation, Vec3(*evaluate(body_of(values, where).polyhedron, position)[0][0])

    @classmethod
    def surface(cls, values):
        body = body_of(values, "scene")
        if values["gravity_model"] == "superellipsoid":
            return rounded(Mesh(*body.shape.mesh(SURFACE_FREQUENCY))), lambda d: float(body.shape.radius(d))
        site = bodies.direction(values["site_latitude"], values["site_longitude"])
        return thinned(body.polyhedron.vertices, body.polyhedron.faces, SURFACE_FACES), body.radius_near(site)

    @classmethod
    def fitted(cls, values):
        return fitting("plant", cls, values)

    @classmethod
    def tables(cls, values):
        return body_tables(values, "plant", cls.room)


class PolyhedralGravityModel(GravityModel):
    """On-board gravity model near a polyhedron: the true field at the estimated position, times a factor.

    Promises: gravity [m/s^2] at the estimated position, in D: the true field of the polyhedron times `scale`.

    Bad input: it takes the odometry as it is, and before a first one the goal's position. A mesh that is not closed is
    refused before anything runs.
    """

    parameters, state, room = polyhedral_parameters(GravityModelParameters), polyhedral_state(SiteState), ROOM
    start, kernel = None, gravity_model(POLYHEDRON.site_gravity)

    @classmethod
    def resolve(cls, values, where, folder=None):
        values = located(values, folder)
        site_of(values, where)
        return values

    @classmethod
    def fitted(cls, values):
        return fitting("gravity", cls, values)

    @classmethod
    def tables(cls, values):
        return body_tables(values, "gravity", cls.room)


_KINDS = {"plant": (PolyhedralPlant, LanderPlantState, "sim_nodes/lander_polyhedral_plant"),
          "gravity": (PolyhedralGravityModel, SiteState, "sim_nodes/lander_polyhedral_gravity_model")}


def fitting(kind: str, component, values: dict) -> str | None:
    """The name of the class with the room that these parameters need; None where ``component`` has it.

    Raises FlightError.
    """
    room = room_for(values, kind)
    if room == component.room:
        return None
    return _KINDS[kind][2] if room == ROOM else f"{__name__}:{kind}_{room}"


@lru_cache
def with_room(kind: str, room: int):
    """The plant or the gravity model with room for so many faces."""
    base, state, _ = _KINDS[kind]
    return type(base.__name__, (base,), {"__module__": __name__, "__doc__": base.__doc__, "room": room,
                                         "state": polyhedral_state(state, room)})


def __getattr__(name: str):
    """``plant_5120``, ``gravity_20480``: the classes of more room, by their names."""
    kind, _, number = name.partition("_")
    if kind in _KINDS and number.isdecimal() and len(number) < 12 and any(
            int(number) == ROOM * GROWTH**power for power in range(1, 20)):
        return with_room(kind, int(number))
    raise AttributeError(name)
