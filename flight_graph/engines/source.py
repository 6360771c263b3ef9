"""The schedule written out as Python source: one loop for the compiled executor, one step for a node.

The same text runs compiled by numba or, with NUMBA_DISABLE_JIT=1, as plain Python. Generated modules are files in the
cache folder, named by a fingerprint of all that they reach, so that numba can keep the machine code beside them.
"""

import hashlib
import importlib.util
import os
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path

import numba
import numpy as np

from flight_graph.components.registry import PACKAGES
from flight_graph.engines.part_calls import kinds_lines, part_call
from flight_graph.graphs.graph import Graph
from flight_graph.kernel import fingerprint, plain
from msg_schemas.signal import Signal

NONFINITE = 1  # control[STOP] codes
FAULT = 2
TICK, END, EPOCH, BASE, STOP, WHO, FIRST_SLOT = range(7)  # entries of the control array

_HEAD = '''"""Generated from a graph; do not edit."""
from numba import njit
from flight_graph.components.registry import component
{imports}
'''


def cache_folder() -> Path:
    """Where generated modules and their machine code are kept: $FLIGHT_CACHE_DIR or the user's cache folder."""
    root = os.environ.get("FLIGHT_CACHE_DIR")
    if root is None:
        root = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "flight_graph"
    folder = Path(root)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


_LOADING = threading.Lock()  # a module is in sys.modules before it has run; another thread must not take it then
_LOADED = {}  # (folder, text, kernels) -> module: a sweep's runs share one


def load(text: str, functions: list, name: str):
    """Return the generated module for ``text``; ``functions`` are the kernels that it reaches."""
    known = (str(cache_folder()), text, *functions)
    with _LOADING:
        if known not in _LOADED:
            _LOADED[known] = _load(text, functions, name)
        return _LOADED[known]


