"""Matrix to quaternion, against SciPy: any rotation, the half turns too, where one of the four branches divides by nothing."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_math import Mat3, quaternion_from_matrix, uncompiled

HALF_TURNS = [Rotation.from_rotvec(np.pi * np.array(axis) / np.linalg.norm(axis))
              for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, -1), (1, 2, 3))]


@pytest.mark.parametrize("rotation", [Rotation.identity(), *HALF_TURNS, *Rotation.random(20, rng=7)],
                         ids=lambda one: np.array2string(one.as_rotvec(), precision=2))
def test_it_is_the_quaternion_of_the_rotation(rotation):
    for function in (quaternion_from_matrix, uncompiled(quaternion_from_matrix)):
        found = function(Mat3(*rotation.as_matrix().ravel()))
        found = np.array([found.x, found.y, found.z, found.w])
        assert abs(found @ rotation.as_quat()) == pytest.approx(1.0, abs=1e-14)  # of one rotation, up to the sign
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-14)
