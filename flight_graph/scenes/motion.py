"""Where the frames of a scene are over a bag, and what its arrows show: arrays over stamps, for any viewer.

Poses come from ``/tf_static`` and ``/tf``; where those have nothing of a frame, from ``/joint_states`` (a frame with a
joint) or from an odometry that names it; else a fixed frame stands where the scene puts it, a joint at zero. What cannot be
known is left out.
"""

from dataclasses import dataclass

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.fields import entry_names
from flight_graph.bags.reader import Bag
from flight_graph.scenes import rotations
from flight_graph.scenes.scene import MAP, Arrow, Frame, Pose, Scene
from flight_graph.scenes.transform_reader import read_transforms

TF, TF_STATIC, JOINT_STATES = "/tf", "/tf_static", "/joint_states"


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of a frame in its parent's axes: stamps_ns (n,) rising, log times; position (n, 3) [m]; orientation (n, 4),
    quaternions x, y, z, w. A frame that is fixed has one pose."""

    stamps_ns: np.ndarray
    position: np.ndarray
    orientation: np.ndarray

    def at(self, stamps_ns) -> tuple[np.ndarray, np.ndarray]:
        """Position (m, 3) and orientation (m, 4) at stamps [ns]: interpolated, held before the first and after the last."""
        stamps_ns = np.asarray(stamps_ns, np.int64)
        after = np.clip(np.searchsorted(self.stamps_ns, stamps_ns, "right"), 1, max(1, len(self.stamps_ns) - 1))
        before = after - 1
        after = np.minimum(after, len(self.stamps_ns) - 1)
        span = self.stamps_ns[after] - self.stamps_ns[before]
        part = np.clip((stamps_ns - self.stamps_ns[before]) / np.where(span > 0, span, 1), 0.0, 1.0)[:, None]
        position = (1.0 - part) * self.position[before] + part * self.position[after]
        return position, rotations.slerp(self.orientation[before], self.orientation[after], part)


def tracks(scene: Scene, bag: Bag) -> dict[str, Track]:
    """Frame -> its poses in its parent, of all frames whose place is known. Raises BagError where nothing moves them."""
    said, found = _transforms(bag), {}
    for frame in scene.frames:
        track = said.get((frame.parent, frame.name)) or _by_joint(bag, frame) or _by_odometry(bag, frame)
        if track is None and frame.pose is not None:
            track = _still(frame.pose)
        if track is not None:
            found[frame.name] = track
    if any(frame.pose is None for frame in scene.frames) and not any(
            frame.name in found for frame in scene.frames if frame.pose is None):
        raise BagError(f"bag '{bag.path}': it has no transforms on {TF} and no odometry of the frames that move "
                       f"({', '.join(frame.name for frame in scene.frames if frame.pose is None)}); a run records "
                       f"{TF} with the topics that it is made from")
    return found


def poses_at(scene: Scene, found: dict[str, Track], stamps_ns, seen_in: str = MAP) -> dict[str, tuple]:
    """Frame -> (position (n, 3) [m], orientation (n, 4) x, y, z, w) in the axes of ``seen_in``, at stamps (n,) [ns].

    found: as of `tracks`; frames that hang below one that is not in it are left out. Raises BagError where
    ``seen_in`` has no place.
    """
    count = len(stamps_ns)
    placed = {MAP: (np.zeros((count, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))}

    def place(name):
        if name not in placed:
            parent = scene.tree[name].parent
            if name in found and place(parent):
                position, orientation = found[name].at(stamps_ns)
                origin, turn = placed[parent]
                placed[name] = origin + rotations.rotate(turn, position), rotations.multiply(turn, orientation)
        return name in placed

    for frame in scene.frames:
        place(frame.name)
    if seen_in not in placed:
        raise BagError(f"the frame '{seen_in}' has no place in this bag; there are {', '.join(placed)}")
    if seen_in == MAP:
        return placed
    origin, turn = placed[seen_in]
    back = rotations.inverse(turn)
    return {name: (rotations.rotate(back, position - origin), rotations.multiply(back, orientation))
            for name, (position, orientation) in placed.items()}


def arrow_track(arrow: Arrow, bag: Bag) -> tuple[np.ndarray, np.ndarray] | None:
    """(stamps (n,) [ns], vectors (n, 3) in the axes that the arrow names, in its unit), or None where the bag has not got
    its numbers."""
    topic = f"/{arrow.topic.lstrip('/')}"
    if topic not in bag:
        return None
    try:
        numbers = bag[topic]
        for part in arrow.field.split("."):
            numbers = numbers[part]
    except (BagError, ValueError, IndexError, KeyError):
        return None
    if arrow.names:
        known = entry_names(bag, topic)
        if not set(arrow.names) <= set(known):
            return None
        numbers = numbers[:, [known.index(name) for name in arrow.names]]
    if numbers.ndim != 2 or numbers.dtype.kind != "f" or numbers.shape[1] != len(arrow.directions):
        return None
    return bag.stamps_ns(topic), np.where(np.isfinite(numbers), numbers, 0.0) @ np.array(arrow.directions, float)


def arrows_at(scene: Scene, bag: Bag, placed: dict[str, tuple], stamps_ns) -> dict[str, tuple]:
    """Name of an arrow -> (tail (n, 3), tip (n, 3)) [m] in the axes of ``placed`` (as of `poses_at`), at its stamps (n,).

    The newest numbers at each stamp are shown; before the first ones, and where the bag has none of them, nothing is.
    """
    found = {}
    for arrow in scene.arrows:
        track = arrow_track(arrow, bag)
        if track is None or not len(track[0]) or not {arrow.frame, arrow.axes or arrow.frame} <= placed.keys():
            continue
        rows = np.searchsorted(track[0], stamps_ns, "right") - 1
        vectors = np.where((rows >= 0)[:, None], track[1][np.maximum(rows, 0)], 0.0)
        origin, turn = placed[arrow.frame]
        tail = origin + rotations.rotate(turn, np.tile(arrow.origin, (len(rows), 1)))
        found[arrow.name] = tail, tail + arrow.scale * rotations.rotate(placed[arrow.axes or arrow.frame][1], vectors)
    return found


def frames_of(bag: Bag) -> list[Frame]:
    """The bare frames that a bag's transforms name, below ``map``: for one that carries no scene. The first moves."""
    said = _transforms(bag)
    parents = {child: parent for parent, child in said}
    frames = [Frame(child, parent, None if len(said[parent, child].stamps_ns) > 1 else Pose())
              for child, parent in parents.items()]
    roots = [name for name in dict.fromkeys(parents.values()) if name not in parents and name != MAP]
    frames.sort(key=lambda frame: frame.pose is not None)
    return [*frames, *(Frame(root, MAP) for root in roots)] if frames else []