def _load(text, functions, name):
    key = hashlib.sha256("\n".join([
        text, fingerprint(*functions), *_loose(functions), numba.__version__, np.__version__, sys.version.split()[0],
    ]).encode()).hexdigest()[:24]
    module_name = f"{name}_{key}"
    if module_name in sys.modules:
        return sys.modules[module_name]
    path = cache_folder() / f"{module_name}.py"
    if not path.exists():
        draft = path.with_suffix(f".{os.getpid()}.tmp")
        draft.write_text(text, encoding="utf-8", newline="\n")
        os.replace(draft, path)
    spec = importlib.util.spec_from_file_location(module_name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    return module


def _loose(functions):
    """Names of modules from outside of the packages: one file may be imported under several, and machine code remembers
    the name its module had."""
    modules = {plain(function).__module__ for function in functions}
    return sorted(name for name in modules if name.partition(".")[0] not in (*PACKAGES, "flight_graph", "flight_math"))


def is_cached(module) -> bool:
    """Whether machine code of the module lies in the cache (so that a start will be quick)."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(module.__file__).parent)
    return any(folder.rglob(f"{Path(module.__file__).stem}.*.nbi"))


class _Writer:
    """Collects the lines of a generated module."""

    def __init__(self):
        self.lines, self.finite = [], {}

    def add(self, indent, *lines):
        self.lines += ["    " * indent + line for line in lines]

    def finite_check(self, signal: Signal) -> str:
        """Name of the function that tells whether all floats of a record are finite."""
        if id(signal) not in self.finite:
            self.finite[id(signal)] = (f"finite_{len(self.finite)}", signal)
        return self.finite[id(signal)][0]

    def finite_functions(self):
        for name, signal in self.finite.values():
            yield from ["", "", "@njit(error_model='numpy', nogil=True)", f"def {name}(r):", "    s = 0.0"]
            for path, dtype, _, _ in signal.leaves():
                if dtype.base.kind != "f" or path in signal.may_be_nonfinite:
                    continue
                if dtype.shape:
                    yield from [f"    for i in range({dtype.shape[0]}):", f"        s += 0.0 * r.{path}[i]"]
                else:
                    yield f"    s += 0.0 * r.{path}"
            yield "    return s == 0.0"

    def text(self, imports):
        return "\n".join([_HEAD.format(imports="\n".join(imports)), *self.finite_functions(), *self.lines, ""])


@dataclass
class Slots:
    """Where the control array keeps when something is due: (next tick, period in ticks) pairs, then log counters.

    Rates are data, not text: graphs that differ in rates alone share their machine code.
    """

    periods: list[int] = field(default_factory=list)
    counters: int = 0

    def due(self, period: int) -> int:
        """Reserve a pair; return the index of its next tick."""
        self.periods.append(period)
        return FIRST_SLOT + 2 * (len(self.periods) - 1)

    def control(self, end: int, epoch_ns: int, base_ns: int) -> np.ndarray:
        """A fresh control array."""
        control = np.zeros(FIRST_SLOT + 2 * len(self.periods) + self.counters, np.int64)
        control[END], control[EPOCH], control[BASE] = end, epoch_ns, base_ns
        control[FIRST_SLOT + 1:FIRST_SLOT + 2 * len(self.periods):2] = self.periods
        return control


def loop_source(graph: Graph, plan: dict) -> tuple[str, list[str], Slots]:
    """Source of ``start(...)`` and ``run(control, ...)`` of a whole graph, the names of their arguments, the slots.

    plan: (node, port) -> every how manieth message goes into the log. Arguments: P_, X_ of each node, O_ of each
    output, V_ (published copy) of outputs slower than their component, H_ (held copy) of delayed edges, L_ logs.
    """
    writer, slots = _Writer(), Slots(counters=len(plan))
    arguments = _loop_arguments(graph, plan)
    writer.add(0, "", "", "@njit(cache=True, error_model='numpy', nogil=True)", f"def start({', '.join(arguments)}):")
    for node in graph.nodes.values():
        if node.component.start is not None:
            call = part_call(node.component, "start", node.name, f"P_{node.name}[0]", f"X_{node.name}[0]", [], [])
            writer.add(1, f"{node.name}_start({call})")
    writer.add(1, "return 0")
    writer.add(0, "", "", "@njit(cache=True, error_model='numpy', nogil=True)",
               f"def run(control, {', '.join(arguments)}):")
    writer.add(1, f"while control[{TICK}] < control[{END}]:", f"    tick = control[{TICK}]",
               f"    t = tick * control[{BASE}]", f"    stamp = control[{EPOCH}] + t", "    sec = stamp // 1000000000",
               "    nanosec = stamp - sec * 1000000000")
    body = []
    for node, port, edge in _delayed(graph):
        body += _due(slots, graph.ticks(node), [f"H_{node.name}_{port}[0] = {_visible(graph, edge)}[0]"])
    steps = [_loop_step(writer, slots, graph, plan, number, step) for number, step in enumerate(graph.order)]
    first_counter = FIRST_SLOT + 2 * len(slots.periods)
    counters = {f"@{node}.{port}@": f"control[{first_counter + i}]" for i, (node, port) in enumerate(plan)}
    for line in body + [line for lines in steps for line in lines]:
        for mark, counter in counters.items():
            line = line.replace(mark, counter)
        writer.add(2, line)
    writer.add(1, f"    control[{TICK}] = tick + 1", "return 0")
    return writer.text(_imports(graph)), arguments, slots


def _loop_step(writer, slots, graph, plan, number, step):
    node = graph.nodes[step.node]
    component = node.component
    outputs = [] if step.part == "update" else list(component.outputs.items())
    inputs = [] if step.part == "output" else list(component.inputs)
    lines = []
    for port, signal in outputs:
        lines += [f"O_{node.name}_{port}[0].{signal.stamp_path}.sec = sec",
                  f"O_{node.name}_{port}[0].{signal.stamp_path}.nanosec = nanosec"]
    call = part_call(component, step.part, node.name, f"P_{node.name}[0]", f"X_{node.name}[0]",
                     [(port, f"{_input(graph, node, port)}[0]") for port in inputs],
                     [(port, f"O_{node.name}_{port}[0]") for port, _ in outputs])
    lines.append(f"{node.name}_{step.part}({call})")
    lines += [f"if X_{node.name}[0].fault != 0:", *_stop(FAULT, number)]
    for port, signal in outputs:
        record = f"O_{node.name}_{port}"
        publish = [f"if not {writer.finite_check(signal)}({record}[0]):", *_stop(NONFINITE, number)]
        if _is_slower(node, port):
            publish.append(f"V_{node.name}_{port}[0] = {record}[0]")
        if (node.name, port) in plan:
            mark = f"@{node.name}.{port}@"
            period = node.output_period_ns(port) * plan[node.name, port] // graph.base_ns
            publish += _due(slots, period, [f"L_{node.name}_{port}[{mark}] = {record}[0]", f"{mark} += 1"])
        if _is_slower(node, port):
            publish = _due(slots, node.output_period_ns(port) // graph.base_ns, publish)
        lines += publish
    return _due(slots, graph.ticks(node), lines)


def _due(slots, period, lines):
    """The lines, run at every ``period``-th tick."""
    slot = slots.due(period)
    return [f"if tick == control[{slot}]:", f"    control[{slot}] += control[{slot + 1}]",
            *("    " + line for line in lines)]


def _stop(code, number):
    return [f"    control[{STOP}] = {code}", f"    control[{WHO}] = {number}", "    return 1"]


def _is_slower(node, port):
    return port in node.component.output_rate_hz


def _visible(graph, edge):
    node = graph.nodes[edge.node]
    return f"{'V' if _is_slower(node, edge.port) else 'O'}_{edge.node}_{edge.port}"


def _delayed(graph):
    for node in graph.nodes.values():
        for port, edge in node.inputs.items():
            if edge.delay:
                yield node, port, edge


def _input(graph, node, port):
    edge = node.inputs.get(port)
    if edge is None or edge.delay:
        return f"H_{node.name}_{port}"
    return _visible(graph, edge)


def _loop_arguments(graph, plan):
    names = []
    for node in graph.nodes.values():
        names += [f"P_{node.name}", f"X_{node.name}"]
        for port in node.component.outputs:
            names.append(f"O_{node.name}_{port}")
            if _is_slower(node, port):
                names.append(f"V_{node.name}_{port}")
        names += [f"H_{node.name}_{port}" for port in node.component.inputs
                  if port not in node.inputs or node.inputs[port].delay]
    return names + [f"L_{node}_{port}" for node, port in plan]


def _imports(graph):
    lines = []
    for node in graph.nodes.values():
        for part in ("start", "kernel", "output", "update"):
            if getattr(node.component, part) is not None:
                lines.append(f"{node.name}_{part} = component({node.use!r}).{part}")
                lines += kinds_lines(f"component({node.use!r})", node.component, part, node.name)
    return lines


def step_source(use: str, component, part: str) -> str:
    """Source of ``step(t, P, X, *inputs, *outputs)`` of one part of one component; it returns 0, or a stop code.

    A non-finite output gives NONFINITE + 10 * its index.
    """
    writer = _Writer()
    inputs = [] if part in ("output", "start") else [f"I_{port}" for port in component.inputs]
    outputs = [] if part in ("update", "start") else [f"O_{port}" for port in component.outputs]
    arguments = ", ".join(["P", "X", *inputs, *outputs])
    call = part_call(component, part, "C", "P[0]", "X[0]", *(
        [(name[2:], f"{name}[0]") for name in names] for names in (inputs, outputs)))
    writer.add(0, "", "", "@njit(cache=True, error_model='numpy', nogil=True)", f"def step(t, {arguments}):",
               f"    kernel({call})", "    if X[0].fault != 0:", f"        return {FAULT}")
    for number, (port, signal) in enumerate(component.outputs.items() if outputs else ()):
        writer.add(1, f"if not {writer.finite_check(signal)}(O_{port}[0]):", f"    return {NONFINITE + 10 * number}")
    writer.add(1, "return 0")
    return writer.text([f"kernel = component({use!r}).{part}",
                        *kinds_lines(f"component({use!r})", component, part, "C")])
