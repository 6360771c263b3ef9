"""A scene in Rerun: frames as transforms, shapes, arrows, trails, at the times of a bag."""

import numpy as np

from flight_graph.scenes import motion, rotations
from flight_graph.scenes.scene import MAP, Box, Cone, Cylinder, Mesh, Scene, Sphere

ROOT = "scene"
_AXES = 0.3  # length of a frame's axes, of the extent
_CIRCLE = 24  # corners of a circle
_MOST_EDGES = 20_000  # of a mesh that is drawn as a net


def path_of(scene: Scene, frame: str) -> list[str]:
    """The entity of a frame."""
    return [ROOT, MAP, *(one.name for one in scene.path(frame))]


def joined(parts: list[str]) -> str:
    """The path of an entity."""
    from rerun import escape_entity_path_part
    return "/".join(map(escape_entity_path_part, parts))


def log_shapes(rerun, recording, scene: Scene, at_start) -> None:
    """Everything of a scene that stands still in its frame, and joints at zero; of one without shapes the axes of frames.

    at_start: the time columns of the start.
    """
    recording.log([ROOT], rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for frame in scene.frames:
        if frame.is_fixed:
            recording.log(path_of(scene, frame.name), rerun.Transform3D(
                translation=frame.pose.position, quaternion=frame.pose.orientation), static=True)
        elif frame.pose is not None:
            recording.send_columns(joined(path_of(scene, frame.name)), at_start, rerun.Transform3D.columns(
                translation=[frame.pose.position], quaternion=[frame.pose.orientation]))
    for frame in () if scene.shapes else scene.frames:
        recording.log(path_of(scene, frame.name), rerun.TransformAxes3D(_AXES * scene.extent), static=True)
    for shape in scene.shapes:
        entity = [*path_of(scene, shape.frame), shape.name]
        recording.log(entity, rerun.Transform3D(
            translation=shape.pose.position, quaternion=shape.pose.orientation), static=True)
        for archetype in _drawn(rerun, shape):
            recording.log(entity, archetype, static=True)


def _drawn(rerun, shape):
    geometry, colour = shape.geometry, [round(255 * part) for part in shape.colour]
    if isinstance(geometry, Box):
        return [rerun.Boxes3D(half_sizes=[np.array(geometry.size) / 2], colors=[colour], fill_mode="solid")]
    if isinstance(geometry, Cylinder):
        return [rerun.Cylinders3D(lengths=[geometry.length], radii=[geometry.radius], colors=[colour], fill_mode="solid")]
    if isinstance(geometry, Sphere):
        mode = "solid" if shape.colour[3] >= 1.0 else "major_wireframe"
        return [rerun.Ellipsoids3D(half_sizes=[geometry.semi_axes], colors=[colour], fill_mode=mode)]
    if isinstance(geometry, Cone):
        return [rerun.LineStrips3D(cone_lines(geometry), colors=[[*colour[:3], 255]])]
    if isinstance(geometry, Mesh) and shape.colour[3] < 1.0 and shape.kind != "vehicle":
        return [rerun.LineStrips3D(edges(geometry), colors=[[*colour[:3], 255]])]
    return [rerun.Mesh3D(vertex_positions=geometry.vertices, triangle_indices=geometry.faces,
                         vertex_normals=normals(geometry), albedo_factor=colour)]


def cone_lines(cone: Cone) -> list[np.ndarray]:
    """A cone as lines: its rim, and every third ray to it."""
    angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE + 1)
    rim = np.stack([cone.radius * np.cos(angle), cone.radius * np.sin(angle), np.full(len(angle), cone.length)], axis=1)
    return [rim, *(np.stack([np.zeros(3), point]) for point in rim[:-1:3])]


