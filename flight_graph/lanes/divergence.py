"""What differs between lanes: which numbers, which branches, which loops.

A number is uniform when it is the same in all lanes: it stays one number. A block is run by the lanes of a mask; masks are
named by where they begin (a base), and a block or an edge that depends on uniform branches alone has the base of what comes
before it.
"""

from dataclasses import dataclass

from flight_graph.lanes.flow import Edge, Flow
from flight_graph.lanes.ir_text import Function
from flight_graph.lanes.ir_types import NotWidened, SeveralKinds, alignment, size_of, split

ROOT = ("root",)


@dataclass(frozen=True)
class Place:
    """Where a pointer points to. space: lanes (eight records woven into each other), parameters (likewise, with one record
    of them behind), one (one record or constant for all lanes), table (addresses of records).

    root: the record; offset: in it [bytes], None where it is not a constant.
    """

    space: str
    root: str = ""
    offset: int | None = None

    def moved(self, by: int | None) -> "Place":
        """The place so many bytes further."""
        return Place(self.space, self.root, None if by is None or self.offset is None else self.offset + by)

    def joined(self, other: "Place") -> "Place":
        """A place that may be either."""
        if self == other:
            return self
        spaces = {self.space, other.space}
        if len(spaces) > 1 and not spaces <= {"lanes", "parameters"}:
            raise SeveralKinds("a pointer to records of several kinds")
        return Place("lanes" if len(spaces) > 1 else self.space, self.root if self.root == other.root else "?")


