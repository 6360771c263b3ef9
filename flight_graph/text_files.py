"""Text from outside: how much of a file is read, how it is decoded, and how little of it a sentence repeats."""

import json
import os
import stat
from pathlib import Path

from flight_graph.errors import FlightError

LARGEST = 1 << 20  # [bytes] of a file that a person writes: a scenario, a parameter file
_BYTE_ORDER_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


def read_bytes(path: Path, where: str, largest: int = LARGEST) -> bytes:
    """The content of an ordinary file of at most so many bytes. Raises FlightError, which begins with ``where``."""
    try:
        with open(path, "rb", opener=_open_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FlightError(f"{where}: this is no ordinary file")
            content = file.read(largest + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, FlightError):
            raise
        raise FlightError(f"{where}: cannot be read ({(getattr(error, 'strerror', None) or str(error)).lower()})") from None
    if len(content) > largest:
        raise FlightError(f"{where}: the file is longer than {size_text(largest)}, more than is read of such a one")
    return content


def decoded(content: bytes, where: str) -> str:
    """UTF-8, or UTF-16 that begins with its mark. Raises FlightError."""
    encoding = next((name for mark, name in _BYTE_ORDER_MARKS if content.startswith(mark)), "utf-8")
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        raise FlightError(f"{where}: this is no text in UTF-8 (byte {error.start})") from None
    if "\0" in text:
        raise FlightError(f"{where}: this is no text in UTF-8 (byte {text.index(chr(0))} is zero)")
    return text


def read_text(path: Path, where: str, largest: int = LARGEST) -> str:
    """The text of a file. Raises FlightError, which begins with ``where``."""
    return decoded(read_bytes(path, where, largest), where)


def parse_json(content: bytes | str, where: str, largest: int = LARGEST):
    """The value of a JSON text. Raises FlightError."""
    if len(content) > largest:
        raise FlightError(f"{where}: the text is longer than {size_text(largest)}, which is more than is read of it")
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        what = "it is nested too deeply" if isinstance(error, RecursionError) else short(str(error))
        raise FlightError(f"{where}: this is no JSON ({what})") from None


def size_text(size: int) -> str:
    """A number of bytes for a person."""
    for unit, name in ((1 << 40, "TiB"), (1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")):
        if size >= unit:
            return f"{size / unit:.3g} {name}"
    return f"{size} bytes"


def short(text: str, length: int = 200) -> str:
    """A text that stands in a sentence, cut where it is long."""
    return text if len(text) <= length else f"{text[:length]}..."


def printable(text: str) -> str:
    """A text without the characters that steer a terminal: they are shown by their numbers."""
    return "".join(letter if letter in "\n\t" or not _steers(ord(letter)) else f"\\x{ord(letter):02x}" for letter in text)


def _steers(number: int) -> bool:
    """Control characters, and those that change the direction of writing (what is read is not what runs)."""
    return number < 32 or 127 <= number < 160 or 0x202A <= number <= 0x202E or 0x2066 <= number <= 0x2069


def _open_without_waiting(path, flags):
    """A pipe without a writer must not stop the command."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
