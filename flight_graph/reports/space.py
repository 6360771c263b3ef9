"""A vehicle in space over the time of a bag, as a page moves it: shapes in frames, arrows, paths."""

import numpy as np

from flight_graph.components.foreign import Untrusted
from flight_graph.plots.bag_lines import BagLines
from flight_graph.reports.fewer_faces import fewer
from flight_graph.reports.page import View, packed
from flight_graph.scenes import rotations
from flight_graph.scenes.finding import scene_of_bag
from flight_graph.scenes.motion import arrow_track, frames_of, poses_at, tracks
from flight_graph.scenes.scene import MAP, Scene
from flight_graph.scenes.triangles import triangles

MOST_TIMES = 400  # of the slider
MOST_TRAIL = 1000  # points


def view(run: BagLines, trust=False) -> View:
    """The picture in space of a bag. trust: as for `flight_graph.scenes.finding.scene_of_bag`; without it, a bag whose
    scene needs code of its own shows the bare frames. Raises FlightError."""
    try:
        scene = scene_of_bag(run.bag, trust)
    except Untrusted:
        frames = frames_of(run.bag)
        if not frames:
            raise
        scene = Scene(run.name, frames[0].name, tuple(frames))
    found = tracks(scene, run.bag)
    stamps = _stamps(run, found)
    placed = poses_at(scene, found, stamps)
    names = [name for name in placed if name != MAP]
    numbers = {name: number for number, name in enumerate([MAP, *names])}
    moving = {name for name in names if any(len(found[frame.name].stamps_ns) > 1 for frame in scene.path(name))}
    box, extent = _box(scene, placed, stamps)
    poses = [np.concatenate(placed[name], axis=1) if name in moving else np.concatenate(placed[name], axis=1)[:1]
             for name in [MAP, *names]]
    base = scene.base if scene.base in placed else (names or [MAP])[0]
    left_out = [frame.name for frame in scene.frames if frame.name not in placed]
    arrows = [made for arrow in scene.arrows if (made := _arrow(arrow, run, placed, stamps, extent))]
    data = {
        "t": packed((stamps - run.start_ns) / 1e9), "frames": [packed(pose.astype(np.float32)) for pose in poses],
        "meshes": _meshes(scene, numbers, moving), "arrows": arrows,
        "trails": [_trail(trail, scene, placed) for trail in scene.trails
                   if trail.frame in placed and trail.seen_in == MAP],
        "box": box, "extent": extent, "base": numbers[base], "axes": ["x east [m]", "y north [m]", "z up [m]"]}
    if not scene.shapes:
        data["meshes"] = [_axes(numbers, moving, extent)]
    words = [] if scene.shapes else ["The bag carries no scenario whose components declare a model; the axes of frames."]
    words += [f"{len(stamps)} times; drag turns, the wheel zooms, 'follow' keeps the vehicle in the middle."]
    if arrows:
        words.append("Arrows: " + ", ".join(f"{arrow['name']} ({arrow['scale']:g} m per {arrow['unit'] or 'unit'})"
                                            for arrow in arrows) + ".")
    if left_out:
        words.append(f"Not in this bag: where {', '.join(left_out)} are.")
    return View(f"{scene.name} over time", data, " ".join(words))


def _stamps(run, found) -> np.ndarray:
    """The times (n,) [ns] of the slider: spread over what moves."""
    moving = [track.stamps_ns for track in found.values() if len(track.stamps_ns) > 1]
    if not moving:
        return np.array([run.bag.start_ns])
    begin, end = min(stamps[0] for stamps in moving), max(stamps[-1] for stamps in moving)
    longest = max(moving, key=len)
    if len(longest) <= MOST_TIMES:
        return longest
    return np.linspace(begin, end, MOST_TIMES).astype(np.int64)


def _box(scene, placed, stamps) -> tuple[list, float]:
    """What is looked at: a cube about all paths, or about the end of a long one; and half the width for following."""
    extent = float(scene.extent)
    frame = scene.base if scene.base in placed else next((name for name in placed if name != MAP), MAP)
    path = placed[frame][0]
    low, high = path.min(axis=0), path.max(axis=0)
    half = 0.5 * float((high - low).max()) + extent
    middle = 0.5 * (low + high)
    return [[float(middle[k] - half), float(middle[k] + half)] for k in range(3)], extent


