"""Code of a device for all parts of a graph and the driver's loop, as PTX, and the same for this processor: the twin.

Both come from one module of intermediate code, in which the driver calls parts by their numbers. LLVM makes PTX of it
without contracting anything: each product and each sum is rounded by itself (`mul.rn`, `add.rn`), which the driver of the
device may not change. Nothing is called that is not in it.
"""

import llvmlite.binding as llvm

from flight_graph.components import registry
from flight_graph.cuda import thread
from flight_graph.cuda.modules import ENTRY
from flight_graph.engines import cache, driver, machine, object_code, part_calls
from flight_graph.engines.linked_code import function_module, keep_only, part_module
from flight_graph.errors import FlightError

_TRIPLE, _PROCESSOR, _FEATURES = "nvptx64-nvidia-cuda", "sm_75", "+ptx73"  # and all that came later

_CALLS = """
define void @flight_part(i64 %part, i64 %t_ns, i64 %p, i64 %x, i64 %io) {{
  %parameters = inttoptr i64 %p to ptr
  %state = inttoptr i64 %x to ptr
  %records = inttoptr i64 %io to ptr
  switch i64 %part, label %end [
{cases}
  ]
{calls}
end:
  ret void
}}
define i64 @flight_fire(i64 %fire, i64 %firing, i64 %tick, i64 %t_ns, i64 %stamp) alwaysinline {{
  %code = call i64 @fire(i64 %firing, i64 %tick, i64 %t_ns, i64 %stamp)
  ret i64 %code
}}
declare i64 @fire(i64, i64, i64, i64)
{declarations}
"""
_CASE = "    i64 {number}, label %part{number}"
_CALL = """part{number}:
  call void @part_{number}(i64 %t_ns, ptr %parameters, ptr %state, ptr %records)
  br label %end"""
_DECLARATION = "declare void @part_{number}(i64, ptr, ptr, ptr)"

_THREAD = f"""
declare i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
declare i64 @fly(i64, i64, i64, i64, i64)
define ptx_kernel void @{ENTRY}(i64 %controls, i64 %stride, i64 %count, i64 %end) {{
  %block = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %size = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %thread = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %block.wide = zext i32 %block to i64
  %size.wide = zext i32 %size to i64
  %thread.wide = zext i32 %thread to i64
  %before = mul i64 %block.wide, %size.wide
  %number = add i64 %before, %thread.wide
  %done = call i64 @fly(i64 %number, i64 %controls, i64 %stride, i64 %count, i64 %end)
  ret void
}}
"""


def compile_graph(key: str, twin: str, parts: list) -> None:
    """Compile PTX and twin of some parts, [use, part] in the order of their numbers from 1, into the cache."""
    text = str(linked([(registry.component(use), part) for use, part in parts]))
    about = {"what": f"{len(parts)} parts for a device", "errors": {}}
    cache.write(key, ptx(text).encode(), {**about, "symbol": ENTRY})
    cache.write(twin, twin_code(text, f"fly_{twin}"), {**about, "symbol": f"fly_{twin}"})


def linked(parts: list):
    """The module of parts, (class, name), and the driver's loop, in which nothing but ``fly`` is seen from outside."""
    numbers = range(1, len(parts) + 1)
    texts = ("\n".join(form.format(number=number) for number in numbers) for form in (_CASE, _CALL, _DECLARATION))
    module = llvm.parse_assembly(_CALLS.format(**dict(zip(("cases", "calls", "declarations"), texts))))
    module.triple, module.data_layout = machine.target_machine().triple, str(machine.target_machine().target_data)
    for number, (component, part) in zip(numbers, parts):
        arguments, records = part_calls.compiled_arguments(component, part, True), part_calls.records(component, part)
        fault = component.state.dtype.fields["fault"][1]
        made, _ = part_module(getattr(component, part), arguments, len(records) - 2, f"part_{number}", fault)
        module.link_in(made)
    module.link_in(function_module(driver.fire, driver.FIRE, "fire"))
    module.link_in(function_module(thread.fly, thread.SIGNATURE, "fly"))
    keep_only(module, "fly")
    module.verify()
    return module


def ptx(text: str) -> str:
    """The PTX of a module: a kernel whose threads fly one run each."""
    module = llvm.parse_assembly(text)
    module.link_in(llvm.parse_assembly(_THREAD))
    keep_only(module, ENTRY)
    target = _target()
    module.triple, module.data_layout = _TRIPLE, str(target.target_data)
    module.verify()
    module = object_code.optimise(module, target)
    if wrong := object_code.open_symbols(module):
        raise FlightError(f"code for a device calls {', '.join(wrong)}, which is not there")
    return target.emit_assembly(module)


def twin_code(text: str, symbol: str) -> bytes:
    """Object code of the same module for this processor."""
    module = llvm.parse_assembly(text)
    module.get_function("fly").name = symbol
    target = machine.target_machine()
    return target.emit_object(object_code.optimise(module, target))


def _target():
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(_TRIPLE).create_target_machine(cpu=_PROCESSOR, features=_FEATURES, opt=3)
