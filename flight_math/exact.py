"""The functions of Python's math that are one exact IEEE operation, as instructions: sqrt, fabs, floor, ceil.

Numba calls the C library for some of them. What it returns is the same; the call is not needed, and machine code that
calls nothing runs anywhere.
"""

import math

from llvmlite import ir
from numba import types
from numba.core.imputils import impl_ret_untracked
from numba.extending import lower_builtin


def _instruction(function, name, is_whole=False):
    """Lower a function of floats as LLVM's operation of that name; is_whole: Python gives an int."""
    @lower_builtin(function, types.Float)
    def lowered(context, builder, signature, args):
        kind = args[0].type
        operation = builder.module.declare_intrinsic(f"llvm.{name}", [kind], ir.FunctionType(kind, [kind]))
        found = builder.call(operation, args)
        if is_whole:
            found = builder.fptosi(found, context.get_value_type(signature.return_type))
        return impl_ret_untracked(context, builder, signature.return_type, found)


_instruction(math.sqrt, "sqrt")
_instruction(math.fabs, "fabs")
_instruction(math.floor, "floor", True)
_instruction(math.ceil, "ceil", True)
