"""Single operations on eight lanes: types and constants, arithmetic, memory, functions of LLVM."""

import re

from flight_graph.lanes.ir_types import NotWidened, item_at, split

LANES = 8
MASK = f"<{LANES} x i1>"
ADDRESSES = f"<{LANES} x i64>"

# functions of LLVM that exist for vectors as well -> how many of their arguments differ between lanes
_OF_VECTORS = {"fabs": 1, "sqrt": 1, "floor": 1, "ceil": 1, "trunc": 1, "rint": 1, "nearbyint": 1, "copysign": 2,
               "minnum": 2, "maxnum": 2, "minimum": 2, "maximum": 2, "umin": 2, "umax": 2, "smin": 2, "smax": 2, "ctlz": 1,
               "cttz": 1, "abs": 1, "ctpop": 1, "fshl": 3, "fshr": 3, "bswap": 1, "usub.sat": 2, "uadd.sat": 2,
               "ssub.sat": 2, "sadd.sat": 2, "is.fpclass": 1, "fptosi.sat": 1, "ucmp": 2, "scmp": 2, "bitreverse": 1}
NAMED_BY_BOTH = ("ucmp", "scmp", "fptosi.sat")  # by the type of the result, and by that of the arguments
WITHOUT_EFFECT = ("llvm.lifetime.", "llvm.assume", "llvm.experimental.noalias", "llvm.dbg.", "llvm.invariant.",
                  "llvm.donothing", "llvm.sideeffect")


def wide(kind: str) -> str:
    """The type of eight of them."""
    if kind == "ptr":
        return ADDRESSES
    if kind.startswith("["):
        count, _, item = kind[1:-1].partition(" x ")
        return f"[{count} x {wide(item)}]"
    if kind.startswith("{"):
        return f"{{ {', '.join(map(wide, split(kind[1:-1])))} }}"
    if kind.startswith("<"):
        raise NotWidened(f"the type {kind}")
    return f"<{LANES} x {kind}>"


def constant(kind: str, value: str) -> str:
    """A constant that is the same in all lanes."""
    if value in ("zeroinitializer", "undef", "poison", "null"):
        return "zeroinitializer" if value in ("null", "zeroinitializer") else value
    if kind.startswith("[") or kind.startswith("{"):
        items = [part.partition(" ") for part in split(value[1:-1])] if value[0] in "[{" else None
        if items is None:
            raise NotWidened(f"the constant {value}")
        body = ", ".join(f"{wide(item)} {constant(item, number)}" for item, _, number in items)
        return f"{value[0]} {body} {value[-1]}"
    if kind == "ptr":
        found = re.match(r"inttoptr \(i64 (-?\d+) to ptr\)", value)
        return f"splat (i64 {found[1]})" if found else f"splat (i64 ptrtoint (ptr {value} to i64))"
    return f"splat ({kind} {value})"


def vector_function(name: str) -> tuple[str, int] | None:
    """(its name without types, arguments that differ) of a function of LLVM for vectors; None: there is none."""
    found = re.match(r"llvm\.([a-z.]+?)\.(?:[if]\d+)(?:\.[if]\d+)?$", name)
    if not found or found[1] not in _OF_VECTORS:
        return None
    return found[1], _OF_VECTORS[found[1]]


def suffix(kind: str) -> str:
    """How a type is written in the name of a function of LLVM."""
    return f"v{LANES}{ {'double': 'f64', 'float': 'f32'}.get(kind, kind)}"


def aligned(size: int) -> int:
    """Alignment of eight neighbours of so many bytes in a block: records have their numbers at multiples of four bytes."""
    return {4: 32, 2: 16, 1: 8}.get(size, 32)


def count_of(kind: str) -> int:
    """How many items an array or a structure has."""
    return int(kind[1:].split(" x ")[0]) if kind.startswith("[") else len(split(kind[1:-1]))


__all__ = ["ADDRESSES", "LANES", "MASK", "NAMED_BY_BOTH", "WITHOUT_EFFECT", "aligned", "constant", "count_of", "item_at",
           "suffix", "vector_function", "wide"]
