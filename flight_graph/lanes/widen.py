"""A function that works on eight lanes, made of one that works on one record of each kind.

    void part(int64 t_ns, P *, X *, void **io)      ->      void part(int64 t_ns, P8 *, X8 *, void **io)

A woven record has its numbers at eight times their offset, those of the lanes side by side. Every block of the function is
run by a mask of lanes, one after the other in an order in which all that leads to a block comes before it; a block that no
lane needs is jumped over. Loops go on until no lane needs another round. Between blocks values live in slots on the stack,
which LLVM makes registers of. No operation changes but in its width, so the bits of a lane are those of the function.
"""

from flight_graph.lanes import operations
from flight_graph.lanes.divergence import ROOT, Divergence, Place
from flight_graph.lanes.flow import Flow, Loop
from flight_graph.lanes.ir_text import BINARY, CASTS, Function, Instruction, NotWidened, size_of
from flight_graph.lanes.memory_access import Memory
from flight_graph.lanes.operations import LANES, MASK, wide

_CHEAP = 10  # operations of a block that is worked through rather than jumped over
_ATTRIBUTES = 'nounwind "prefer-vector-width"="512" "min-legal-vector-width"="512"'


class Module:
    """All functions of a module, and the wide ones that are made of them.

    parameters: bytes of a component's parameters; differs: (begin, end) of those that differ between lanes. widths: record
    (as `Place.root` names it) -> offset -> bytes of the number there.
    """

    def __init__(self, functions: dict[str, Function], parameters: int, differs: list[tuple[int, int]],
                 widths: dict[str, dict[int, int]]):
        self.functions, self.parameters, self.differs, self.widths = functions, parameters, differs, widths
        self.texts, self.declared, self._known = [], set(), {}

    def entry(self, name: str, symbol: str) -> None:
        """Make the wide form of a part."""
        function = self.functions[f"@{name}"]
        t_ns, p, x, io = (argument for _, argument in function.arguments)
        parameters = Place("parameters" if self.differs else "one", "parameters", 0)
        kinds = {t_ns: False, p: parameters, x: Place("lanes", "state", 0), io: Place("table", "io", 0)}
        self._make(function, symbol, kinds, False, False, "")

    def version(self, callee: str, kinds: tuple, masked: bool, differs: bool) -> str:
        """Name of the wide form of a function for arguments of these kinds."""
        key = callee, kinds, masked, differs
        if key not in self._known:
            function = self.functions.get(f"@{callee}")
            if function is None:
                raise NotWidened(f"a call of {callee}")
            self._known[key] = symbol = f"lanes.{len(self._known)}"
            arguments = {name: kind for (_, name), kind in zip(function.arguments, kinds)}
            self._make(function, symbol, arguments, masked, differs, "internal ")
        return self._known[key]

    def _make(self, function, symbol, kinds, masked, differs, linkage):
        self.texts.append(Widened(self, function, kinds, masked, differs).text(symbol, linkage))

    def declare(self, line: str) -> None:
        """A function of LLVM that is called."""
        self.declared.add(line)

    def text(self) -> str:
        """The wide functions as intermediate code."""
        return "\n".join([*sorted(self.declared), *self.texts])