class Divergence:
    """What differs between lanes in a function, given what does among its arguments.

    arguments: name -> True (it differs), False, or a Place. differs: (first byte, end) of the parameters that do.
    """

    def __init__(self, function: Function, flow: Flow, arguments: dict, differs: list[tuple[int, int]]):
        self.flow, self._function, self._differs = flow, function, differs
        self.code = {one.name: one for block in function.blocks.values() for one in block if one.name}
        self.varying = {name for name, kind in arguments.items() if kind is True}
        self.places = {name: kind for name, kind in arguments.items() if isinstance(kind, Place)}
        self.divergent, self._alike = set(), {}
        while self._round():
            pass

    # -- pointers --------------------------------------------------------------------------------------------------
    def place(self, value: str) -> Place | None:
        """Where a pointer points to; None where it is not known yet."""
        if value.startswith("%"):
            return self.places.get(value)
        return Place("one", value)  # a constant of the module

    def step(self, one) -> int | None:
        """How far a getelementptr goes [bytes]; None where that is not a constant."""
        total, kind = 0, one.detail
        for number, (_, index) in enumerate(one.operands[1:]):
            if number and kind.startswith("{"):
                kind, total = _field(kind, int(index), total)
                continue
            if number:
                kind = kind[1:-1].partition(" x ")[2]
            if not index.lstrip("-").isdigit():
                return None
            total += int(index) * size_of(kind)
        return total

    def _pointer(self, one):
        if one.op == "alloca":
            return Place("lanes", one.name, 0)
        if one.op == "getelementptr":
            place = self.place(one.operands[0][1])
            return place and place.moved(self.step(one))
        if one.op in ("phi", "select"):
            found = None
            for _, value in one.operands[one.op == "select":]:
                place = None if value in ("null", "undef", "poison") else self.place(value)
                found = place if found is None or place is None else found.joined(place)
            return found
        if one.op == "load":
            place = self.place(one.operands[0][1])
            if place is not None and place.space == "table" and place.offset is not None:
                return Place("lanes", f"record {place.offset // 8}", 0)
        if one.op in ("freeze",):
            return self.place(one.operands[0][1])
        return None

    # -- what differs ----------------------------------------------------------------------------------------------
    def differs(self, value: str, block: str) -> bool:
        """Whether a value differs between the lanes that use it in a block."""
        if not value.startswith("%"):
            return False
        if value in self.varying:
            return True
        one = self.code.get(value)
        loop = self.flow.loop_of(one.block) if one is not None else None
        return any(around in self.divergent and block not in around.blocks for around in (loop.within() if loop else ()))

    def is_uniform_load(self, place: Place, size: int) -> bool:
        """Whether what is read there, by a pointer that does not differ, is the same in all lanes."""
        if place.space in ("one", "table"):
            return True
        return (place.space == "parameters" and place.offset is not None
                and not any(place.offset < end and begin < place.offset + size for begin, end in self._differs))

    def _round(self):
        before = len(self.varying), len(self.divergent), dict(self.places)
        self._bases()
        for block, code in self._function.blocks.items():
            for one in code:
                if not one.name:
                    continue
                if one.type == "ptr" and (place := self._pointer(one)) is not None:
                    self.places[one.name] = place
                if one.name not in self.varying and self._does_differ(one, block):
                    self.varying.add(one.name)
        return before != (len(self.varying), len(self.divergent), self.places)

    def _does_differ(self, one, block):
        if one.op == "phi":
            return self._phi_differs(one, block)
        if any(kind != "label" and self.differs(value, block) for kind, value in one.operands):
            return True
        if one.op == "load":
            place = self.place(one.operands[0][1])
            return place is not None and not self.is_uniform_load(place, size_of(one.type))
        if one.op == "call":
            places = [self.place(value) for kind, value in one.operands if kind == "ptr"]
            return any(place is None or place.space != "one" for place in places)
        return False

    def _phi_differs(self, one, block):
        values = dict(zip(one.labels, (value for _, value in one.operands)))
        if any(self.differs(values[label], label) for label in values):
            return True
        if self.flow.is_head(block):
            return False
        into = self.flow.into[block]
        if any(loop in self.divergent for edge in into for loop in self.flow.leaves(edge)):
            return True
        return len({self.edge_base[edge] for edge in into}) > 1 and len(set(values.values())) > 1

    # -- masks -----------------------------------------------------------------------------------------------------
    def leader(self, block: str) -> str:
        """The first block that runs exactly when this one does."""
        if block not in self._alike:
            other = self.flow.alike(block)
            self._alike[block] = block if other is None else self.leader(other)
        return self._alike[block]

    def condition_differs(self, block: str) -> bool:
        """Whether lanes part at the end of a block."""
        last = self._function.blocks[block][-1]
        return bool(last.operands) and last.op in ("br", "switch") and self.differs(last.operands[0][1], block)

    def _bases(self):
        """base, edge_base: masks of blocks and edges; loops whose lanes do not stay together become divergent."""
        self.base, self.edge_base = {}, {}
        self._walk(self.flow.order)
        for edges in self.flow.out.values():
            for edge in edges:
                loop = self.flow.loop_of(edge.target)
                if self.flow.is_back(edge) and self.edge_base[edge] != self.base[edge.target]:
                    self.divergent.add(loop)

    def _walk(self, order):
        for one in order:
            if not isinstance(one, str):
                self._walk(one.order)
                continue
            self.base[one] = self._base(one)
            for edge in self.flow.out[one]:
                self.edge_base[edge] = self._edge_base(edge)

    def _base(self, block):
        if self.flow.is_head(block):
            if self.flow.loop_of(block) in self.divergent:
                return ("loop", block)
            bases = {self.edge_base[edge] for edge in self.flow.into[block] if not self.flow.is_back(edge)}
        elif block == self.flow.entry:
            return ROOT
        elif self.leader(block) != block:
            return self.base[self.leader(block)]
        else:
            bases = {self.edge_base[edge] for edge in self.flow.into[block]}
        return bases.pop() if len(bases) == 1 else ("block", block)

    def _edge_base(self, edge: Edge):
        if any(loop in self.divergent for loop in self.flow.leaves(edge)):
            return ("left", edge)
        return ("edge", edge) if self.condition_differs(edge.origin) else self.base[edge.origin]


def _field(kind, index, total):
    """The type of a structure's field, and how far it lies."""
    for number, item in enumerate(split(kind[1:-1])):
        total = -(-total // alignment(item)) * alignment(item)
        if number == index:
            return item, total
        total += size_of(item)
    raise NotWidened("a field that a structure does not have")
