"""Relocatable object code of one function: typed and lowered by numba, linked, optimised and emitted by llvmlite.

    void part(int64 t_ns, P *p, X *x, void **io)

p, x: the records of parameters and state; io: the addresses of the inputs' records, then of the outputs'. Numba's own
engine is not used: it would optimise and emit every kernel by itself, with wrappers for Python. Here a kernel stays
plain intermediate code until the part that reaches it is linked as a whole and optimised once.

`install` turns a whole process into such a compiler; kernels cannot be called from Python in it any more. It is the
process of `flight_graph.engines.compiler`, which does nothing else.
"""

import ctypes
import gc
import hashlib
import sys
from contextlib import contextmanager

import llvmlite.binding as llvm
from llvmlite import ir
from numba import _dynfunc, config
from numba.core import callconv, codegen
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher
from numba.core.lowering import BaseLower
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys

from flight_graph.engines.linked_code import BY_ADDRESS, CALLED, function_module, keep_only, part_module
from flight_graph.engines.machine import target_machine
from flight_graph.engines.stops import RAISED
from flight_graph.errors import FlightError
from flight_math.errors import KernelError

MAY_CALL = {"memset", "memcpy", "memmove", "floor", "ceil"}  # outside of itself: memory, and what is exact in any libm
_CONTEXT = "_toplevel_target_context"
_NEVER_CALLED = ctypes.cast(ctypes.pythonapi.PyErr_BadArgument, ctypes.c_void_p).value

class Library(codegen.CPUCodeLibrary):
    """Code as numba lowered it. raised: number -> sentence of each error that it may raise."""

    def __init__(self, owner, name):
        super().__init__(owner, name)
        self.raised = {}

    def _optimize_functions(self, ll_module):
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self):
        self._raise_if_finalized()
        self._finalized = True

    def reached(self, found=None) -> list:
        """This library and all that it links, each once."""
        found = [] if found is None else found
        if self not in found:
            found.append(self)
            for library in self._linking_libraries:
                library.reached(found)
        return found


class Codegen(codegen.CPUCodegen):
    """Makes modules for `target_machine`; nothing is loaded."""

    _library_class = Library

    def _init(self, llvm_module):
        self._tm = target_machine()
        self._tm_features = ""
        self._target_data = self._tm.target_data
        self._data_layout = str(self._target_data)

    def _add_module(self, module):
        pass


class CallConvention(callconv.CPUCallConv):
    """An error carries a number instead of a pickled exception; the library says what it stands for."""

    def set_static_user_exc(self, builder, exc, exc_args=None, loc=None, func_name=None):
        sentence = ": ".join([exc.__name__, *map(str, exc_args or ())]) if exc else "an error"
        if config.BOUNDSCHECK and (loc := loc or _line_being_lowered()):
            sentence = f"{sentence} ({loc.filename}, line {loc.line})"
        number = int.from_bytes(hashlib.sha256(sentence.encode()).digest()[:4], "little") + 1
        self.context.active_code_library.raised[number] = sentence
        pointer = self._get_excinfo_argument(builder.function)
        builder.store(ir.IntType(64)(number).inttoptr(pointer.type.pointee), pointer)

    def set_dynamic_user_exc(self, builder, exc, exc_args, nb_types, loc=None, func_name=None):
        self.set_static_user_exc(builder, exc, ("its text is not a constant",), loc, func_name)


def _line_being_lowered():
    """Where the statement stands that is being lowered: numba does not say where an index was out of bounds."""
    frame = sys._getframe()
    while frame is not None:
        lower = frame.f_locals.get("self")
        if isinstance(lower, BaseLower):
            return lower.loc
        frame = frame.f_back
    return None


