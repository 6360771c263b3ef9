"""The tables of docs/faults.md, written from the declarations.

    python -m flight_graph.cli.fault_pages docs/faults.md

Each stands between ``<!-- NAME -->`` and ``<!-- end -->``.
"""

import sys
from pathlib import Path

from flight_graph.faults import fault_types as types
from flight_graph.faults.fault_file import FaultEntry
from flight_graph.monitors.monitor_file import Actionpoint, MonitorsFile, Watchpoint

_PLACES = {types.OUTPUT: "output", types.INPUT: "input", types.STATE: "state", types.PARAMETER: "parameter",
           types.OUTPUT_MESSAGE: "messages", types.INPUT_MESSAGE: "messages of an input", types.COMPONENT: "component"}


def tables() -> dict[str, list[str]]:
    """Name -> the lines of a table in Markdown."""
    return {"types": list(_types()), "keys": list(_keys(FaultEntry)), "monitors": list(_keys(MonitorsFile)),
            "watchpoints": list(_keys(Watchpoint)), "actionpoints": list(_keys(Actionpoint))}


def filled(page: str) -> str:
    """A page with its tables written anew."""
    for name, lines in tables().items():
        before, _, rest = page.partition(f"<!-- {name} -->\n")
        page = "\n".join([f"{before}<!-- {name} -->", *lines, f"<!-- end -->{rest.partition('<!-- end -->')[2]}"])
    return page


def _types():
    yield from ["| type | what it does | where | `value` | other keys |", "|---|---|---|---|---|"]
    for name, one in types.TYPES.items():
        where = ", ".join(_PLACES[place] for place in one.places)
        value = (one.value if "value" in one.needs else f"{one.value}, or none") if one.value else ""
        keys = [f"**`{key}`**" for key in one.needs if key != "value"]
        keys += [f"`{key}`" for key in one.takes if key not in (*types.WINDOW, "value")]
        yield f"| `{name}`{' (event)' if one.is_event else ''} | {one.does} | {where} | {value} | {' '.join(keys)} |"


def _keys(model):
    yield from ["| key | default | meaning |", "|---|---|---|"]
    for name, info in model.model_fields.items():
        value = "" if info.is_required() or info.get_default(call_default_factory=True) in (None, "", [], {}) else (
            f"`{info.get_default(call_default_factory=True)}`")
        yield f"| `{name}` | {value} | {info.description} |"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8", newline="\n")
