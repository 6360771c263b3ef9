"""What the lander looks like: the box of its inertia with a camera, over a small body with its ground, and the funnel.

``map`` is at the goal: x east, y north, z along the site's normal; the small body hangs below it.
"""

import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.scenes.scene import MAP, Arrow, Body, Cone, Cylinder, Frame, Geometry, Pose, Scene, Shape, Trail
from flight_graph.scenes.shapes import disc, equivalent_box, opposite, turned
from flight_math import Mat3, Vec3, dot, norm, rotate, sincos, uncompiled
from lander_ros.constraints import funnel_height
from msg_schemas import lander
from sim_nodes.lander.site import site_orientation

CRAFT, LENS, METAL = (0.85, 0.8, 0.55, 1.0), (0.2, 0.22, 0.26, 1.0), (0.55, 0.57, 0.6, 1.0)
STONE, GROUND = (0.38, 0.36, 0.34, 1.0), (0.45, 0.42, 0.38, 1.0)
VIEW, FUNNEL = (0.25, 0.6, 0.95, 0.18), (0.95, 0.45, 0.15, 0.22)
THRUST, TORQUE = (0.95, 0.35, 0.1, 1.0), (0.55, 0.25, 0.75, 1.0)
HORIZON = 0.4  # [-] of the distance to the centre: how far the ground is drawn
REFINED, NEAR = 25, 1e-5  # steps towards the ground at a place, and how far [m] from it is near enough


def scene(values: dict, place: Vec3, rotation: Mat3, surface: Geometry, radius: Callable) -> Scene:
    """The scene of a lander's resolved parameters.

    place [m], rotation: of the goal's frame in the body's axes; surface: the body in its axes; radius(direction): distance
    [m] of its surface from its centre along a unit vector.
    """
    turn = uncompiled(site_orientation)(rotation)
    goal = Pose(_numbers(place), _numbers(turn))
    p = SimpleNamespace(**values)
    box, pose = equivalent_box(p.mass, (0.0, 0.0, 0.0), p.inertia)
    size = max(box.size)
    far = max(50.0, _start_distance(p))
    camera = Frame(lander.CAMERA, lander.BASE, Pose((0.0, 0.0, -0.5 * box.size[2]), turned(0, math.pi)))
    frames = (Frame(lander.ASTEROID, MAP, opposite(goal)), Frame(lander.SITE, lander.ASTEROID, goal),
              Frame(lander.BASE, lander.SITE, None), Frame(lander.INERTIAL, lander.SITE, None), camera)
    length, patch = 0.1 * far, min(far, HORIZON * float(norm(place)))
    sine, cosine = uncompiled(sincos)(min(p.view_half_angle, 1.3))
    shapes = (
        Shape("craft", lander.BASE, box, pose, CRAFT),
        Shape("camera", lander.CAMERA, Cylinder(0.1 * size, 0.15 * size), colour=LENS),
        *_legs(box.size),
        Shape("view", lander.CAMERA, Cone(length * float(sine / cosine), length), Pose(), VIEW, "view"),
        Shape("keep_out_funnel", lander.SITE, disc(lambda x, y: float(uncompiled(funnel_height)(p, x, y)) - p.funnel_z_0,
                                                   far, 6), Pose(), FUNNEL, "funnel"),
        *_patch(_ground(p.site_height, place, turn, radius), patch),
        Shape("asteroid", lander.ASTEROID, surface, Pose(), STONE, "terrain"),
    )
    arrows = (_arrow("thrust", "force", "N", 4.0 * size / p.force_limit, THRUST),
              _arrow("torque", "torque", "N m", 3.0 * size / p.torque_limit, TORQUE))
    return Scene("lander", lander.BASE, frames, (Body(lander.BASE, p.mass, (0.0, 0.0, 0.0), tuple(
        tuple(map(float, row)) for row in p.inertia)),), shapes, arrows, (Trail(lander.BASE, lander.SITE),), far)


def _numbers(value) -> tuple:
    return tuple(float(part) for part in value.parts())


def _arrow(name, quantity, unit, scale, colour):
    numbers = tuple(f"{quantity}[{i}]" for i in range(3))
    return Arrow(name, lander.TRUTH.topic, "position", lander.BASE, unit, scale, numbers, colour=colour)


def _start_distance(p) -> float:
    """How far from the goal the descent begins [m]."""
    return p.start_range if p.start_at == "range" else float(norm(Vec3(*p.start_position)))


def _legs(size):
    """Four feet that stand as deep as the goal is high."""
    x, y, z = size
    return [Shape(f"leg_{i}", lander.BASE, Cylinder(0.04 * x, 0.6 * z), Pose((a * 0.5 * x, b * 0.5 * y, -0.6 * z)), METAL)
            for i, (a, b) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)))]


def _patch(height, radius):
    """The ground around the goal; nothing where a mesh has none there (its centre is outside of it)."""
    try:
        return [Shape("ground", lander.SITE, disc(height, radius, 4), Pose(), GROUND, "terrain")]
    except FlightError:
        return []


def _ground(height, place, turn, radius):
    """The function of x, y [m] in the goal's frame that gives the height of the surface there, along the normal."""
    across = rotate(turn, Vec3(0.0, 0.0, 1.0))

    def at(x, y):
        z = -height
        for _ in range(REFINED):
            point = place + rotate(turn, Vec3(x, y, z))
            distance = norm(point)
            missing = radius(np.array((point / distance).parts(), float)) - float(distance)
            z += missing * max(0.2, float(dot(point, across) / distance))
            if abs(missing) < NEAR:
                break
        return z
    return at
