"""Which lanes run a block: masks, how they pass along edges, and which value a phi takes in which lane."""

from flight_graph.lanes import operations
from flight_graph.lanes.divergence import ROOT
from flight_graph.lanes.emission import Emission
from flight_graph.lanes.ir_types import NotWidened
from flight_graph.lanes.operations import MASK, wide

ALL = "splat (i1 true)"


class Masks:
    """The masks of an `Emission`. root: the mask that a function is called with; None: it works for all lanes.

    A block is alive where a lane runs it. ``alive`` is that of the block that is being written.
    """

    def __init__(self, emission: Emission, root: str | None):
        self._here, self._root, self.alive = emission, root, "true"
        self._places = {block: i for i, block in enumerate(emission.flow.blocks)}
        self._edges = {edge: i for i, edge in enumerate(edge for edges in emission.flow.out.values() for edge in edges)}
        self._arrived = set()

    # -- of blocks ---------------------------------------------------------------------------------------------------
    def of_block(self, block: str) -> str | None:
        """The lanes that run a block, where it runs; None: all."""
        return self._of_base(self._here.found.base[block])

    def here(self) -> str | None:
        """The lanes that run this block."""
        return self.of_block(self._here.block)

    def _of_base(self, base):
        return self._root if base == ROOT else self._here.load_slot(self._slot(base), MASK)

    def _slot(self, base):
        kind, place = base
        return self._here.slot(f"%mask.{kind}.{(self._places if isinstance(place, str) else self._edges)[place]}", MASK)

    def enter(self, block: str, edges: list) -> str:
        """Before a block: which lanes come to it by these edges. Returns whether any does."""
        here, base = self._here, self._here.found.base[block]
        alive = here.either("i1", [here.load_slot(self._alive_slot(edge), "i1") for edge in edges])
        if base in (("block", block), ("loop", block)):
            here.store_slot(self._slot(base), MASK, here.either(MASK, [self._of_edge(edge) for edge in edges]))
        return alive

    # -- of edges ----------------------------------------------------------------------------------------------------
    def _alive_slot(self, edge):
        return self._here.slot(f"%taken.{self._edges[edge]}", "i1")

    def _of_edge(self, edge):
        """The lanes that have taken an edge."""
        here, base = self._here, self._here.found.edge_base[edge]
        if base in (("edge", edge), ("left", edge)):
            return here.load_slot(self._slot(base), MASK)
        alive = here.load_slot(self._alive_slot(edge), "i1")
        return here.pick("i1", alive, MASK, self._of_base(base) or ALL, "zeroinitializer")

    def reset(self, loop) -> None:
        """No lane has taken the edges yet that belong to a round of a loop (None: to the function)."""
        for edge in self._edges:
            if self._here.flow.home(edge) is loop:
                self._here.store_slot(self._alive_slot(edge), "i1", "false")
                base = self._here.found.edge_base[edge]
                if base == ("left", edge):
                    self._here.store_slot(self._slot(base), MASK, "zeroinitializer")

    def leave(self, last) -> None:
        """The end of a block: lanes take its edges, and phis their values."""
        here = self._here
        edges, differs = here.flow.out[here.block], here.found.condition_differs(here.block)
        conditions = self._conditions(last, edges, differs)
        incoming = [(edge, one, self._incoming(edge, one)) for edge in edges for one in here.phis(edge.target)]
        taken = {edge: self._take(edge, condition, differs) for edge, condition in zip(edges, conditions)}
        for edge, one, value in incoming:
            self._arrive(edge, one, value, *taken[edge])

    def _conditions(self, last, edges, differs):
        """The condition of each edge; None: always."""
        if len(edges) < 2:
            return [None] * len(edges)
        here, (kind, value) = self._here, last.operands[0]
        given, shown, truth = here.use(kind, value, differs), wide(kind) if differs else kind, MASK if differs else "i1"
        if last.op == "br":
            return [given, here.negated(truth, given)]
        cases = [here.result(f"icmp eq {shown} {given}, {operations.constant(kind, case) if differs else case}")
                 for case in last.detail]
        return [here.negated(truth, here.either(truth, cases)), *cases]

    def _take(self, edge, condition, differs):
        """Note which lanes take an edge. Returns (whether all that are here do or none, their mask).

        The first is None where lanes part; a mask that is None stands for all lanes.
        """
        here, base = self._here, self._here.found.edge_base[edge]
        own = self.here()
        if base == here.found.base[edge.origin]:
            alive = condition or self.alive
            if condition and self.alive != "true":
                alive = here.pick("i1", self.alive, "i1", condition, "false")
            here.store_slot(self._alive_slot(edge), "i1", alive)
            return alive, own
        mask = own or ALL
        if condition is not None and differs:
            mask = condition if own is None else here.result(f"and {MASK} {own}, {condition}")
        elif condition is not None:
            mask = here.pick("i1", condition, MASK, mask, "zeroinitializer")
        if self.alive != "true":
            mask = here.pick("i1", self.alive, MASK, mask, "zeroinitializer")
        total = mask
        if base[0] == "left":
            total = here.either(MASK, [here.load_slot(self._slot(base), MASK), mask])
        here.store_slot(self._slot(base), MASK, total)
        here.store_slot(self._alive_slot(edge), "i1", here.some(total))
        return None, mask

    def _incoming(self, edge, one):
        value = next(value for (_, value), label in zip(one.operands, one.labels) if label == edge.origin)
        return self._here.use(one.type, value, self._here.is_wide(one.name))

    def _arrive(self, edge, one, value, alive, mask):
        """A phi takes its value: where others may have come on other edges before, in the lanes that take this one."""
        here = self._here
        is_head = here.flow.is_head(edge.target)
        slot, kind = f"%{'next' if is_head else 'slot'}{here.numbers[one.name]}", here.kind(one)
        group = one.name, is_head and here.flow.is_back(edge)
        if group in self._arrived or here.found.edge_base[edge][0] == "left":
            value = self._chosen(kind, value, here.load_slot(slot, kind), alive, mask, here.is_wide(one.name))
        self._arrived.add(group)
        here.store_slot(slot, kind, value)

    def _chosen(self, kind, value, before, alive, mask, is_wide):
        if not is_wide and alive is None:
            raise NotWidened("a number that is the same in all lanes, of lanes that parted")
        if alive is not None and alive != "true":
            value = self._here.pick("i1", alive, kind, value, before)
        return self._here.pick(MASK, mask, kind, value, before) if is_wide and mask is not None else value
