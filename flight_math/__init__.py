"""The mathematics of kernels: values, dense algebra, integrators, noise. It imports numba and NumPy only.

    from flight_math import Quaternion, Vec3, clip, cross, kernel, norm, where
"""

from flight_math.errors import KernelError
from flight_math.integrators import rk4, rk4_array, rk4_between
from flight_math.kernel import fingerprint, kernel, plain
from flight_math.values import *  # noqa: F403
from flight_math.values import __all__ as _values

__all__ = ["KernelError", "fingerprint", "kernel", "plain", "rk4", "rk4_array", "rk4_between", *_values]
