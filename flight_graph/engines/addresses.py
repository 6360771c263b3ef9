"""Memory by its address, the same in machine code and in plain Python (NUMBA_DISABLE_JIT=1).

What is written with these functions is written once for both: the tables of a schedule hold addresses.
"""

import ctypes
from functools import cache

import numba
import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

if numba.config.DISABLE_JIT:
    @cache
    def row(address, dtype):
        """The record of a NumPy dtype at an address."""
        memory = (ctypes.c_ubyte * dtype.itemsize).from_address(int(address))
        return np.frombuffer(memory, dtype).view(np.recarray)[0]

    def _accessors(kind):
        def read(address):
            return kind.from_address(int(address)).value

        def write(address, value):
            kind.from_address(int(address)).value = value
        return read, write

    word_at, set_word_at = _accessors(ctypes.c_int64)
    half_at, set_half_at = _accessors(ctypes.c_uint32)
    byte_at, set_byte_at = _accessors(ctypes.c_uint8)
    double_at, set_double_at = _accessors(ctypes.c_double)
    single_at, set_single_at = _accessors(ctypes.c_float)

    def copy(target, origin, size):
        """Copy bytes."""
        ctypes.memmove(int(target), int(origin), int(size))

    def compiled(function):
        """The function as it is."""
        return function
else:
    @intrinsic
    def row(typing, address, dtype):
        """The record of a (constant) NumPy dtype at an address."""
        record = dtype.dtype

        def codegen(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(record))

        return record(address, dtype), codegen

    def _reader(kind, size, result, text):
        def read(typing, address):
            def codegen(context, builder, signature, args):
                value = builder.load(builder.inttoptr(args[0], kind.as_pointer()), align=min(size, 4))
                return builder.zext(value, ir.IntType(64)) if result is types.int64 and size < 8 else value

            return result(types.int64), codegen
        read.__doc__ = text
        return intrinsic(read)

    def _writer(kind, size, taken, text):
        def write(typing, address, value):
            def codegen(context, builder, signature, args):
                value = builder.trunc(args[1], kind) if taken is types.int64 and size < 8 else args[1]
                builder.store(value, builder.inttoptr(args[0], kind.as_pointer()), align=min(size, 4))
                return context.get_dummy_value()

            return types.void(types.int64, taken), codegen
        write.__doc__ = text
        return intrinsic(write)

    word_at = _reader(ir.IntType(64), 8, types.int64, "The int64 at an address that may lie at a multiple of four bytes.")
    half_at = _reader(ir.IntType(32), 4, types.int64, "The uint32 at an address.")
    byte_at = _reader(ir.IntType(8), 1, types.int64, "The uint8 at an address.")
    double_at = _reader(ir.DoubleType(), 8, types.float64, "The float64 at an address, a multiple of four bytes.")
    single_at = _reader(ir.FloatType(), 4, types.float32, "The float32 at an address.")
    set_word_at = _writer(ir.IntType(64), 8, types.int64, "Store an int64 at an address, a multiple of four bytes.")
    set_half_at = _writer(ir.IntType(32), 4, types.int64, "Store a uint32 at an address.")
    set_byte_at = _writer(ir.IntType(8), 1, types.int64, "Store a uint8 at an address.")
    set_double_at = _writer(ir.DoubleType(), 8, types.float64, "Store a float64 at an address, a multiple of four bytes.")
    set_single_at = _writer(ir.FloatType(), 4, types.float32, "Store a float32 at an address.")

    @intrinsic
    def copy(typing, target, origin, size):
        """Copy bytes."""
        def codegen(context, builder, signature, args):
            byte = ir.IntType(8).as_pointer()
            cgutils.raw_memcpy(builder, builder.inttoptr(args[0], byte), builder.inttoptr(args[1], byte), args[2], 1)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 3), codegen

    compiled = njit(error_model="numpy", _nrt=False)


def same(array: np.ndarray) -> np.ndarray:
    """A copy of all bytes of records; NumPy's own leaves what lies between the fields to chance."""
    made = np.zeros(array.shape, array.dtype)
    made.view("u1")[...] = array.view("u1")
    return made


def address(array: np.ndarray) -> int:
    """Where an array lies."""
    return array.ctypes.data
