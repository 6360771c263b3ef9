"""The ground about the landing site, in the landing frame D: the body's own surface, not the keep-out funnel over it."""

import numpy as np

from sim_nodes.lander.polyhedral import PolyhedralPlant, body_of


def terrain(scenario, x, y) -> np.ndarray:
    """Height z [m] of the ground at x, y [m] of D (arrays alike); NaN beside the body.

    The ellipsoid's is exact: the upper root of sum ((rho + R r)_i / a_i)^2 = 1. A polyhedron's is that of its highest face.
    """
    plant = scenario.graph.nodes["plant"]
    position, rotation = plant.component.site(plant.values, f"{scenario.origin}: plant")[:2]
    rotation = np.reshape(rotation.parts(), (3, 3))
    position = np.array(position.parts())
    x, y = np.asarray(x, float), np.asarray(y, float)
    if issubclass(plant.component, PolyhedralPlant):
        body = body_of(plant.values, f"{scenario.origin}: plant").polyhedron
        return _highest_face((body.vertices - position) @ rotation, body.faces, x, y)
    axes = np.array(plant.values["semi_axes"])
    base = (position + x[..., None] * rotation[:, 0] + y[..., None] * rotation[:, 1]) / axes
    up = rotation[:, 2] / axes
    a, b, c = up @ up, base @ up, (base * base).sum(axis=-1) - 1.0
    with np.errstate(invalid="ignore"):
        return (-b + np.sqrt(b * b - a * c)) / a


def _highest_face(vertices, faces, x, y):
    """Of triangles (m, 3) over vertices (n, 3), the largest z at x, y."""
    found = np.full(x.shape, -np.inf)
    for p, q, r in vertices[faces]:
        area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])
        if area == 0.0:
            continue
        u = ((x - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (y - p[1])) / area
        v = ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / area
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
        found = np.where(inside, np.maximum(found, p[2] + u * (q[2] - p[2]) + v * (r[2] - p[2])), found)
    return np.where(np.isfinite(found), found, np.nan)
