"""The Lyapunov function of the landing law, written a second time, for arrays of true states; nothing of it flies.

  L = U + (1/2) k_a m |v|^2 + (1/2) k_w w^T J w,   U = U_t + U_r + U_1 + U_2   (docs/lander.md)

The barriers have no floor here: they are infinite where a constraint is met. dL/dt = -k_a D_v |v|^2 - k_w D_w |w|^2.
"""

import numpy as np


def potential(law, r, q):
    """U [J] (n,), of r^D (n, 3) [m] and q (n, 4), x, y, z, w, B -> D; law: the parameters of `LandingLaw` by name."""
    distance = np.linalg.norm(r, axis=1)
    pull = law["pull_gain"] * law["pull_radius"] * (np.hypot(law["pull_radius"], distance) - law["pull_radius"])
    turned = 2.0 * np.arctan2(np.linalg.norm(q[:, :3], axis=1), np.abs(q[:, 3]))
    attitude = 0.5 * law["attitude_gain"] * np.tan(0.25 * turned) ** 2
    return pull + attitude + terrain(law, r, distance) + view(law, r, q, distance)


def terrain(law, r, distance):
    """U_1 [J]."""
    if law["terrain_gain"] == 0.0:
        return 0.0
    rounding, gamma = law["funnel_rho_0"] ** 2, law["funnel_gamma"]
    surface = ((law["funnel_alpha"] * (r[:, 0] ** 2 + law["funnel_beta"] * r[:, 1] ** 2 + rounding)) ** gamma
               - (law["funnel_alpha"] * rounding) ** gamma - law["funnel_z_0"])
    return law["terrain_gain"] / (1.0 + (law["terrain_radius"] / distance) ** 4) / (r[:, 2] - surface)


def view(law, r, q, distance):
    """U_2 [J]."""
    x, y, z, w = q.T
    axis = np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)  # z_B in D
    c = np.sum(axis * r, axis=1) / distance
    off = law["view_cutoff_radius"]
    share = np.maximum(distance**2 - off**2, 0.0) / (distance**2 + law["view_radius"] ** 2)
    return law["view_gain"] * share**2 * (1.0 - c) / (c - np.cos(law["view_half_angle"]))


def lyapunov(law, mass, r, v, q, w):
    """L [J] (n,), of v (n, 3) [m/s] relative to the site in D or in B, and w (n, 3) [rad/s] relative to it in B."""
    spinning = np.einsum("ni,ij,nj->n", w, np.array(law["inertia"]), w)
    moving = mass * np.sum(v * v, axis=1)
    return potential(law, r, q) + 0.5 * law["force_weight"] * moving + 0.5 * law["torque_weight"] * spinning


def dissipated(law, v, w):
    """-dL/dt [W] (n,) of the law."""
    return (law["force_weight"] * law["linear_damping"] * np.sum(v * v, axis=1)
            + law["torque_weight"] * law["angular_damping"] * np.sum(w * w, axis=1))
