"""What an object file calls outside of itself, by its table of symbols: files of ELF, of 32 and 64 bits, little endian."""

import struct

_SYMBOLS = 2  # type of the section


def is_elf(code: bytes) -> bool:
    """Whether this is an object file of that kind."""
    return code[:4] == b"\x7fELF"


def undefined(code: bytes) -> list[str]:
    """The names of symbols that the file uses and does not define."""
    wide = code[4] == 2
    start, = struct.unpack_from("<Q" if wide else "<I", code, 40 if wide else 32)
    size, count = struct.unpack_from("<HH", code, 58 if wide else 46)
    layout = "<IIQQQQIIQQ" if wide else "<10I"
    sections = [struct.unpack_from(layout, code, start + i * size) for i in range(count)]
    found = []
    for _, kind, _, _, offset, length, link, _, _, entry in sections:
        if kind == _SYMBOLS:
            found += [_name(code, sections[link][4] + name) for name, place in _entries(code, offset, length, entry, wide)
                      if name and not place]
    return sorted(found)


def _entries(code, offset, length, entry, wide):
    """(offset of the name, number of the section) of each symbol; section 0: not defined here."""
    for at in range(offset, offset + length, entry):
        yield struct.unpack_from("<I", code, at)[0], struct.unpack_from("<H", code, at + (6 if wide else 14))[0]


def _name(code, at) -> str:
    return code[at:code.index(b"\0", at)].decode()
