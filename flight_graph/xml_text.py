"""XML from outside: no document type (and so no entities), and no more of it than can be meant."""

import xml.etree.ElementTree as ElementTree
from xml.parsers import expat

from flight_graph.errors import FlightError
from flight_graph.text_files import short, size_text

LARGEST = 4 << 20  # [bytes]
DEEPEST = 50  # elements in each other
MOST_ELEMENTS = 20_000


def parse(content: bytes | str, where: str) -> ElementTree.Element:
    """The root element of an XML text. Raises FlightError, which begins with ``where``."""
    if isinstance(content, str):
        content = content.encode("utf-8", "surrogatepass")
    if len(content) > LARGEST:
        raise FlightError(f"{where}: the text is longer than {size_text(LARGEST)}, which is more than is read of it")
    try:
        _measure(content, where)
        return ElementTree.fromstring(content)
    except (ElementTree.ParseError, expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, FlightError):
            raise
        raise FlightError(f"{where}: is not XML: {short(str(error))}") from None


def _measure(content, where):
    """Refuse what is too deep or too much, and what declares entities, before anything is built."""
    opened, count = 0, 0

    def start(name, attributes):
        nonlocal opened, count
        opened, count = opened + 1, count + 1
        if opened > DEEPEST or count > MOST_ELEMENTS:
            raise FlightError(f"{where}: it has more than {MOST_ELEMENTS} elements, or more than {DEEPEST} in each other")

    def end(name):
        nonlocal opened
        opened -= 1

    def doctype(*_):
        raise FlightError(f"{where}: it declares a document type (<!DOCTYPE ...>), which is not read")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler, parser.StartDoctypeDeclHandler = start, end, doctype
    parser.Parse(content, True)
