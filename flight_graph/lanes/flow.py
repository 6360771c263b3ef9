"""Where control goes in a function: edges, dominators, loops, and an order of its blocks in which loops stay together."""

from dataclasses import dataclass, field

from flight_graph.lanes.ir_text import Function
from flight_graph.lanes.ir_types import NotWidened

END = ""  # stands behind every block that leaves the function


@dataclass(frozen=True)
class Edge:
    """The way from a block to another one. index: which of the targets of its branch."""

    origin: str
    target: str
    index: int


@dataclass
class Loop:
    """A natural loop. blocks: all of it, those of inner loops too; order: blocks and inner loops as they run."""

    head: str
    blocks: set
    parent: "Loop | None" = None
    order: list = field(default_factory=list)

    def __hash__(self):
        return hash(self.head)

    def __eq__(self, other):
        return self is other

    def within(self):
        """This loop and those around it."""
        loop = self
        while loop is not None:
            yield loop
            loop = loop.parent


class Flow:
    """The flow of a function. order: its blocks and outermost loops."""

    def __init__(self, function: Function):
        self.blocks = list(function.blocks)
        self.entry = self.blocks[0]
        self.out = {block: self._edges(block, code[-1]) for block, code in function.blocks.items()}
        self.into = {block: [] for block in self.blocks}
        for edges in self.out.values():
            for edge in edges:
                self.into[edge.target].append(edge)
        after = {block: [edge.target for edge in self.out[block]] or [END] for block in self.blocks}
        before = {block: [edge.origin for edge in self.into[block]] for block in self.blocks}
        leaving = [block for block in self.blocks if not self.out[block]]
        self.dominator = _dominators(self.entry, {**after, END: []}, {**before, END: leaving})
        self.after = _dominators(END, {**before, END: leaving}, after)
        self.loops = self._loops()
        self.order = self._ordered(None)

    def _edges(self, block, last):
        if last.op in ("br", "switch"):
            return [Edge(block, target, i) for i, target in enumerate(last.labels)]
        return []

    def dominates(self, a: str, b: str, tree: dict) -> bool:
        """Whether a lies on every way to b."""
        while b is not None:
            if a == b:
                return True
            b = tree.get(b)
        return False

    def loop_of(self, block: str) -> Loop | None:
        """The innermost loop around a block."""
        return self._innermost.get(block)

    def leaves(self, edge: Edge) -> list[Loop]:
        """The loops that an edge leaves, from inside."""
        loop = self.loop_of(edge.origin)
        return [one for one in (loop.within() if loop else ()) if edge.target not in one.blocks]

    def is_head(self, block: str) -> bool:
        """Whether a loop begins with a block."""
        loop = self.loop_of(block)
        return loop is not None and loop.head == block

    def is_back(self, edge: Edge) -> bool:
        """Whether an edge goes back to the head of a loop around it."""
        return self.is_head(edge.target) and edge.origin in self.loop_of(edge.target).blocks

    def home(self, edge: Edge) -> Loop | None:
        """The innermost loop in whose rounds an edge is taken or not."""
        loop = self.loop_of(edge.target)
        return loop.parent if self.is_head(edge.target) and edge.origin not in loop.blocks else loop

    def alike(self, block: str) -> str | None:
        """The nearest block before that runs exactly when this one does, in the same round of the same loop."""
        loop, other = self.loop_of(block), self.dominator.get(block)
        while other is not None:
            if self.loop_of(other) is loop and self.dominates(block, other, self.after):
                return other
            other = self.dominator.get(other)
        return None

    def _loops(self):
        found = {}
        for edges in self.out.values():
            for edge in edges:
                if self.dominates(edge.target, edge.origin, self.dominator):
                    body, waiting = found.setdefault(edge.target, {edge.target}), [edge.origin]
                    while waiting:
                        block = waiting.pop()
                        if block not in body:
                            body.add(block)
                            waiting += [into.origin for into in self.into[block]]
        loops = [Loop(head, body) for head, body in found.items()]
        self._innermost = {}
        for loop in sorted(loops, key=lambda loop: -len(loop.blocks)):
            loop.parent = self._innermost.get(loop.head)
            self._innermost.update(dict.fromkeys(loop.blocks, loop))
        for loop in loops:
            loop.order = self._ordered(loop)
        return loops

    def _ordered(self, around):
        """Blocks and inner loops directly inside of a loop (None: the function), each behind all that come to it."""
        def place(block):
            """The block itself, or the loop directly inside of ``around`` that it belongs to; None: outside."""
            for loop in (self.loop_of(block).within() if self.loop_of(block) else ()):
                if loop is around:
                    return block
                if loop.parent is around:
                    return loop
            return block if around is None else None

        def targets(one):
            for block in sorted(one.blocks) if isinstance(one, Loop) else [one]:
                for edge in self.out[block]:
                    target = place(edge.target)
                    if target is not None and target is not one and target != one and target != head:
                        yield target

        head = around.head if around else self.entry
        first = head if around is None and self.loop_of(head) is None else (head if around else place(head))
        done, result, stack = set(), [], [(first, targets(first))]
        active = {first}
        done.add(first)
        while stack:
            one, rest = stack[-1]
            following = next(rest, None)
            if following is None:
                stack.pop()
                active.discard(one)
                result.append(one)
            elif following in active:
                raise NotWidened("a loop with two entries")
            elif following not in done:
                done.add(following)
                active.add(following)
                stack.append((following, targets(following)))
        return result[::-1]


def _dominators(root, after, before):
    """block -> the nearest block on every way from the root to it."""
    order, seen, stack = [], {root}, [(root, iter(after[root]))]
    while stack:
        block, rest = stack[-1]
        following = next(rest, None)
        if following is None:
            stack.pop()
            order.append(block)
        elif following not in seen:
            seen.add(following)
            stack.append((following, iter(after[following])))
    order.reverse()
    number, tree, changed = {block: i for i, block in enumerate(order)}, {root: None}, True
    while changed:
        changed = False
        for block in order[1:]:
            known = [other for other in before[block] if other in tree]
            best = known[0]
            for other in known[1:]:
                while best != other:
                    if number[best] > number[other]:
                        best = tree[best]
                    else:
                        other = tree[other]
            if tree.get(block, ...) != best:
                tree[block], changed = best, True
    return tree
