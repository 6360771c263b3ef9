"""A function that works on eight lanes, made of one that works on one record of each kind.

    void part(int64 t_ns, P *, X *, void **io)      ->      void part(int64 t_ns, P8 *, X8 *, void **io)

A woven record has its numbers at eight times their offset, those of the lanes side by side. Every block of the function is
run by a mask of lanes, one after the other in an order in which all that leads to a block comes before it; a block that no
lane needs is jumped over. Loops go on until no lane needs another round. No operation changes but in its width, so the
bits of a lane are those of the function.
"""

from flight_graph.lanes.arithmetic import Arithmetic
from flight_graph.lanes.divergence import Place
from flight_graph.lanes.emission import Emission
from flight_graph.lanes.flow import Loop
from flight_graph.lanes.ir_text import Function
from flight_graph.lanes.ir_types import NotWidened
from flight_graph.lanes.masks import Masks
from flight_graph.lanes.memory_access import Memory
from flight_graph.lanes.operations import LANES, MASK, wide

_CHEAP = 10  # operations of a block that is worked through rather than jumped over
_HARMLESS = {"fadd", "fsub", "fmul", "fneg", "add", "sub", "mul", "and", "or", "xor", "icmp", "fcmp", "select", "zext",
             "sext", "trunc", "sitofp", "bitcast", "ret", "phi", "br"}
_ATTRIBUTES = 'nounwind "prefer-vector-width"="512" "min-legal-vector-width"="512"'


class Module:
    """All functions of a module, and the wide ones that are made of them.

    parameters: bytes of a component's parameters; differs: (begin, end) of those that differ between lanes. widths: record
    (as `Place.root` names it) -> offset -> bytes of the number there. weave_all: parameters are woven though none differs.
    """

    def __init__(self, functions: dict[str, Function], parameters: int, differs: list[tuple[int, int]],
                 widths: dict[str, dict[int, int]], weave_all: bool = False):
        self._shares = not differs and not weave_all  # parameters are one record for all lanes
        self.functions, self.parameters, self.differs, self.widths = functions, parameters, differs, widths
        self._texts, self._declared, self._versions = [], set(), {}

    def entry(self, name: str, symbol: str) -> None:
        """Make the wide form of a part."""
        function = self.functions[f"@{name}"]
        t_ns, p, x, io = (argument for _, argument in function.arguments)
        parameters = Place("one" if self._shares else "parameters", "parameters", 0)
        kinds = {t_ns: False, p: parameters, x: Place("lanes", "state", 0), io: Place("table", "io", 0)}
        made = Widened(self, function, kinds, False, False)
        if self._shares:  # the one record of parameters stands behind the woven ones
            made.know_always(p, made.result(f"getelementptr i8, ptr {made.name(p)}, i64 {LANES * self.parameters}"))
        self._texts.append(made.text(symbol, ""))

    def version(self, callee: str, kinds: tuple, masked: bool, differs: bool) -> str:
        """Name of the wide form of a function for arguments of these kinds; differs: its result, between lanes."""
        key = callee, kinds, masked, differs
        if key not in self._versions:
            function = self.functions.get(f"@{callee}")
            if function is None:
                raise NotWidened(f"a call of {callee}")
            self._versions[key] = symbol = f"lanes.{len(self._versions)}"
            arguments = {name: kind for (_, name), kind in zip(function.arguments, kinds)}
            self._texts.append(Widened(self, function, arguments, masked, differs).text(symbol, "internal "))
        return self._versions[key]

    def declare(self, line: str) -> None:
        """A function of LLVM that is called."""
        self._declared.add(line)

    def text(self) -> str:
        """The wide functions as intermediate code."""
        return "\n".join([*sorted(self._declared), *self._texts])


