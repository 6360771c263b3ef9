"""Docstrings are plain prose: paragraphs, indented examples, lists, names in backticks. Here they become what Sphinx reads.

Everything that would mean something else to reStructuredText is escaped, so a docstring needs to know nothing of it.
"""

import re

_CODE = re.compile(r"(``?)([^`\n]+(?:\n[^`\n]+)?)\1")
_ITEM = re.compile(r"([*-]) +(?=\S)")
_MARKS = re.compile(r"([\\*|_])")


def as_restructured_text(lines: list[str]) -> list[str]:
    """The lines of a docstring, which starts at the left margin, for Sphinx."""
    out, block = [], []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line.rstrip())
        elif block:
            out += _block(block) + [""]
            block = []
    return out


def _block(lines):
    if all(line.startswith("  ") for line in lines) or any(re.search(r"\S {3,}\S", line) for line in lines):
        return ["::", "", *(f"    {line}" for line in lines)]
    if _ITEM.match(lines[0]):
        return _items(lines)
    cut = next((number for number, line in enumerate(lines) if line.startswith("    ")), len(lines))
    if cut < len(lines) and cut and lines[cut - 1].endswith(":"):
        return [*_text(lines[:cut]), "", *_block(lines[cut:])] if all(
            line.startswith("  ") for line in lines[cut:]) else _text(lines)
    return _text(lines)


def _items(lines):
    out, item = [], []
    for line in lines:
        if _ITEM.match(line) and item:
            out += _item(item)
            item = []
        item.append(line)
    return out + _item(item)


def _item(lines):
    first, *more = _text([_ITEM.sub("", lines[0]), *lines[1:]])
    return [f"* {first}", *(f"  {line}" for line in more)]


def _text(lines):
    text = "\n".join(line.strip() for line in lines)
    parts, at = [], 0
    for found in _CODE.finditer(text):
        parts += [_MARKS.sub(r"\\\1", text[at:found.start()]), _code(found, text)]
        at = found.end()
    text = "".join([*parts, _MARKS.sub(r"\\\1", text[at:])])
    text = re.sub(r"^([-=~^#+.:]{2,}|\w+\.) ?$", r"\\\1", text, flags=re.M)
    return re.sub(r"^(\w|\(?\w+[.)]) ", r"\\\g<1> ", text, flags=re.M).replace("://", "\\://").split("\n")


def _code(found, text):
    inner = " ".join(found[2].split())
    after = text[found.end():found.end() + 1]
    return f"``{inner}``" + ("\\ " if after.isalnum() else "")
