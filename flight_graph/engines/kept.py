"""Kernels over whole arrays that plain Python calls (the gravity of a mesh at many points), their machine code kept.

They go the way of the parts of components: compiled once, in a process of their own, into the same cache.
"""

import ctypes

import numpy as np
from llvmlite import ir
from numba import config, njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from flight_graph.engines import compilation, parts
from flight_math.kernel import fingerprint

_ARRAY = types.Array(types.float64, 2, "C")


@intrinsic(prefer_literal=True)
def _arrays(typing, table, count):
    """The arrays that a table describes: (address, rows, columns) of each."""
    number = count.literal_value

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        rows = builder.inttoptr(args[0], word.as_pointer())

        def entry(index):
            return builder.load(builder.gep(rows, [word(index)]))
        made = []
        for i in range(number):
            array = context.make_array(_ARRAY)(context, builder)
            shape = [entry(3 * i + 1), entry(3 * i + 2)]
            data = builder.inttoptr(entry(3 * i), context.get_data_type(types.float64).as_pointer())
            context.populate_array(
                array, data=data, shape=shape, strides=[builder.mul(shape[1], word(8)), word(8)], itemsize=word(8),
                meminfo=None)
            made.append(array._getvalue())
        return cgutils.pack_array(builder, made)

    return types.UniTuple(_ARRAY, number)(table, count), codegen


class Kept:
    """A kernel over C-contiguous (n, m) float64 arrays, which it reads or fills. name: ``module:attribute`` of this."""

    signature = types.int64(types.int64)

    def __init__(self, name: str, kernel, count: int):
        self.name, self._kernel, self._count = name, kernel, count
        self._function = None

    def key(self) -> str:
        """Fingerprint of the machine code."""
        return parts.digest("kept", fingerprint(self._kernel), str(self._count))

    def entry(self):
        """What is compiled: a function of a table's address."""
        kernel, count = self._kernel, self._count

        @njit(error_model="numpy")
        def entry(table):
            kernel(*_arrays(table, count))
            return 0
        return entry

    def __call__(self, *arrays: np.ndarray) -> None:
        for array in arrays:
            if array.dtype != np.float64 or array.ndim != 2 or not array.flags.c_contiguous:
                raise TypeError(f"{self.name} takes C-contiguous (n, m) arrays of float64")
        if config.DISABLE_JIT:
            with np.errstate(all="ignore"):  # as machine code does: hashes overflow
                self._kernel(*arrays)
            return
        if self._function is None:
            self._function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self._load().address)
        table = np.array([(array.ctypes.data, *array.shape) for array in arrays], np.int64)
        self._function(table.ctypes.data)

    def _load(self):
        code = parts.load_code(self.key())
        if code is None:
            compilation.compile_kept(self.name, self.key())
            code = parts.load_code(self.key())
        return code
