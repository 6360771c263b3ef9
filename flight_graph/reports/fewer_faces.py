"""Meshes with fewer faces, for pages."""

import numpy as np

MOST_FACES = 6000  # of a mesh on a page


def fewer(vertices: np.ndarray, faces: np.ndarray, most: int = MOST_FACES) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of at most about ``most`` faces: vertices of one cell of a grid become one, as large as that needs."""
    cells, span = 96, np.ptp(vertices, axis=0).max() or 1.0
    while len(faces) > most and cells > 2:
        place = np.floor((vertices - vertices.min(axis=0)) / (span / cells)).astype(int)
        _, first, owner = np.unique(place, axis=0, return_index=True, return_inverse=True)
        merged = owner.reshape(-1)[faces]
        kept = (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 0] != merged[:, 2])
        thin = merged[kept]
        if len(thin) <= most:
            middle = np.stack([np.bincount(owner.reshape(-1), vertices[:, k]) for k in range(3)], axis=1)
            return middle / np.bincount(owner.reshape(-1))[:, None], thin
        cells = int(0.8 * cells)
    return vertices, faces
