"""LLVM's intermediate code as data: the functions of a module, read from their text.

Only what optimised kernels consist of is read; anything else is `NotWidened`, and the kernel runs one lane at a time.
"""

import re
from dataclasses import dataclass, field

from flight_graph.lanes.ir_types import NotWidened, closing, item_at, split, take_type

NAME = r'[%@](?:"[^"]*"|[-a-zA-Z$._0-9]+)'
_INSTRUCTION = re.compile(rf"^(?:({NAME}) = )?(?:tail |musttail |notail )?([a-z]+) ?(.*)$")
_METADATA = re.compile(r", ![a-zA-Z_.]+ !?.*$")
_COMMENT = re.compile(r"\s+; .*$")
_FLAGS = re.compile(r"^(?:(?:nuw|nsw|exact|disjoint|nneg|samesign|inbounds|nusw|volatile|fast|nnan|ninf|nsz|arcp|contract"
                    r"|afn|reassoc|inrange\([^)]*\)) )+")
CASTS = {"sitofp", "uitofp", "fptosi", "fptoui", "fpext", "fptrunc", "zext", "sext", "trunc", "bitcast"}
BINARY = {"fadd", "fsub", "fmul", "fdiv", "add", "sub", "mul", "sdiv", "udiv", "srem", "urem", "and", "or", "xor", "shl",
          "lshr", "ashr"}
_FORBIDDEN_FLAGS = ("fast", "nnan", "ninf", "nsz", "arcp", "contract", "afn", "reassoc")


@dataclass
class Instruction:
    """One operation. operands: (type, value) each; detail: predicate, element type, callee or constant indices."""

    op: str
    name: str | None
    type: str
    operands: list[tuple[str, str]] = field(default_factory=list)
    detail: object = None
    labels: list[str] = field(default_factory=list)  # of phi: where each operand comes from; of branches: targets
    block: str = ""


@dataclass
class Function:
    """A function. arguments: (type, name) each; blocks: label -> instructions, the entry first."""

    name: str
    result: str
    arguments: list[tuple[str, str]]
    blocks: dict[str, list[Instruction]] = field(default_factory=dict)


def operand(text: str) -> tuple[str, str]:
    """(type, value) of ``type attributes value``."""
    kind, rest = take_type(text)
    if rest and rest[-1] in ")]}>" and not rest.startswith(("[", "{", "<")):  # a constant expression
        found = re.search(r"(?:getelementptr|splat|ptrtoint|inttoptr)\b.*$", rest)
        if not found:
            raise NotWidened(f"an operand of an unknown form: {text}")
        return kind, found[0]
    if rest.startswith(("[", "{", "<")):
        return kind, rest
    found = re.search(rf"({NAME}|\S+)$", rest)
    return kind, found[1]


def functions(text: str) -> dict[str, Function]:
    """name -> function of those that have a body."""
    found, current, block, lines = {}, None, None, iter(text.splitlines())
    for line in lines:
        if current is None:
            if line.startswith("define "):
                current = _head(line)
                block = None
            continue
        if line == "}":
            found[current.name] = current
            current = None
            continue
        line = _COMMENT.sub("", line).rstrip()
        if not line.strip():
            continue
        if not line.startswith(" "):
            block = label(line.rsplit(":", 1)[0])
            current.blocks[block] = []
            continue
        if block is None:
            block = "entry"
            current.blocks[block] = []
        line = line.strip()
        if line.startswith("switch") and line.endswith("["):
            line += " ".join(part.strip() for part in _until(lines, "]"))
        made = _instruction(line)
        if made is not None:
            made.block = block
            current.blocks[block].append(made)
    return found


def _until(lines, end):
    for line in lines:
        yield line
        if line.strip().startswith(end):
            return


def label(text: str) -> str:
    """A label without its sign and quotes."""
    return text.removeprefix("%").strip('"')


def _head(line):
    found = re.search(rf"({NAME})\(", line)
    before = line[:found.start()].split()
    end = closing(line, found.end() - 1)
    arguments = [operand(part) for part in split(line[found.end():end])]
    result = re.search(r"(void|ptr|double|float|i\d+|\{.*\}|\[.*\])$", " ".join(before))
    return Function(found[1], result[1], arguments)


