"""Object code of a part of a component that works on eight runs at once: what the compiling process calls."""

import llvmlite.binding as llvm

from flight_graph.components import registry
from flight_graph.engines import cache, object_code, part_calls, parts
from flight_graph.lanes import lane_driver, weave
from flight_graph.lanes.ir_text import functions
from flight_graph.lanes.ir_types import NotWidened, SeveralKinds
from flight_graph.lanes.operations import LANES
from flight_graph.lanes.widen import Module
from flight_graph.text_files import short


def compile_part(use: str, part: str, key: str, differs: list) -> None:
    """Compile the wide form of a part into the cache, or note there why it has none."""
    symbol = parts.symbol(key)
    code, about = part_code(registry.component(use), part, symbol, differs)
    cache.write(key, code, {"what": f"{use} {part}, {LANES} lanes", "symbol": symbol, **about})


def compile_driver() -> None:
    """Compile the functions of the driver of lanes into the cache."""
    lane_driver.CODE.compile()


def part_code(component, part: str, symbol: str, differs: list) -> tuple[bytes, dict]:
    """Object code of the wide form of a part, and what is known about it: its errors, why there is none (refused).

    differs: (begin, end) [bytes] of the parameters that differ between lanes.
    """
    records = part_calls.records(component, part)
    fault = component.state.dtype.fields["fault"][1]
    names = ["parameters", "state", *(f"record {i}" for i in range(len(records) - 2))]
    widths = {name: weave.widths(dtype) for name, (dtype, _) in zip(names, records)}
    refused = []

    def optimised(module, machine):
        try:
            return widened(module, machine, symbol, records[0][0].itemsize, differs, widths)
        except NotWidened as reason:
            refused.append(str(reason))
        except Exception as error:  # what LLVM writes changes from version to version
            refused.append(f"its code has a form that is not known ({type(error).__name__}: {short(str(error))})")
        return object_code.optimise(module, machine)

    code, errors = object_code.part_code(getattr(component, part), part_calls.compiled_arguments(component, part),
                                         len(records) - 2, symbol, fault, optimised)
    return (b"", {"errors": {}, "refused": refused[0]}) if refused else (code, {"errors": errors, "refused": ""})


def widened(module, machine, symbol: str, parameters: int, differs, widths):
    """The module of the wide form of a part, optimised. module: of its usual form, linked, not optimised."""
    copy = llvm.parse_assembly(str(module))
    _optimise(copy, machine, True)
    _tidy(copy, machine)
    text = str(copy)
    made = _made(text, symbol, (parameters, differs, widths))
    head = [line for line in text.splitlines() if line.startswith(("target ", "@"))]
    result = llvm.parse_assembly("\n".join([*head, made.text()]))
    result.verify()
    _optimise(result, machine, False)
    return result


def _made(text, symbol, given) -> Module:
    """The wide functions. Where code takes an address of parameters or one of something else, parameters are woven, too."""
    for weave_all in (False, True):
        made = Module(functions(text), *given, weave_all)
        try:
            made.entry(symbol, symbol)
            return made
        except SeveralKinds:
            if weave_all:
                raise
    return made


def _optimise(module, machine, unroll):
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization, options.loop_unrolling = False, False, unroll
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)


def _tidy(module, machine):
    """One return a function, loops with one way back, what a loop leaves behind at its exits, names for all values."""
    passes = llvm.create_new_module_pass_manager()
    passes.add_unify_function_exit_nodes_pass()
    passes.add_loop_simplify_pass()
    passes.add_lcssa_pass()
    passes.add_instruction_namer_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3)))