class Widened:
    """The wide form of one function. kinds: of its arguments, as `Divergence` takes them; masked: for some lanes only."""

    def __init__(self, module: Module, function: Function, kinds: dict, masked: bool, differs: bool):
        self.module, self.function, self._kinds, self.masked, self._result_differs = module, function, kinds, masked, differs
        self.flow = Flow(function)
        self.found = Divergence(function, self.flow, kinds, module.differs)
        self._numbers = {name: i for i, (_, name) in enumerate(function.arguments)}
        for name in self.found.code:
            self._numbers[name] = len(self._numbers)
        self._places = {block: i for i, block in enumerate(self.flow.blocks)}
        self._edges = {edge: i for i, edge in enumerate(edge for edges in self.flow.out.values() for edge in edges)}
        self._slots, self.lines, self.body, self._temporary = {}, [], [], 0
        self.memory, self._stored, self._known = Memory(self), set(), {}
        self._shared = self._used_elsewhere()

    # -- text --------------------------------------------------------------------------------------------------------
    def text(self, symbol: str, linkage: str) -> str:
        """The definition of the wide function."""
        arguments = []
        for kind, name in self.function.arguments:
            given = self._kinds[name]
            arguments.append(f"{wide(kind) if given is True else kind} {self.name(name)}")
            self._known[name] = self.name(name)
        self._arguments = dict(self._known)
        if self.masked:
            arguments.append(f"{MASK} %mask")
        self._begin_parameters()
        self._edge_reset(None)
        self._run(self.flow.order)
        result, value = self.function.result, self._returned()
        shown = wide(result) if self._result_differs else result
        slots = [f"  {slot} = alloca {kind}, align {64 if kind.startswith('[') and 'i8' in kind else 8}"
                 for slot, (kind, _) in self._slots.items()]
        slots += [f"  store {kind} zeroinitializer, ptr {slot}" for slot, (kind, zero) in self._slots.items() if zero]
        return "\n".join([f"define {linkage}{shown} @{symbol}({', '.join(arguments)}) {_attributes()} {{", "entry:", *slots,
                          *self.body, f"  ret {'void' if value is None else f'{shown} {value}'}", "}", ""])

    def _begin_parameters(self):
        for name, place in self._kinds.items():
            if isinstance(place, Place) and place == Place("one", "parameters", 0) and not self.masked and (
                    "table" in {getattr(kind, "space", "") for kind in self._kinds.values()}):
                behind = self.new()
                self.out(f"{behind} = getelementptr i8, ptr {self.name(name)}, i64 {LANES * self.module.parameters}")
                self._arguments[name] = behind

    def _returned(self):
        for block, code in self.function.blocks.items():
            if code[-1].op == "ret" and code[-1].operands:
                self._known = dict(self._arguments)
                kind = wide(self.function.result) if self._result_differs else self.function.result
                return self.load_slot("%returned", kind)
        return None

    def out(self, line: str) -> None:
        """Write an operation."""
        self.body.append(f"  {line}")

    def new(self) -> str:
        """A name for a value."""
        self._temporary += 1
        return f"%t{self._temporary}"

    def name(self, value: str) -> str:
        """The name here of a value of the function."""
        return f"%v{self._numbers[value]}"

    def slot(self, name: str, kind: str, zero: bool = True) -> str:
        """A place on the stack."""
        self._slots.setdefault(name, (kind, zero))
        return name

    def load_slot(self, name: str, kind: str) -> str:
        """Read a place on the stack."""
        value = self.new()
        self.out(f"{value} = load {kind}, ptr {self.slot(name, kind)}")
        return value

    def store_slot(self, name: str, kind: str, value: str) -> None:
        """Write to a place on the stack."""
        self.out(f"store {kind} {value}, ptr {self.slot(name, kind)}")

    # -- values ------------------------------------------------------------------------------------------------------
    def _used_elsewhere(self):
        used = set()
        for block, code in self.function.blocks.items():
            for one in code:
                for (_, value), place in zip(one.operands, one.labels if one.op == "phi" else [block] * len(one.operands)):
                    definition = self.found.code.get(value)
                    if definition is not None and (definition.block != place or definition.op == "phi"):
                        used.add(value)
        return used

    def is_wide(self, value: str) -> bool:
        """Whether a value is kept for each lane."""
        return value in self.found.varying

    def kind(self, one: Instruction) -> str:
        """The type of a result here."""
        return wide(one.type) if self.is_wide(one.name) else one.type

    def use(self, kind: str, value: str, as_wide: bool) -> str:
        """A value for an operation, the same one for all lanes or one for each."""
        if not value.startswith("%"):
            return operations.constant(kind, value) if as_wide else value
        found = self._known.get(value)
        if found is None:
            one = self.found.code[value]
            found = self.load_slot(f"%slot{self._numbers[value]}", self.kind(one))
            self._known[value] = found
        if as_wide and not self.is_wide(value):
            return self.spread(kind, found, value)
        if not as_wide and self.is_wide(value):
            raise NotWidened(f"one number is needed where {value} has one for each lane")
        return found

    def spread(self, kind: str, value: str, key: str | None = None) -> str:
        """A number in all lanes."""
        if key is not None and (known := self._known.get((key, "spread"))):
            return known
        if kind == "ptr":
            number = self.new()
            self.out(f"{number} = ptrtoint ptr {value} to i64")
            kind, value = "i64", number
        if kind.startswith(("[", "{")):
            return self._spread_all(kind, value)
        first, all_ = self.new(), self.new()
        self.out(f"{first} = insertelement {wide(kind)} poison, {kind} {value}, i64 0")
        self.out(f"{all_} = shufflevector {wide(kind)} {first}, {wide(kind)} poison, <{LANES} x i32> zeroinitializer")
        if key is not None:
            self._known[key, "spread"] = all_
        return all_

    def _spread_all(self, kind, value):
        found = "poison"
        count = int(kind[1:].split(" x ")[0]) if kind.startswith("[") else len(operations.split(kind[1:-1]))
        for i in range(count):
            item, made = operations.item_at(kind, [i]), self.new()
            self.out(f"{made} = extractvalue {kind} {value}, {i}")
            made, before = self.spread(item, made), found
            found = self.new()
            self.out(f"{found} = insertvalue {wide(kind)} {before}, {wide(item)} {made}, {i}")
        return found

    def define(self, one: Instruction, value: str) -> None:
        """Keep the result of an operation."""
        self._known[one.name] = value
        if one.name in self._shared:
            self.store_slot(f"%slot{self._numbers[one.name]}", self.kind(one), value)

    # -- masks -------------------------------------------------------------------------------------------------------
    def mask_of(self, base) -> str | None:
        """The lanes of a base; None: all."""
        if base == ROOT:
            return "%mask" if self.masked else None
        known = self._known.get(("mask", base))
        if known is None:
            known = self._known["mask", base] = self.load_slot(self._mask_slot(base), MASK)
        return known

    def _mask_slot(self, base):
        kind, place = base
        return self.slot(f"%mask.{kind}.{self._edges[place] if kind in ('edge', 'left') else self._places[place]}", MASK)

    def _live_slot(self, edge):
        return self.slot(f"%live.{self._edges[edge]}", "i1")

    def edge_mask(self, edge) -> str:
        """The lanes that take an edge, as a vector."""
        base = self.found.edge_base[edge]
        if base in (("edge", edge), ("left", edge)):
            return self.load_slot(self._mask_slot(base), MASK)
        live = self.load_slot(self._live_slot(edge), "i1")
        made = self.new()
        self.out(f"{made} = select i1 {live}, {MASK} {self.mask_of(base) or 'splat (i1 true)'}, {MASK} zeroinitializer")
        return made

    def some(self, mask: str) -> str:
        """Whether there is a lane in a mask."""
        number, found = self.new(), self.new()
        self.out(f"{number} = bitcast {MASK} {mask} to i{LANES}")
        self.out(f"{found} = icmp ne i{LANES} {number}, 0")
        return found

    def either(self, kind: str, values: list[str]) -> str:
        """The "or" of truths, or of masks."""
        found = values[0]
        for value in values[1:]:
            made = self.new()
            self.out(f"{made} = or {kind} {found}, {value}")
            found = made
        return found

    # -- order of blocks ---------------------------------------------------------------------------------------------
    def begin(self, label: str) -> None:
        """A new block here: what is known from before is read again."""
        self.out(f"br label %{label}")
        self.body.append(f"{label}:")
        self._known = dict(self._arguments)

    def _edge_reset(self, loop):
        """No lane has taken the edges yet that belong to a round of a loop (None: to the function)."""
        for edge in self._edges:
            if self.flow.home(edge) is loop:
                self.store_slot(self._live_slot(edge), "i1", "false")
                if self.found.edge_base[edge] == ("left", edge):
                    self.store_slot(self._mask_slot(("left", edge)), MASK, "zeroinitializer")

    def _run(self, order):
        self._known = dict(self._arguments)
        for one in order:
            if isinstance(one, Loop):
                self._run_loop(one)
            else:
                self._run_block(one)

    def _enter(self, block, edges) -> str:
        """What is to be known before a block: whether any lane comes to it by these edges, and which. Returns whether."""
        live = self.either("i1", [self.load_slot(self._live_slot(edge), "i1") for edge in edges])
        if self.found.base[block] in (("block", block), ("loop", block)):
            mask = self.either(MASK, [self.edge_mask(edge) for edge in edges])
            self.store_slot(self._mask_slot(self.found.base[block]), MASK, mask)
            self._known.pop(("mask", self.found.base[block]), None)
        return live

    def _run_loop(self, loop):
        head, label = loop.head, f"loop{self._places[loop.head]}"
        entering = [edge for edge in self.flow.into[head] if not self.flow.is_back(edge)]
        if entering:
            live = self._enter(head, entering)
            self.out(f"br i1 {live}, label %{label}.round, label %{label}.end")
        else:
            self.out(f"br label %{label}.round")
        self.body.append(f"{label}.round:")
        self._edge_reset(loop)
        self._known = dict(self._arguments)
        for one in self._phis(head):
            number = self._numbers[one.name]
            value = self.load_slot(f"%next{number}", self.kind(one))
            self.store_slot(f"%slot{number}", self.kind(one), value)
        for one in loop.order:
            if isinstance(one, Loop):
                self._run_loop(one)
            else:
                self._run_block(one)
        self._known = dict(self._arguments)
        again = self._enter(head, [edge for edge in self.flow.into[head] if self.flow.is_back(edge)])
        self.out(f"br i1 {again}, label %{label}.round, label %{label}.end")
        self.body.append(f"{label}.end:")
        self._known = dict(self._arguments)

    def _always(self, block) -> bool:
        """Whether a block runs in every round of its loop, or whenever the function runs."""
        leader, loop = self.found.leader(block), self.flow.loop_of(block)
        return leader == (loop.head if loop else self.flow.entry)

    def _phis(self, block):
        return [one for one in self.function.blocks[block] if one.op == "phi"]

    def _run_block(self, block):
        place, leader = self._places[block], self.found.leader(block)
        self.live = "true"
        if not self._always(block):
            slot = f"%alive.{self._places[leader]}"
            if leader == block:
                self.live = self._enter(block, self.flow.into[block])
                self.store_slot(slot, "i1", self.live)
            else:
                self.live = self.load_slot(slot, "i1")
            if not self._is_cheap(block):
                self.out(f"br i1 {self.live}, label %b{place}, label %b{place}.end")
                self.body.append(f"b{place}:")
                self._known, self.live = dict(self._arguments), "true"
        self.block = block
        for one in self.function.blocks[block]:
            self._operation(one)
        self._leave(block)
        self.begin(f"b{place}.end")

    def _is_cheap(self, block):
        code = [one for one in self.function.blocks[block] if one.op not in ("phi", "br")]
        if len(code) > _CHEAP:
            return False
        return all(one.op in ("fadd", "fsub", "fmul", "fneg", "add", "sub", "mul", "and", "or", "xor", "icmp", "fcmp", "select",
                              "zext", "sext", "trunc", "sitofp", "bitcast", "ret") for one in code)

    # -- ends of blocks ----------------------------------------------------------------------------------------------
    def _leave(self, block):
        last = self.function.blocks[block][-1]
        if last.op == "ret" and last.operands:
            kind, value = last.operands[0]
            kind_here = wide(kind) if self._result_differs else kind
            if not self._result_differs and self.found.differs(value, block):
                raise NotWidened("a result that differs between lanes")
            self.store_slot("%returned", kind_here, self.use(kind, value, self._result_differs))
        edges, differs = self.flow.out[block], self.found.condition_differs(block)
        conditions = self._conditions(last, edges, differs)
        incoming = [(edge, one, self._incoming(edge, one)) for edge in edges for one in self._phis(edge.target)]
        masks = {edge: self._take(edge, condition, differs) for edge, condition in zip(edges, conditions)}
        for edge, one, value in incoming:
            self._arrive(edge, one, value, *masks[edge])

    def _conditions(self, last, edges, differs):
        """The condition of each edge; None: always."""
        if len(edges) < 2:
            return [None] * len(edges)
        kind, value = last.operands[0]
        given, shown = self.use(kind, value, differs), wide(kind) if differs else kind
        truth = MASK if differs else "i1"
        if last.op == "br":
            return [given, self._not(truth, given)]
        cases = []
        for case in last.detail:
            made = self.new()
            self.out(f"{made} = icmp eq {shown} {given}, {operations.constant(kind, case) if differs else case}")
            cases.append(made)
        return [self._not(truth, self.either(truth, cases)), *cases]

    def _not(self, kind, value):
        made = self.new()
        self.out(f"{made} = xor {kind} {value}, {'splat (i1 true)' if kind == MASK else 'true'}")
        return made

    def _take(self, edge, condition, differs):
        """Note which lanes take an edge. Returns (whether any does, mask or None, whether all of the block's do)."""
        base, own = self.found.edge_base[edge], self.mask_of(self.found.base[edge.origin])
        if base == self.found.base[edge.origin]:
            live = self._both(self.live, condition)
            self.store_slot(self._live_slot(edge), "i1", live)
            return live, own, condition is None
        if condition is None:
            mask = own or "splat (i1 true)"
        elif differs:
            mask = condition
            if own is not None:
                mask = self.new()
                self.out(f"{mask} = and {MASK} {own}, {condition}")
        else:
            mask = self.new()
            self.out(f"{mask} = select i1 {condition}, {MASK} {own or 'splat (i1 true)'}, {MASK} zeroinitializer")
        if self.live != "true":
            made = self.new()
            self.out(f"{made} = select i1 {self.live}, {MASK} {mask}, {MASK} zeroinitializer")
            mask = made
        total = mask
        if base[0] == "left":
            total = self.either(MASK, [self.load_slot(self._mask_slot(base), MASK), mask])
        self.store_slot(self._mask_slot(base), MASK, total)
        self.store_slot(self._live_slot(edge), "i1", self.some(total))
        return None, mask, False

    def _both(self, live, condition):
        if condition is None or live == "true":
            return condition or live
        made = self.new()
        self.out(f"{made} = select i1 {live}, i1 {condition}, i1 false")
        return made

    def _incoming(self, edge, one):
        value = next(value for (_, value), label in zip(one.operands, one.labels) if label == edge.origin)
        return self.use(one.type, value, self.is_wide(one.name))

    def _arrive(self, edge, one, value, live, mask, whole):
        """A phi takes its value on an edge: in the lanes that take it, where others came on other edges before."""
        head = self.flow.loop_of(edge.target)
        is_head = head is not None and head.head == edge.target
        slot, kind = f"%{'next' if is_head else 'slot'}{self._numbers[one.name]}", self.kind(one)
        group = one.name, is_head and self.flow.is_back(edge)
        left = self.found.edge_base[edge][0] == "left"
        if group in self._stored or left:
            before = self.load_slot(slot, kind)
            value = self._chosen(kind, value, before, live, mask, self.is_wide(one.name))
        self._stored.add(group)
        self.store_slot(slot, kind, value)

    def _chosen(self, kind, value, before, live, mask, is_wide):
        if not is_wide:
            if live is None:
                raise NotWidened("a number that is the same in all lanes, of lanes that parted")
            return self.pick("i1", live, kind, value, before)
        if live is not None and live != "true":
            value = self.pick("i1", live, kind, value, before)
        return value if mask is None else self.pick(MASK, mask, kind, value, before)

    def pick(self, truth: str, condition: str, kind: str, value: str, other: str) -> str:
        """One of two values, lane by lane."""
        if truth == MASK and kind.startswith(("[", "{")):
            raise NotWidened("a group of numbers that differ between lanes, of lanes that parted")
        made = self.new()
        self.out(f"{made} = select {truth} {condition}, {kind} {value}, {kind} {other}")
        return made

    # -- operations --------------------------------------------------------------------------------------------------
    def _operation(self, one):
        if one.op in ("phi", "br", "switch", "ret", "unreachable"):
            return
        is_wide = one.name is not None and self.is_wide(one.name)
        if one.op in ("load", "store", "getelementptr", "alloca"):
            getattr(self.memory, one.op)(one)
        elif one.op == "call":
            self.memory.call(one)
        elif one.op == "select":
            self._select(one, is_wide)
        elif one.op in BINARY and is_wide:
            self._binary(one)
        else:
            self._plain(one, is_wide)

    def _binary(self, one):
        (kind, a), (_, b) = one.operands
        first, second = self.use(kind, a, True), self.use(kind, b, True)
        if one.op in ("sdiv", "udiv", "srem", "urem") and b.startswith("%"):
            mask = self.mask_of(self.found.base[self.block])
            if mask is not None:
                second = self.pick(MASK, mask, wide(kind), second, f"splat ({kind} 1)")
        made = self.new()
        self.out(f"{made} = {one.op} {wide(kind)} {first}, {second}")
        self.define(one, made)

    def _select(self, one, is_wide):
        (_, condition), (kind, a), (_, b) = one.operands
        differs = self.found.differs(condition, self.block)
        truth = MASK if differs else "i1"
        given = self.use("i1", condition, differs)
        shown = wide(kind) if is_wide else kind
        if differs and kind.startswith(("[", "{")):
            raise NotWidened("a choice between groups of numbers")
        self.define(one, self.pick(truth, given, shown, self.use(kind, a, is_wide), self.use(kind, b, is_wide)))

    def _plain(self, one, is_wide):
        """Comparisons, changes of type, and whatever is the same for all lanes."""
        values = [self.use(kind, value, is_wide) for kind, value in one.operands]
        kinds = [wide(kind) if is_wide else kind for kind, _ in one.operands]
        made = self.new()
        if one.op in CASTS:
            text = f"{one.op} {kinds[0]} {values[0]} to {self.kind(one)}"
        elif one.op in ("icmp", "fcmp"):
            text = f"{one.op} {one.detail} {kinds[0]} {values[0]}, {values[1]}"
        elif one.op in BINARY:
            text = f"{one.op} {kinds[0]} {values[0]}, {values[1]}"
        elif one.op in ("extractvalue", "insertvalue"):
            given = ", ".join(f"{kind} {value}" for kind, value in zip(kinds, values))
            text = f"{one.op} {given}, {', '.join(map(str, one.detail))}"
        else:
            text = f"{one.op} {kinds[0]} {values[0]}"
        self.out(f"{made} = {text}")
        self.define(one, made)


def _attributes():
    return _ATTRIBUTES


__all__ = ["Module", "Widened", "size_of"]
