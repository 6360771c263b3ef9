"""Loads machine code while more and more of the process's addresses are taken, as large libraries and arenas take them."""

import ctypes

import llvmlite.binding as llvm

from flight_graph.engines import machine

GIB, PAGE = 1 << 30, 4096
PRIVATE_ANONYMOUS_NORESERVE = 0x4022
LIBC = ctypes.CDLL(None)
LIBC.mmap.restype = ctypes.c_void_p
LIBC.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]


def reserve(size):
    assert LIBC.mmap(None, size, 0, PRIVATE_ANONYMOUS_NORESERVE, -1, 0) != ctypes.c_void_p(-1).value


def summed(number, terms):
    """x plus as many constants, each of them beside the code."""
    name = f"summed_{number}"
    lines = [f"%y{k} = fadd double %y{k - 1}, {k}.25" for k in range(1, terms)]
    text = [f"define double @{name}(double %x) {{", "%y0 = fadd double %x, 0.25", *lines, f"ret double %y{terms - 1}", "}"]
    return name, machine.target_machine().emit_object(llvm.parse_assembly("\n".join(text)))


if __name__ == "__main__":
    for number in range(60):
        terms = [1, 40, 900, 3000][number % 4]
        function = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(machine.load(*summed(number, terms)))
        assert function(2.0) == 2.0 + 0.25 * terms + terms * (terms - 1) / 2, number
        reserve([PAGE * (1 + number % 7), GIB, PAGE * 31][number % 3])
