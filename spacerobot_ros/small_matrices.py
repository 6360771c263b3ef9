"""Small dense matrices in kernels; they are in `flight_math.dense`."""

from flight_math.dense import cholesky, cholesky_solve, symmetric_eigen

__all__ = ["cholesky", "cholesky_solve", "symmetric_eigen"]