def _transforms(bag) -> dict[tuple, Track]:
    """(parent, child) -> what /tf_static and /tf say of it, together in the order of time."""
    rows = {}
    for topic in (TF_STATIC, TF):
        for frames, found in read_transforms(bag, topic).items():
            rows.setdefault(frames, []).append(found)
    joined = {frames: [np.concatenate(parts) for parts in zip(*found)] for frames, found in rows.items()}
    return {frames: track for frames, parts in joined.items() if (track := _track(*parts)) is not None}


def _track(stamps_ns, position, orientation) -> Track | None:
    """A track of what is finite and rising in time, or None where nothing is."""
    length = np.linalg.norm(orientation, axis=1)
    good = np.flatnonzero(np.isfinite(position).all(axis=1) & np.isfinite(length) & (length > 1e-6))
    if not len(good):
        return None
    latest = np.maximum.accumulate(stamps_ns[good])
    good = good[np.concatenate(([True], stamps_ns[good][1:] > latest[:-1]))]
    return Track(stamps_ns[good].astype(np.int64), position[good].astype(float), orientation[good] / length[good, None])


def _still(pose: Pose) -> Track:
    return Track(np.zeros(1, np.int64), np.array([pose.position], float), np.array([pose.orientation], float))


def _by_joint(bag, frame) -> Track | None:
    """A joint's frame by its angle on /joint_states."""
    if frame.joint is None or JOINT_STATES not in bag or frame.joint.name not in entry_names(bag, JOINT_STATES):
        return None
    angles = bag[JOINT_STATES]["position"]
    if angles.ndim != 2 or not len(angles):
        return None
    angle = angles[:, entry_names(bag, JOINT_STATES).index(frame.joint.name)]
    turn = rotations.about(frame.joint.axis, angle)
    origin = np.tile(frame.pose.orientation, (len(angle), 1))
    return _track(bag.stamps_ns(JOINT_STATES), np.tile(frame.pose.position, (len(angle), 1)),
                  rotations.multiply(origin, turn))


def _by_odometry(bag, frame) -> Track | None:
    """A free frame by the first odometry of it in its parent's axes; a true one before an estimate."""
    if frame.pose is not None:
        return None
    topics = [topic for topic, info in bag.topics.items() if info.type_name == "nav_msgs/msg/Odometry"]
    for topic in sorted(topics, key=lambda topic: "truth" not in topic):
        known = bag.constants(topic)
        if (known.get("header.frame_id"), known.get("child_frame_id")) == (frame.parent, frame.name):
            pose = bag[topic]["pose"]["pose"]
            return _track(bag.stamps_ns(topic), pose["position"], pose["orientation"])
    return None
