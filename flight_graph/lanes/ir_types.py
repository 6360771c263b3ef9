"""Types of LLVM's intermediate code, as text: sizes, items, and how they are taken from a line."""

import re

_WORD = re.compile(r"[a-z0-9]+")
_SIZES = {"double": 8, "float": 4, "ptr": 8}


class NotWidened(Exception):
    """Why code cannot be made to work on several lanes at once."""


class SeveralKinds(NotWidened):
    """A pointer may point to records of several kinds."""


def split(text: str) -> list[str]:
    """The parts between the commas that stand in no bracket."""
    parts, depth, start, quoted = [], 0, 0, False
    for at, sign in enumerate(text):
        if sign == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif sign in "([{<":
            depth += 1
        elif sign in ")]}>":
            depth -= 1
        elif sign == "," and depth == 0:
            parts.append(text[start:at].strip())
            start = at + 1
    rest = text[start:].strip()
    return [*parts, rest] if rest else parts


def take_type(text: str) -> tuple[str, str]:
    """A type at the begin of a text, and what follows it."""
    if text[0] in "[{<":
        end = closing(text, 0) + 1
    else:
        end = _WORD.match(text).end()
    return text[:end], text[end:].strip()


def closing(text: str, start: int) -> int:
    """Where the bracket ends that begins there."""
    depth = 0
    for at in range(start, len(text)):
        depth += {"[": 1, "{": 1, "<": 1, "(": 1, "]": -1, "}": -1, ">": -1, ")": -1}.get(text[at], 0)
        if depth == 0:
            return at
    raise NotWidened(f"a bracket without an end: {text}")


def size_of(kind: str) -> int:
    """Bytes of a type."""
    if kind in _SIZES:
        return _SIZES[kind]
    if re.fullmatch(r"i(8|16|32|64|128)", kind):  # no i1: eight of them are one byte
        return int(kind[1:]) // 8
    if kind.startswith("["):
        count, _, item = kind[1:-1].partition(" x ")
        return int(count) * size_of(item)
    if kind.startswith("{"):
        end = 0
        for item in split(kind[1:-1]):
            end = -(-end // alignment(item)) * alignment(item) + size_of(item)
        return -(-end // alignment(kind)) * alignment(kind)
    raise NotWidened(f"the type {kind}")


def alignment(kind: str) -> int:
    """Alignment of a type in bytes."""
    if kind.startswith("["):
        return alignment(kind[1:-1].partition(" x ")[2])
    if kind.startswith("{"):
        return max(map(alignment, split(kind[1:-1])), default=1)
    return size_of(kind)


def item_at(kind: str, indices: list[int]) -> str:
    """The type of an item inside of an array or a structure."""
    for index in indices:
        kind = kind[1:-1].partition(" x ")[2] if kind.startswith("[") else split(kind[1:-1])[index]
    return kind
