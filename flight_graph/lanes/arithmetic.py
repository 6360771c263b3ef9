"""Operations of a wide function that touch no memory."""

from flight_graph.lanes.emission import Emission
from flight_graph.lanes.ir_text import BINARY, CASTS
from flight_graph.lanes.masks import Masks
from flight_graph.lanes.operations import MASK, wide

_MAY_TRAP = ("sdiv", "udiv", "srem", "urem")


class Arithmetic:
    """Writes arithmetic, comparisons, choices and changes of type."""

    def __init__(self, emission: Emission, masks: Masks):
        self._here, self._masks = emission, masks

    def operation(self, one) -> None:
        """One operation, on all lanes or on what is the same for all."""
        is_wide = self._here.is_wide(one.name)
        if one.op == "select":
            self._select(one, is_wide)
        else:
            self._plain(one, is_wide)

    def _select(self, one, is_wide):
        here, ((_, condition), (kind, a), (_, b)) = self._here, one.operands
        differs = here.differs(condition)
        given = here.use("i1", condition, differs)
        here.define(one, here.pick(MASK if differs else "i1", given, wide(kind) if is_wide else kind,
                                   here.use(kind, a, is_wide), here.use(kind, b, is_wide)))

    def _plain(self, one, is_wide):
        here = self._here
        values = [here.use(kind, value, is_wide) for kind, value in one.operands]
        kinds = [wide(kind) if is_wide else kind for kind, _ in one.operands]
        if one.op in CASTS:
            text = f"{kinds[0]} {values[0]} to {here.kind(one)}"
        elif one.op in ("icmp", "fcmp"):
            text = f"{one.detail} {kinds[0]} {values[0]}, {values[1]}"
        elif one.op in BINARY:
            text = f"{kinds[0]} {values[0]}, {self._divisor(one, values[1], is_wide)}"
        elif one.op in ("extractvalue", "insertvalue"):
            text = ", ".join([*map(" ".join, zip(kinds, values)), *map(str, one.detail)])
        else:
            text = f"{kinds[0]} {values[0]}"
        here.define(one, here.result(f"{one.op} {text}"))

    def _divisor(self, one, value, is_wide):
        """What is divided by, but for lanes that are not to divide: a whole number by zero is a trap."""
        kind, given = one.operands[1]
        mask = self._masks.here() if is_wide and one.op in _MAY_TRAP and given.startswith("%") else None
        return value if mask is None else self._here.pick(MASK, mask, wide(kind), value, f"splat ({kind} 1)")
