"""What a vehicle looks like, where its frames are, and what moves them: plain data for every viewer.

A component declares its scene as a classmethod ``scene(values) -> Scene`` of its resolved parameters; `scene_of` collects
those of a scenario, `scene_of_bag` those of the scenario that a bag carries. From a scene come the URDF text
(`flight_graph.scenes.urdf`), latched markers and transforms (`flight_graph.scenes.messages`), and the poses, arrows and
trails over a bag (`flight_graph.scenes.motion`).

Frames form one tree whose root is ``map`` (REP 105): level, x east, y north, z up (REP 103), where the ground is. Units SI;
a pose turns and shifts the coordinates of a frame into those of its parent; quaternions are x, y, z, w.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from flight_graph.components.namespaces import MAP, frame_within, topic_within
from flight_graph.errors import FlightError

Colour = tuple[float, float, float, float]  # red, green, blue, opacity, from 0 to 1


@dataclass(frozen=True)
class Pose:
    """Where a frame stands in its parent: origin (3,) [m], and the quaternion x, y, z, w from its axes to the parent's."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Joint:
    """How a frame turns about an axis (3,) of its own; continuous where it has no limits. name: as in ``/joint_states``."""

    name: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    lower: float | None = None  # [rad]
    upper: float | None = None  # [rad]
    effort: float | None = None  # [N m] largest; None: without a limit
    velocity: float | None = None  # [rad/s] likewise


@dataclass(frozen=True)
class Frame:
    """A frame of the tree. pose: where it is fixed, or where it stands with its joint at zero; None: it moves freely.

    Everything that moves is said on ``/tf`` of a bag, frame by frame.
    """

    name: str
    parent: str
    pose: Pose | None = Pose()
    joint: Joint | None = None

    @property
    def is_fixed(self) -> bool:
        """Whether it stands still in its parent: a pose, and no joint."""
        return self.pose is not None and self.joint is None


@dataclass(frozen=True)
class Box:
    """A box about its frame's origin. size: full lengths (3,) [m] along x, y, z."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about its frame's origin, along z. [m]"""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """An ellipsoid about its frame's origin. semi_axes: (3,) [m] along x, y, z."""

    semi_axes: tuple[float, float, float]


@dataclass(frozen=True)
class Cone:
    """A cone with its tip at its frame's origin, opening along +z to the radius at the length. [m]"""

    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: vertices (n, 3) [m], faces (m, 3) of indices, counter-clockwise seen from outside."""

    vertices: np.ndarray
    faces: np.ndarray


Geometry = Box | Cylinder | Sphere | Cone | Mesh


@dataclass(frozen=True, eq=False)
class Shape:
    """A geometry that stands still in a frame. kind: ``vehicle`` (it goes into the URDF), ``terrain``, ``view`` (what a
    camera sees) or ``funnel`` (what a law keeps within)."""

    name: str
    frame: str
    geometry: Geometry
    pose: Pose = Pose()
    colour: Colour = (0.7, 0.7, 0.72, 1.0)
    kind: str = "vehicle"


@dataclass(frozen=True, eq=False)
class Body:
    """The mass of a frame. center_of_mass (3,) [m], inertia (3, 3) about it [kg m^2], both in the frame's axes."""

    frame: str
    mass: float
    center_of_mass: tuple[float, float, float]
    inertia: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Arrow:
    """A vector of a topic, drawn from a point of a frame; its length is scale times its size.

    field: path of the numbers in the message (``wrench.force``, ``effort``); names: entries of a message that names its
    numbers (``torque[0]``), in place of all; directions (k, 3): the vector is the sum of number k times direction k, in
    the axes of ``axes`` (of ``frame`` where empty). unit: of the vector; scale: [m] a unit.
    """

    name: str
    topic: str
    field: str
    frame: str
    unit: str
    scale: float
    names: tuple[str, ...] = ()
    directions: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axes: str = ""
    colour: Colour = (0.9, 0.2, 0.1, 1.0)


