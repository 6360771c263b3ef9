"""The code that a scenario names and that does not come with the packages, found before any of it is imported."""

from pathlib import Path

from flight_graph.components import foreign
from flight_graph.components.foreign import Foreign


def foreign_code(data, folder: Path | None, own: Path | None = None) -> list[Foreign]:
    """What a scenario's data names, as it came from its file. It may be malformed; its validation says so later.

    folder: where relative names start; own: a folder whose files need no consent, nor those below it.
    """
    found = [*_components(data, folder), *_functions(data, folder)]
    return [code for code in dict.fromkeys(found) if code is not None and not _lies_in(code, own)]


def _components(data, folder):
    components = _mapping(_mapping(data).get("components"))
    for name, entry in components.items():
        yield foreign.of_component(f"component {name}", str(_mapping(entry).get("use", "")), folder)
    for key, value in _varied(_mapping(_mapping(data).get("vary"))):
        if str(key).endswith(".use"):
            yield foreign.of_component(f"{key} under vary", str(value), folder)


def _functions(data, folder):
    named = {key: _mapping(data).get(key) for key in ("metrics", "figure")}
    for what, name in {**named, "vary.function": _mapping(_mapping(data).get("vary")).get("function")}.items():
        if isinstance(name, str):
            yield foreign.of_function(what, name, folder)


def _varied(vary):
    """Yield (key, value) of all fixed values of a ``vary`` block."""
    for entry in _list(vary.get("cases")):
        yield from _mapping(entry).items()
    for block in ("grid", "one_at_a_time"):
        for key, values in _mapping(vary.get(block)).items():
            yield from ((key, value) for value in _list(values))
    for key, drawn in _mapping(vary.get("random")).items():
        yield from ((key, value) for value in _list(_mapping(drawn).get("choice")))


def _lies_in(code, own):
    return own is not None and code.source.endswith(".py") and own.resolve() in Path(code.source).parents


def _mapping(value) -> dict:
    return value if isinstance(value, dict) else {}


def _list(value) -> list:
    return value if isinstance(value, list) else []
