"""Wide code as it is written: names, values that are one for all lanes or one for each, slots on the stack."""

from flight_graph.lanes import operations
from flight_graph.lanes.divergence import Divergence
from flight_graph.lanes.flow import Flow
from flight_graph.lanes.ir_text import Function, Instruction
from flight_graph.lanes.ir_types import NotWidened
from flight_graph.lanes.operations import LANES, MASK, wide


class Emission:
    """The text of one wide function, and what is known at its end. found: what differs between lanes.

    Between blocks values live in slots; LLVM makes registers of them.
    """

    def __init__(self, function: Function, kinds: dict, differs: list):
        self.function, self.flow = function, Flow(function)
        self.found = Divergence(function, self.flow, kinds, differs)
        self.numbers = {name: i for i, name in enumerate([*(name for _, name in function.arguments), *self.found.code])}
        self.body, self.block = [], ""
        self._slots, self._temporary = {}, 0
        self._known, self._always_known = {}, {}
        self._shared = self._used_elsewhere()

    # -- lines -------------------------------------------------------------------------------------------------------
    def out(self, line: str) -> None:
        """Write an operation."""
        self.body.append(f"  {line}")

    def new(self) -> str:
        """A name for a value."""
        self._temporary += 1
        return f"%t{self._temporary}"

    def result(self, text: str) -> str:
        """Write an operation that has a result; its name."""
        made = self.new()
        self.out(f"{made} = {text}")
        return made

    def begin(self, label: str, jump: bool = True) -> None:
        """A new block here: what was known is read again. jump: from the end of the one before."""
        if jump:
            self.out(f"br label %{label}")
        self.body.append(f"{label}:")
        self.forget()

    def forget(self) -> None:
        """What stands in registers of another block is not known here."""
        self._known = dict(self._always_known)

    def know_always(self, value: str, name: str) -> None:
        """A value that all blocks have: an argument, memory on the stack."""
        self._always_known[value] = self._known[value] = name

    # -- slots -------------------------------------------------------------------------------------------------------
    def slot(self, name: str, kind: str, zero: bool = True) -> str:
        """A place on the stack."""
        self._slots.setdefault(name, (kind, zero))
        return name

    def load_slot(self, name: str, kind: str) -> str:
        """Read a place on the stack."""
        return self.result(f"load {kind}, ptr {self.slot(name, kind)}")

    def store_slot(self, name: str, kind: str, value: str) -> None:
        """Write to a place on the stack."""
        self.out(f"store {kind} {value}, ptr {self.slot(name, kind)}")

    def slot_lines(self) -> list[str]:
        """The slots' own lines, at the begin of the function."""
        lines = [f"  {slot} = alloca {kind}, align {8 if zero else 64}" for slot, (kind, zero) in self._slots.items()]
        return lines + [f"  store {kind} zeroinitializer, ptr {slot}" for slot, (kind, zero) in self._slots.items() if zero]

    # -- values ------------------------------------------------------------------------------------------------------
    def _used_elsewhere(self):
        used = set()
        for block, code in self.function.blocks.items():
            for one in code:
                for (_, value), place in zip(one.operands, one.labels if one.op == "phi" else [block] * len(one.operands)):
                    definition = self.found.code.get(value)
                    if definition is not None and definition.block != place:
                        used.add(value)
        return used

    def is_wide(self, value: str | None) -> bool:
        """Whether a value is kept for each lane."""
        return value in self.found.varying

    def kind(self, one: Instruction) -> str:
        """The type of a result here."""
        return wide(one.type) if self.is_wide(one.name) else one.type

    def differs(self, value: str) -> bool:
        """Whether a value differs between the lanes of this block."""
        return self.found.differs(value, self.block)

    def use(self, kind: str, value: str, as_wide: bool) -> str:
        """A value for an operation, the same one for all lanes or one for each."""
        if not value.startswith("%"):
            return operations.constant(kind, value) if as_wide else value
        found = self._known.get(value)
        if found is None:
            one = self.found.code[value]
            found = self._known[value] = self.load_slot(f"%slot{self.numbers[value]}", self.kind(one))
        if as_wide and not self.is_wide(value):
            if (value, "spread") not in self._known:
                self._known[value, "spread"] = self.spread(kind, found)
            return self._known[value, "spread"]
        if not as_wide and self.is_wide(value):
            raise NotWidened(f"one number is needed where {value} has one for each lane")
        return found

    def define(self, one: Instruction, value: str) -> None:
        """Keep the result of an operation."""
        self._known[one.name] = value
        if one.name in self._shared:
            self.store_slot(f"%slot{self.numbers[one.name]}", self.kind(one), value)

    def spread(self, kind: str, value: str) -> str:
        """A number in all lanes."""
        if kind == "ptr":
            kind, value = "i64", self.result(f"ptrtoint ptr {value} to i64")
        if kind.startswith(("[", "{")):
            return self._spread_all(kind, value)
        first = self.result(f"insertelement {wide(kind)} poison, {kind} {value}, i64 0")
        return self.result(f"shufflevector {wide(kind)} {first}, {wide(kind)} poison, <{LANES} x i32> zeroinitializer")

    def _spread_all(self, kind, value):
        found = "poison"
        for i in range(operations.count_of(kind)):
            item = operations.item_at(kind, [i])
            made = self.spread(item, self.result(f"extractvalue {kind} {value}, {i}"))
            found = self.result(f"insertvalue {wide(kind)} {found}, {wide(item)} {made}, {i}")
        return found

    def pick(self, truth: str, condition: str, kind: str, value: str, other: str) -> str:
        """One of two values, lane by lane where the condition is a mask."""
        if truth == MASK and kind.startswith(("[", "{")):
            return self._pick_all(condition, kind, value, other)
        return self.result(f"select {truth} {condition}, {kind} {value}, {kind} {other}")

    def _pick_all(self, condition, kind, value, other):
        found = value
        for i in range(operations.count_of(kind)):
            item = operations.item_at(kind, [i])
            a, b = (self.result(f"extractvalue {kind} {group}, {i}") for group in (value, other))
            found = self.result(f"insertvalue {kind} {found}, {item} {self.pick(MASK, condition, item, a, b)}, {i}")
        return found

    def either(self, kind: str, values: list[str]) -> str:
        """The "or" of truths, or of masks."""
        found = values[0]
        for value in values[1:]:
            found = self.result(f"or {kind} {found}, {value}")
        return found

    def negated(self, kind: str, value: str) -> str:
        """The "not" of a truth, or of a mask."""
        return self.result(f"xor {kind} {value}, {'splat (i1 true)' if kind == MASK else 'true'}")

    def some(self, mask: str) -> str:
        """Whether there is a lane in a mask."""
        number = self.result(f"bitcast {MASK} {mask} to i{LANES}")
        return self.result(f"icmp ne i{LANES} {number}, 0")