class Widened(Emission):
    """The wide form of one function. kinds: of its arguments, as `Divergence` takes them; masked: for some lanes only;
    differs: its result, between lanes.
    """

    def __init__(self, module: Module, function: Function, kinds: dict, masked: bool, differs: bool):
        super().__init__(function, kinds, module.differs)
        self.module, self.masked, self._kinds, self._differs = module, masked, kinds, differs
        self.masks = Masks(self, "%mask" if masked else None)
        self._memory, self._arithmetic = Memory(self, self.masks), Arithmetic(self, self.masks)
        self._places = {block: i for i, block in enumerate(self.flow.blocks)}
        for _, name in function.arguments:
            self.know_always(name, self.name(name))

    def name(self, argument: str) -> str:
        """The name here of an argument."""
        return f"%v{self.numbers[argument]}"

    def text(self, symbol: str, linkage: str) -> str:
        """The definition of the wide function."""
        arguments = [f"{wide(kind) if self._kinds[name] is True else kind} {self.name(name)}"
                     for kind, name in self.function.arguments]
        arguments += [f"{MASK} %mask"] if self.masked else []
        self.masks.reset(None)
        self._run(self.flow.order)
        kind = self.function.result
        shown = wide(kind) if self._differs else kind
        value = "" if kind == "void" else f" {self.load_slot('%returned', shown)}"
        head = f"define {linkage}{shown} @{symbol}({', '.join(arguments)}) {_ATTRIBUTES} {{"
        return "\n".join([head, "entry:", *self.slot_lines(), *self.body, f"  ret {shown}{value}", "}", ""])

    # -- order -------------------------------------------------------------------------------------------------------
    def phis(self, block: str) -> list:
        """The phis of a block."""
        return [one for one in self.function.blocks[block] if one.op == "phi"]

    def _run(self, order):
        for one in order:
            if isinstance(one, Loop):
                self._run_loop(one)
            else:
                self._run_block(one)

    def _run_loop(self, loop):
        head, label = loop.head, f"loop{self._places[loop.head]}"
        alive = self.masks.enter(head, [edge for edge in self.flow.into[head] if not self.flow.is_back(edge)])
        self.out(f"br i1 {alive}, label %{label}.round, label %{label}.end")
        self.begin(f"{label}.round", jump=False)
        self.masks.reset(loop)
        for one in self.phis(head):
            number, kind = self.numbers[one.name], self.kind(one)
            self.store_slot(f"%slot{number}", kind, self.load_slot(f"%next{number}", kind))
        self._run(loop.order)
        again = self.masks.enter(head, [edge for edge in self.flow.into[head] if self.flow.is_back(edge)])
        self.out(f"br i1 {again}, label %{label}.round, label %{label}.end")
        self.begin(f"{label}.end", jump=False)

    def _run_block(self, block):
        label = f"b{self._places[block]}"
        self.block, self.masks.alive = block, self._alive(block)
        if self.masks.alive != "true" and not self._is_cheap(block):
            self.out(f"br i1 {self.masks.alive}, label %{label}, label %{label}.end")
            self.begin(label, jump=False)
            self.masks.alive = "true"
        *code, last = self.function.blocks[block]
        for one in code:
            self._operation(one)
        if last.op == "ret" and last.operands:
            kind, value = last.operands[0]
            self.store_slot("%returned", wide(kind) if self._differs else kind, self.use(kind, value, self._differs))
        self.masks.leave(last)
        self.begin(f"{label}.end")

    def _alive(self, block) -> str:
        """Whether any lane runs a block."""
        leader, loop = self.found.leader(block), self.flow.loop_of(block)
        if leader == (loop.head if loop else self.flow.entry):
            return "true"
        slot = f"%alive.{self._places[leader]}"
        if leader != block:
            return self.load_slot(slot, "i1")
        alive = self.masks.enter(block, self.flow.into[block])
        self.store_slot(slot, "i1", alive)
        return alive

    def _is_cheap(self, block):
        code = self.function.blocks[block]
        return len(code) <= _CHEAP and all(one.op in _HARMLESS for one in code)

    def _operation(self, one):
        if one.op in ("load", "store", "getelementptr", "alloca", "call"):
            getattr(self._memory, one.op)(one)
        elif one.op != "phi":
            self._arithmetic.operation(one)
