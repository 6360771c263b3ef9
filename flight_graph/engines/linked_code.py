"""What is compiled, linked with all that it reaches: intermediate code with one function that is seen from outside.

`flight_graph.engines.object_code` makes object code of it. Here `numba`'s form of a function, with a status and a place for
its result, becomes the C function that an engine calls.
"""

import llvmlite.binding as llvm
from numba.core import types

from flight_graph.engines.machine import target_machine
from flight_graph.engines.stops import RAISED

# Views of arrays inside of records are counted by numba, but they own no memory: nothing has to be counted.
_NO_REFERENCE_COUNTS = """
define linkonce_odr void @NRT_incref(ptr %memory) alwaysinline {{
  ret void
}}
define linkonce_odr void @NRT_decref(ptr %memory) alwaysinline {{
  ret void
}}
"""

# How the driver calls a part and its own firing on this processor: at their addresses.
BY_ADDRESS = """
define void @flight_part(i64 %part, i64 %t_ns, i64 %p, i64 %x, i64 %io) alwaysinline {
  %function = inttoptr i64 %part to ptr
  call void %function(i64 %t_ns, i64 %p, i64 %x, i64 %io)
  ret void
}
define i64 @flight_fire(i64 %fire, i64 %firing, i64 %tick, i64 %t_ns, i64 %stamp) alwaysinline {
  %function = inttoptr i64 %fire to ptr
  %code = call i64 %function(i64 %firing, i64 %tick, i64 %t_ns, i64 %stamp)
  ret i64 %code
}
"""
CALLED = ("flight_part", "flight_fire")

_ENTRY = """
define void @{symbol}(i64 %t_ns, ptr noalias %p, ptr noalias %x, ptr noalias %io) {{
  %returned = alloca [64 x i8], align 16
  %raised = alloca i64
{loads}
  %status = call i32 @{inner}(ptr %returned, ptr %raised, {arguments})
  %done = icmp eq i32 %status, 0
  %none = icmp eq i32 %status, -2
  %good = or i1 %done, %none
  br i1 %good, label %end, label %stop
stop:
  %number = load i64, ptr %raised
  %code = add i64 %number, {base}
  %fault = getelementptr i8, ptr %x, i64 {fault}
  store i64 %code, ptr %fault
  br label %end
end:
  ret void
}}
declare i32 @{inner}(ptr, ptr, {types})
"""


def part_module(kernel, arguments: list, count: int, symbol: str, fault: int, address_bits: int = 64):
    """The module of a part with all that it reaches, linked and not optimised, and the sentences of all errors in it.

    address_bits: size of what ``io`` holds, where the code is for another processor.
    """
    result = kernel.get_compile_result(types.void(*arguments))
    loads = "\n".join(_load(i, address_bits) for i in range(count))
    names = ["i64 %t_ns"] * (arguments[0] == types.int64) + ["ptr %p", "ptr %x"] + [f"ptr %s{i}" for i in range(count)]
    entry = _ENTRY.format(symbol=symbol, inner=f'"{result.fndesc.llvm_func_name}"', loads=loads, base=RAISED, fault=fault,
                          arguments=", ".join(names), types=", ".join(name.split()[0] for name in names))
    return _linked(result.library, entry, symbol), _raised(result.library)


def _load(i, address_bits) -> str:
    """How a part takes the address of a record out of ``io``."""
    if address_bits == 64:
        return f"  %s{i}.at = getelementptr ptr, ptr %io, i64 {i}\n  %s{i} = load ptr, ptr %s{i}.at"
    word = f"i{address_bits}"
    return (f"  %s{i}.at = getelementptr {word}, ptr %io, i64 {i}\n  %s{i}.word = load {word}, ptr %s{i}.at\n"
            f"  %s{i} = inttoptr {word} %s{i}.word to ptr")


def function_module(function, signature, symbol: str):
    """The module of such a function with all that it reaches, linked and not optimised."""
    result = function.get_compile_result(signature)
    kinds = {types.int64: "i64", types.int32: "i32"}
    names = [f"{kinds.get(kind, 'ptr')} %a{i}" for i, kind in enumerate(signature.args)]
    entry = f"""
define i64 @{symbol}({', '.join(names)}) {{
  %returned = alloca i64
  %raised = alloca i64
  %status = call i32 @"{result.fndesc.llvm_func_name}"({', '.join(["ptr %returned", "ptr %raised", *names])})
  %value = load i64, ptr %returned
  ret i64 %value
}}
declare i32 @"{result.fndesc.llvm_func_name}"({', '.join(["ptr", "ptr", *(name.split()[0] for name in names)])})
"""
    return _linked(result.library, entry, symbol)


def _raised(library):
    return {number: sentence for reached in library.reached() for number, sentence in reached.raised.items()}


def _linked(library, entry, symbol):
    module, machine = llvm.parse_assembly(entry), target_machine()
    for reached in library.reached():
        module.link_in(reached._final_module, preserve=True)
    if any(function.name == "NRT_decref" for function in module.functions):
        module.link_in(llvm.parse_assembly(_NO_REFERENCE_COUNTS.format()))
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    keep_only(module, symbol)
    module.verify()
    return module


def keep_only(module, symbol: str) -> None:
    """Let nothing but one function of a module be seen from outside of it."""
    for value in [*module.functions, *module.global_variables]:
        if not value.is_declaration and value.name != symbol:
            value.linkage = "internal"
