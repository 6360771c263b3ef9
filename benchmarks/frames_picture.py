"""Draws docs/images/frames.png: the frames of the three vehicles in space and as trees, from their scenes and golden bags.

    python benchmarks/frames_picture.py
"""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402

from flight_graph.bags.reader import read_bag  # noqa: E402
from flight_graph.scenes import rotations  # noqa: E402
from flight_graph.scenes.finding import scene_of_bag  # noqa: E402
from flight_graph.scenes.motion import poses_at, tracks  # noqa: E402
from flight_graph.scenes.scene import MAP  # noqa: E402
from flight_graph.scenes.triangles import triangles  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
VEHICLES = (("rover", "cubli_bennu", 0.22, "site"), ("space robot", "spacerobot_payload", 0.85, "spacerobot_B1"),
            ("lander", "lander_nominal", 2.2, None))
AXES = ((0.85, 0.15, 0.15), (0.15, 0.6, 0.2), (0.15, 0.3, 0.85))
FIXED, MOVING, TURNING = ("#4a4a4a", "-"), ("#c2410c", (0, (4, 2))), ("#1d4ed8", (0, (1, 1)))  # colour, dashes


def in_space(axes, name, half, middle):
    """The vehicle with the axes of its frames: x red, y green, z blue."""
    bag = read_bag(ROOT / "bags" / name)
    scene = scene_of_bag(bag)
    placed = poses_at(scene, tracks(scene, bag), bag.stamps_ns("/tf")[-1:])
    middle = placed[middle or scene.base][0][0] + (0.0, 0.0, 0.4 * half if middle else 0.0)
    for shape in scene.shapes:
        if shape.kind != "vehicle":
            continue
        mesh = triangles(shape.geometry)
        points = rotations.rotate(np.tile(shape.pose.orientation, (len(mesh.vertices), 1)), mesh.vertices)
        origin, turn = placed[shape.frame]
        points = rotations.rotate(np.tile(turn, (len(points), 1)), points + np.array(shape.pose.position)) + origin
        axes.add_collection3d(Poly3DCollection(points[mesh.faces], facecolor=(*shape.colour[:3], 0.25 * shape.colour[3]),
                                               edgecolor=(0, 0, 0, 0.06)))
    shown = {}
    for frame, (origin, turn) in placed.items():
        if np.abs(origin[0] - middle).max() > 1.2 * half:
            continue
        for unit, colour in zip(np.eye(3), AXES):
            tip = origin[0] + 0.3 * half * rotations.rotate(turn, unit[None])[0]
            axes.plot(*np.stack([origin[0], tip]).T, color=colour, linewidth=1.6)
        near = next((place for place in shown if np.linalg.norm(np.array(place) - origin[0]) < 0.02 * half), None)
        shown.setdefault(near or tuple(origin[0]), []).append(frame)
    for place, frames in shown.items():
        axes.text(*place, "\n".join(frames), fontsize=7, ha="left", va="bottom", zorder=1000,
                  bbox={"facecolor": "white", "alpha": 0.65, "edgecolor": "none", "pad": 0.8})
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half),
             zlim=(middle[2] - half, middle[2] + half))
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.set_axis_off()
    return scene


def as_tree(axes, scene):
    """The tree of the frames, map on top."""
    depth, row = {MAP: 0}, {MAP: 0}
    order = [MAP]

    def visit(parent):
        for frame in scene.frames:
            if frame.parent == parent:
                depth[frame.name], row[frame.name] = depth[parent] + 1, len(order)
                order.append(frame.name)
                visit(frame.name)

    visit(MAP)
    for frame in scene.frames:
        kind, style = MOVING if frame.pose is None else TURNING if frame.joint else FIXED
        x, y, top = depth[frame.parent] * 0.5 + 0.12, -row[frame.name], -row[frame.parent] - 0.3
        axes.plot([x, x, x + 0.33], [top, y, y], color=kind, linestyle=style, linewidth=1.5)
    for name in order:
        axes.text(0.5 * depth[name], -row[name], name, fontsize=9, va="center", ha="left", family="monospace",
                  bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": "#999999", "linewidth": 0.8})
    axes.set(xlim=(-0.1, 3.2), ylim=(-9.5, 0.7))
    axes.set_axis_off()


def main():
    figure = plt.figure(figsize=(14, 8.2))
    for column, (title, name, half, middle) in enumerate(VEHICLES):
        space = figure.add_axes((0.01 + 0.33 * column, 0.42, 0.31, 0.55), projection="3d")
        scene = in_space(space, name, half, middle)
        space.set_title(title, fontsize=13, y=1.0)
        as_tree(figure.add_axes((0.03 + 0.33 * column, 0.03, 0.29, 0.4)), scene)
    lines = [plt.Line2D([], [], color=colour, linestyle=style) for colour, style in (FIXED, MOVING, TURNING)]
    lines += [plt.Line2D([], [], color=colour, linewidth=3) for colour in AXES]
    meanings = ["fixed: /tf_static, once", "moves: /tf", "turns with a joint: /tf, /joint_states", "x", "y", "z"]
    figure.legend(lines, meanings, loc="lower center", ncol=6, frameon=False)
    out = ROOT / "docs" / "images" / "frames.png"
    figure.savefig(out, dpi=90)
    print(out.relative_to(ROOT))


if __name__ == "__main__":
    main()
