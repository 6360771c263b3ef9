"""The mathematics of kernels: values, dense algebra, integrators, noise. It imports numba and NumPy only.

    from flight_math import Quaternion, Vec3, clip, cross, kernel, norm, where
"""

from flight_math.elementary.arithmetic import inlined
from flight_math.errors import KernelError
from flight_math.integrators import rk4, rk4_array, rk4_between
from flight_math.kernel import fingerprint, kernel, plain
from flight_math.matrices import inverse, row_by_row
from flight_math.noise import gaussian, uniform
from flight_math.rotation import (
    quaternion_from_matrix,
    quaternion_from_rotation_vector,
    quaternion_rates,
    rotation_vector,
)
from flight_math.uncompiled import uncompiled
from flight_math.values import *  # noqa: F403
from flight_math.values import __all__ as _values

__all__ = ["KernelError", "fingerprint", "gaussian", "inlined", "inverse", "kernel", "plain",
           "quaternion_from_matrix", "quaternion_from_rotation_vector", "quaternion_rates",
           "rk4", "rk4_array", "rk4_between", "rotation_vector",
           "row_by_row", "uncompiled", "uniform", *_values]