@dataclass(frozen=True)
class Trail:
    """The path of a frame's origin, seen in another frame."""

    frame: str
    seen_in: str = MAP
    colour: Colour = (0.2, 0.5, 0.9, 1.0)


@dataclass(frozen=True)
class Scene:
    """All that is to be seen. base: the frame that carries the vehicle, root of its URDF; extent: [m] what to look at."""

    name: str
    base: str
    frames: tuple[Frame, ...]
    bodies: tuple[Body, ...] = ()
    shapes: tuple[Shape, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    trails: tuple[Trail, ...] = ()
    extent: float = 1.0
    tree: dict[str, Frame] = field(init=False, compare=False)

    def __post_init__(self):
        tree = {frame.name: frame for frame in self.frames}
        object.__setattr__(self, "tree", tree)
        if len(tree) < len(self.frames):
            raise FlightError(f"scene {self.name}: two frames share a name")
        for frame in self.frames:
            _require_rooted(self, frame)
        used = [*((body.frame, "body") for body in self.bodies), (self.base, "base"),
                *((shape.frame, f"shape {shape.name}") for shape in self.shapes),
                *((name, f"arrow {arrow.name}") for arrow in self.arrows for name in (arrow.frame, arrow.axes) if name),
                *((name, "trail") for trail in self.trails for name in (trail.frame, trail.seen_in))]
        for name, what in used:
            if name != MAP and name not in tree:
                raise FlightError(f"scene {self.name}: the {what} is in a frame '{name}' that there is not; there are "
                                  f"{', '.join([MAP, *tree])}")

    def path(self, frame: str) -> list[Frame]:
        """The frames from below ``map`` down to this one."""
        found = []
        while frame != MAP:
            found.append(self.tree[frame])
            frame = self.tree[frame].parent
        return found[::-1]

    @property
    def links(self) -> list[str]:
        """The frames that the base carries by joints or fixed, the base first: the links of its URDF, parents first."""
        found = [self.base]
        for name in found:
            found += [frame.name for frame in self.frames if frame.parent == name and frame.pose is not None]
        return found

    def within(self, namespace: str) -> "Scene":
        """The scene of a component inside a namespace: its frames and topics there."""
        def moved(part, *frames, **more):
            return replace(part, **{name: frame_within(getattr(part, name), namespace) for name in frames}, **more)

        return replace(
            self, base=frame_within(self.base, namespace),
            frames=tuple(moved(one, "name", "parent") for one in self.frames),
            bodies=tuple(moved(one, "frame") for one in self.bodies),
            shapes=tuple(moved(one, "frame") for one in self.shapes),
            arrows=tuple(moved(one, "frame", "axes", topic=topic_within(one.topic, namespace),
                               name=f"{one.name}, {namespace}") for one in self.arrows),
            trails=tuple(moved(one, "frame", "seen_in") for one in self.trails))

    def joined(self, other: "Scene") -> "Scene":
        """Both scenes as one; frames that are in both alike are one frame. Raises FlightError where they differ."""
        for frame in other.frames:
            if self.tree.get(frame.name, frame) != frame:
                raise FlightError(f"scenes {self.name} and {other.name} place the frame '{frame.name}' differently")
        new = tuple(frame for frame in other.frames if frame.name not in self.tree)
        return Scene(self.name, self.base, self.frames + new, self.bodies + other.bodies, self.shapes + other.shapes,
                     self.arrows + other.arrows, self.trails + other.trails, max(self.extent, other.extent))


def _require_rooted(scene, frame):
    """Refuse a frame that does not hang below ``map``."""
    seen, name = [], frame.name
    while name != MAP:
        if name not in scene.tree:
            raise FlightError(f"scene {scene.name}: the parent '{name}' of frame '{seen[-1]}' is no frame; "
                              f"the root is {MAP}")
        if name in seen:
            raise FlightError(f"scene {scene.name}: the frames {' -> '.join([*seen, name])} form a loop; "
                              f"all hang below {MAP}")
        seen.append(name)
        name = scene.tree[name].parent