def _meshes(scene: Scene, numbers, moving) -> list[dict]:
    """The shapes as few meshes: what moves and what does not, by how much can be seen through it."""
    groups = {}
    for shape in scene.shapes:
        if shape.frame in numbers:
            key = (shape.frame in moving, round(shape.colour[3], 2), shape.kind)
            groups.setdefault(key, []).append(shape)
    return [_mesh(kind, shapes, moves, opacity, numbers) for (moves, opacity, kind), shapes in groups.items()]


def _mesh(kind, shapes, moves, opacity, numbers) -> dict:
    parts, faces, colours, count = [], [], [], 0
    for shape in shapes:
        mesh = triangles(shape.geometry)
        vertices, own = fewer(np.asarray(mesh.vertices), np.asarray(mesh.faces))
        turn = np.tile(shape.pose.orientation, (len(vertices), 1))
        vertices = rotations.rotate(turn, vertices) + np.array(shape.pose.position)
        parts.append({"frame": numbers[shape.frame], "moves": moves,
                      "vertices": packed(vertices.astype(np.float32).ravel())})
        faces.append(own + count)
        colours += [_colour(shape.colour)] * len(own)
        count += len(vertices)
    i, j, k = np.concatenate(faces).T.tolist()
    few = colours[0] if len(set(colours)) == 1 else None
    return {"name": kind, "moves": moves, "opacity": opacity, "parts": parts, "i": i, "j": j, "k": k,
            "colours": None if few else colours, "colour": few}


def _axes(numbers, moving, extent) -> dict:
    """A small arrow-like wedge along each axis of each frame: all that can be shown of a bag that says no more."""
    length, width = 0.3 * extent, 0.02 * extent
    parts, faces, colours = [], [], []
    for name, number in numbers.items():
        for axis, colour in enumerate(("rgb(200,40,40)", "rgb(40,150,40)", "rgb(40,80,200)")):
            vertices = np.zeros((4, 3))
            vertices[1:, (axis + 1) % 3] = width * np.array([1.0, -0.5, -0.5])
            vertices[1:, (axis + 2) % 3] = width * np.array([0.0, 0.87, -0.87])
            vertices[0, axis] = length
            faces.append(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]) + 4 * len(faces))
            parts.append({"frame": number, "moves": name in moving,
                          "vertices": packed(vertices.astype(np.float32).ravel())})
            colours += [colour] * 4
    i, j, k = np.concatenate(faces).T.tolist()
    return {"name": "axes of the frames", "moves": bool(moving), "opacity": 1.0, "parts": parts, "i": i, "j": j, "k": k,
            "colours": colours, "colour": None}


def _arrow(arrow, run, placed, stamps, extent) -> dict | None:
    """Begin and end (n, 6) [m] of an arrow at each time, in map."""
    if arrow.frame not in placed or (arrow.axes and arrow.axes not in placed):
        return None
    track = arrow_track(arrow, run.bag)
    if track is None or not len(track[0]):
        return None
    at = np.clip(np.searchsorted(track[0], stamps, "right") - 1, 0, None)
    vectors = rotations.rotate(placed[arrow.axes or arrow.frame][1], arrow.scale * track[1][at])
    origin, turn = placed[arrow.frame]
    begin = origin + rotations.rotate(turn, np.tile(arrow.origin, (len(stamps), 1)))
    points = np.concatenate([begin, begin + vectors], axis=1).astype(np.float32)
    return {"name": arrow.name, "points": packed(points.ravel()), "colour": _colour(arrow.colour), "scale": arrow.scale,
            "unit": arrow.unit}


def _trail(trail, scene, placed) -> dict:
    points = placed[trail.frame][0]
    points = points[::max(1, len(points) // MOST_TRAIL)]
    return {"name": f"path of {trail.frame}", "points": packed(points.astype(np.float32).ravel()),
            "colour": _colour(trail.colour)}


def _colour(colour) -> str:
    red, green, blue = (round(255 * part) for part in colour[:3])
    return f"rgb({red},{green},{blue})"
