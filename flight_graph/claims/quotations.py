"""Quotations: whether the words that a claims table puts into a paper's mouth stand in its text.

Texts of papers are not ours to ship. Whoever has one checks with ``flight claims PAPER --text FILE``.
"""

import re
import unicodedata

from flight_graph.claims.claims_file import Claim

_TAG = re.compile(r"</?[A-Za-z!|][^<>]*>")  # not what stands between two inequalities
_LINK = re.compile(r"\]\([^()\s]*\)")
_MARK = re.compile(r"[\W_]+")


def squeezed(text: str) -> str:
    """A text's letters and digits alone: what is left of it in every extraction, whatever its line ends and marks."""
    bare = _LINK.sub("]", _TAG.sub("", unicodedata.normalize("NFKC", text)))
    return _MARK.sub("", bare).casefold()


def missing(claims: list[Claim], text: str) -> dict[str, list[str]]:
    """The quotations that a text does not have: id of the row -> its quotations that were not found."""
    whole = squeezed(text)
    found = {claim.id: [quote for quote in claim.quotes if squeezed(quote) not in whole] for claim in claims}
    return {name: quotes for name, quotes in found.items() if quotes}
