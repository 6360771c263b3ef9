"""Object code of a part of a component that works on eight runs at once."""

import llvmlite.binding as llvm

from flight_graph.engines import object_code
from flight_graph.engines.machine import target_machine
from flight_graph.lanes.ir_text import functions
from flight_graph.lanes.widen import Module


def widened(module, machine, symbol: str, parameters: int, differs, widths):
    """The module of the wide form of a part, optimised. module: of its usual form, linked, not optimised."""
    _optimise(module, machine, True)
    _tidy(module, machine)
    text = str(module)
    made = Module(functions(text), parameters, differs, widths)
    made.entry(symbol, symbol)
    head = [line for line in text.splitlines() if line.startswith(("target ", "@"))]
    result = llvm.parse_assembly("\n".join([*head, made.text()]))
    result.verify()
    _optimise(result, machine, False)
    return result


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