def _instruction(line):
    """An operation; None for one that does nothing."""
    line = _METADATA.sub("", line)
    found = _INSTRUCTION.match(line)
    if not found:
        raise NotWidened(f"an operation of an unknown form: {line}")
    name, op, rest = found.groups()
    flags = _FLAGS.match(rest)
    if flags:
        if any(flag in flags[0].split() for flag in _FORBIDDEN_FLAGS):
            raise NotWidened(f"arithmetic that may be rearranged: {line}")
        rest = rest[flags.end():]
    reader = _READERS.get(op)
    if reader is None:
        raise NotWidened(f"the operation '{op}'")
    return reader(op, name, rest)


def _two(op, name, rest):
    first, second = split(rest)
    kind, value = operand(first)
    return Instruction(op, name, kind, [(kind, value), (kind, second)])


def _compare(op, name, rest):
    predicate, _, rest = rest.partition(" ")
    if predicate == "samesign":
        predicate, _, rest = rest.partition(" ")
    made = _two(op, name, rest)
    made.detail, made.type = predicate, "i1"
    return made


def _cast(op, name, rest):
    given, _, kind = rest.rpartition(" to ")
    return Instruction(op, name, kind, [operand(given)])


def _all(op, name, rest):
    operands = [operand(part) for part in split(rest)]
    return Instruction(op, name, operands[-1][0], operands)


def _phi(op, name, rest):
    kind, rest = take_type(rest)
    made = Instruction(op, name, kind)
    for pair in split(rest):
        value, place = split(pair.strip("[] "))
        made.operands.append((kind, value))
        made.labels.append(label(place))
    return made


def _branch(op, name, rest):
    parts = [operand(part) for part in split(rest)]
    return Instruction(op, None, "void", parts[:-2] if len(parts) == 3 else [],
                       labels=[label(value) for kind, value in parts if kind == "label"])


def _switch(op, name, rest):
    head, _, cases = rest.partition("[")
    given, default = (operand(part) for part in split(head))
    made = Instruction(op, None, "void", [given], [], [label(default[1])])
    for value, place in re.findall(rf"i\d+ (-?\d+), label ({NAME})", cases):
        made.detail.append(value)
        made.labels.append(label(place))
    return made


def _load(op, name, rest):
    kind, rest = take_type(rest)
    return Instruction(op, name, kind, [operand(split(rest.lstrip(", "))[0])])


def _store(op, name, rest):
    value, pointer = split(rest)[:2]
    return Instruction(op, None, "void", [operand(value), operand(pointer)])


def _pointer(op, name, rest):
    kind, rest = take_type(rest)
    return Instruction(op, name, "ptr", [operand(part) for part in split(rest.lstrip(", "))], kind)


def _call(op, name, rest):
    found = re.search(rf"({NAME})\(", rest)
    if not found:
        raise NotWidened("a call of an address")
    before = re.sub(r"\([^)]*\)", "", rest[:found.start()]).split()
    kind = next((word for word in reversed(before) if re.fullmatch(r"void|ptr|double|float|i\d+", word)), None)
    if kind is None:
        kind = re.search(r"[\[{].*$", rest[:found.start()].strip())[0]
    end = closing(rest, found.end() - 1)
    return Instruction(op, name, kind, [operand(part) for part in split(rest[found.end():end])], found[1].strip("@"))


def _alloca(op, name, rest):
    kind, *more = split(rest)
    return Instruction(op, name, "ptr", [operand(part) for part in more if not part.startswith("align")], kind)


def _return(op, name, rest):
    return Instruction(op, None, "void", [] if rest == "void" else [operand(rest)])


def _value_of(op, name, rest):
    """extractvalue and insertvalue: the indices are constants."""
    parts = split(rest)
    wide = 2 if op == "insertvalue" else 1
    operands = [operand(part) for part in parts[:wide]]
    indices = [int(part) for part in parts[wide:]]
    whole = operands[0][0]
    return Instruction(op, name, whole if op == "insertvalue" else item_at(whole, indices), operands, indices)


def _negate(op, name, rest):
    made = _all(op, name, rest)
    made.type = made.operands[0][0]
    return made


def _nothing(op, name, rest):
    return Instruction(op, None, "void")


_READERS = {**dict.fromkeys(BINARY, _two), **dict.fromkeys(CASTS, _cast), "icmp": _compare, "fcmp": _compare,
            "select": _all, "phi": _phi, "br": _branch, "switch": _switch, "load": _load, "store": _store,
            "getelementptr": _pointer, "call": _call, "alloca": _alloca, "ret": _return, "fneg": _negate,
            "freeze": _negate, "extractvalue": _value_of, "insertvalue": _value_of, "unreachable": _nothing}
