"""A static library as linkers read it: the common archive of Unix, with an index of its symbols."""

MAGIC = b"!<arch>\n"


def archive(members: dict[str, tuple[bytes, list[str]]]) -> bytes:
    """The bytes of a library. members: name of at most 15 letters -> (object code, symbols that it defines)."""
    symbols = [(symbol, name) for name, (_, found) in members.items() for symbol in found]
    names = b"".join(symbol.encode() + b"\0" for symbol, _ in symbols)
    index_size = 4 + 4 * len(symbols) + len(names)
    places, at = {}, len(MAGIC) + 60 + index_size + index_size % 2
    for name, (code, _) in members.items():
        places[name] = at
        at += 60 + len(code) + len(code) % 2
    index = len(symbols).to_bytes(4, "big") + b"".join(places[name].to_bytes(4, "big") for _, name in symbols) + names
    return MAGIC + _member("", index) + b"".join(_member(name, code) for name, (code, _) in members.items())


def _member(name: str, content: bytes) -> bytes:
    head = f"{name + '/':<16}{0:<12}{0:<6}{0:<6}{'644':<8}{len(content):<10}`\n".encode()
    return head + content + b"\n" * (len(content) % 2)