class Context(CPUContext):
    """Numba's target context, for object code."""

    allow_dynamic_globals = False
    aot_mode = True

    def init(self):
        super().init()
        self._internal_codegen = Codegen("flight_graph")

    @property
    def call_conv(self):
        return CallConvention(self)

    def add_dynamic_addr(self, builder, intaddr, info):
        if info != "CPUDispatcher":
            raise FlightError(f"a kernel reaches for an address of this process ({info}), which object code cannot have")
        return ir.IntType(8).as_pointer()(None)  # a kernel as a value: calls do not go through it

    def post_lowering(self, mod, library):
        pass

    def create_cpython_wrapper(self, library, fndesc, env, call_helper, release_gil=False):
        pass

    def create_cfunc_wrapper(self, library, fndesc, env, call_helper):
        pass

    def get_executable(self, library, fndesc, env):
        library._ensure_finalized()
        name = fndesc.qualname.split(".")[-1]
        return _dynfunc.make_function(fndesc.lookup_module(), name, "not callable", _NEVER_CALLED, env, (library,))


def install() -> None:
    """Make this process a compiler of object code."""
    rtsys._init = True  # numba's run time is not loaded: nothing here allocates
    cpu_target.__dict__[_CONTEXT] = Context(cpu_target.typing_context, "cpu")


@contextmanager
def installed():
    """Make this process a compiler of object code for a while: afterwards kernels can be called from Python again."""
    usual, initialised = cpu_target.__dict__.get(_CONTEXT), rtsys._init
    _forget(lambda result: True)  # code of the usual context cannot be linked here
    install()
    try:
        yield
    finally:
        _forget(lambda result: isinstance(result.library, Library))
        rtsys._init = initialised
        cpu_target.__dict__.pop(_CONTEXT)
        if usual is not None:
            cpu_target.__dict__[_CONTEXT] = usual


def _forget(which):
    """Take compiled forms out of all kernels (among the objects are proxies of dead ones, which answer no isinstance)."""
    for found in gc.get_objects():
        if issubclass(type(found), Dispatcher) and any(which(result) for result in found.overloads.values()):
            kept = [result for result in found.overloads.values() if not which(result)]
            found._reset_overloads()
            found.overloads.clear()
            for result in kept:
                found.add_overload(result)


def optimise(module, machine):
    """LLVM's own order of passes; nothing among them may change the result of an operation. Returns the module.

    Loops over arrays become vector code; statements side by side do not (that makes laws of small values slower).
    """
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return module


def part_code(kernel, arguments: list, count: int, symbol: str, fault: int,
              optimised=optimise, address_bits: int = 64) -> tuple[bytes, dict[int, str]]:
    """Object code of one part as the C function ``symbol``, and the sentences of the errors it may raise.

    arguments: numba's types of the kernel's arguments; count: of its inputs and outputs, each a pointer at the end of what
    numba makes of the arguments. fault: offset of the state's ``fault``, which takes `RAISED` plus the number of an error.
    optimised(module, machine): the module that is emitted in the place of the linked one. address_bits: size of what ``io``
    holds, where the code is for another processor. Raises FlightError.
    """
    module, raised = part_module(kernel, arguments, count, symbol, fault, address_bits)
    code, text = _emit(module, optimised)
    return code, {number: raised[number] for number in raised if str(number) in text or str(RAISED + number) in text}


def function_code(function, signature, symbol: str) -> bytes:
    """Object code of a compiled function that raises nothing, as the C function ``symbol`` with its own arguments."""
    module = function_module(function, signature, symbol)
    if any(called.name in CALLED for called in module.functions):
        module.link_in(llvm.parse_assembly(BY_ADDRESS))
        keep_only(module, symbol)
    return _emit(module)[0]


def _emit(module, optimised=optimise) -> tuple[bytes, str]:
    """Object code, and the optimised intermediate code as text."""
    machine = target_machine()
    module = optimised(module, machine)
    text = str(module)
    wrong = sorted(name for name in open_symbols(module) if name not in MAY_CALL)
    if wrong:
        raise KernelError("", 0, _open_sentence(wrong))
    return machine.emit_object(module), text


def _open_sentence(names):
    if any(name.startswith("NRT_") for name in names):
        return "this allocates memory, which no kernel may; work arrays are made with flight_math.stack_array"
    functions = ", ".join(name for name in names)
    return (f"this calls {functions}, which lies outside of the machine code of a component; allowed are the functions of "
            "flight_math")


def open_symbols(module) -> list[str]:
    """What the code refers to that is not in it."""
    return sorted(value.name for value in [*module.functions, *module.global_variables]
                  if value.is_declaration and not value.name.startswith("llvm."))