def edges(mesh: Mesh) -> np.ndarray:
    """The edges (k, 2, 3) of a mesh, each once, as many as can be drawn."""
    pairs = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    pairs = np.unique(pairs, axis=0)
    return mesh.vertices[pairs[::max(1, -(-len(pairs) // _MOST_EDGES))]]


def normals(mesh: Mesh) -> np.ndarray:
    """Unit normals (n, 3) of the vertices: those of their faces, weighted by area."""
    corners = mesh.vertices[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.zeros(mesh.vertices.shape)
    for corner in range(3):
        np.add.at(found, mesh.faces[:, corner], across)
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(length > 0.0, length, 1.0)


class MovingScene:
    """What moves of a scene, logged bag by bag. time(stamps_ns): the time columns; thinned(stamps_ns): the rows to keep."""

    def __init__(self, rerun, recording, scene: Scene, time, thinned):
        self._rerun, self._recording, self.scene = rerun, recording, scene
        self._time, self._thinned = time, thinned
        self._tracks, self._ends = {}, {}

    def add(self, bag) -> None:
        """Everything that a bag says of motion. Raises BagError where it says nothing."""
        found = motion.tracks(self.scene, bag)
        said = {name: track for name, track in found.items() if len(track.stamps_ns) > 1 or track.stamps_ns[0]}
        self._tracks |= {name: track for name, track in found.items() if name in said or name not in self._tracks}
        still = {name for name, track in said.items() if self.scene.tree[name].is_fixed and len(track.stamps_ns) == 1}
        for name in still:
            self._recording.log(path_of(self.scene, name), self._rerun.Transform3D(
                translation=said[name].position[0], quaternion=said[name].orientation[0]), static=True)
        moving = {name: track for name, track in said.items() if name not in still}
        for name, track in moving.items():
            rows = self._thinned(track.stamps_ns)
            self._recording.send_columns(
                joined(path_of(self.scene, name)), self._time(track.stamps_ns[rows]),
                self._rerun.Transform3D.columns(translation=track.position[rows], quaternion=track.orientation[rows]))
        for arrow in self.scene.arrows:
            self._arrow(arrow, bag)
        for trail in self.scene.trails:
            self._trail(trail, moving)

    def _arrow(self, arrow, bag):
        if (found := motion.arrow_track(arrow, bag)) is None or not len(found[0]):
            return
        rows = self._thinned(found[0])
        stamps, vectors = found[0][rows], found[1][rows]
        if arrow.axes and arrow.axes != arrow.frame:
            poses = motion.poses_at(self.scene, self._tracks, stamps)
            if not {arrow.axes, arrow.frame} <= poses.keys():
                return
            vectors = rotations.rotate(rotations.inverse(poses[arrow.frame][1]),
                                       rotations.rotate(poses[arrow.axes][1], vectors))
        entity = [*path_of(self.scene, arrow.frame), arrow.name]
        self._recording.log(entity, self._rerun.Arrows3D.from_fields(
            colors=[[round(255 * part) for part in arrow.colour]]), static=True)
        self._recording.send_columns(
            joined(entity), self._time(stamps), self._rerun.Arrows3D.columns(
                vectors=arrow.scale * vectors, origins=np.tile(arrow.origin, (len(stamps), 1))))

    def _trail(self, trail, moving):
        above = [frame.name for frame in self.scene.path(trail.frame)]
        stamps = next((moving[name].stamps_ns for name in reversed(above) if name in moving), None)
        if stamps is None:
            return
        stamps = stamps[self._thinned(stamps)]
        poses = motion.poses_at(self.scene, self._tracks, stamps, trail.seen_in)
        if trail.frame not in poses:
            return
        points = poses[trail.frame][0]
        if trail in self._ends:
            stamps = np.concatenate([stamps[:1], stamps])
            points = np.concatenate([self._ends[trail], points])
        self._ends[trail] = points[-1:]
        entity = [*path_of(self.scene, trail.seen_in), f"trail of {trail.frame}"]
        self._recording.log(entity, self._rerun.LineStrips3D.from_fields(
            colors=[[round(255 * part) for part in trail.colour]]), static=True)
        if len(points) > 1:
            pieces = np.stack([points[:-1], points[1:]], axis=1)
            self._recording.send_columns(joined(entity), self._time(stamps[1:]),
                                         self._rerun.LineStrips3D.columns(strips=list(pieces)))


def trails(scene: Scene) -> list[str]:
    """The entities of the trails, which are shown from the start of the run on."""
    return [joined([*path_of(scene, trail.seen_in), f"trail of {trail.frame}"]) for trail in scene.trails]
