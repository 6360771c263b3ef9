"""The code that a scenario names and that does not come with the packages, found before any of it is imported."""

from pathlib import Path

from flight_graph.components import foreign, names, namespaces
from flight_graph.components.foreign import Foreign
from flight_graph.graphs import vehicles
from flight_graph.graphs.vehicles import mapping


def foreign_code(data, folder: Path | None, own: Path | None = None) -> list[Foreign]:
    """What a scenario's data names, as it came from its file and those of what it includes. It may be malformed; its
    validation says so later.

    folder: where relative names start; own: a folder whose files need no consent, nor those below it.
    """
    found = _all(data, folder, "")
    return [code for code in dict.fromkeys(found) if code is not None and not _lies_in(code, own)]


def _all(data, folder, vehicle):
    yield from _components(data, folder, vehicle)
    yield from _functions(data, folder, vehicle)
    for name, entry, found in vehicles.inside(data):
        whole = names.joined(vehicle, name)
        for key, value in mapping(entry.get("set")).items():
            if str(key).endswith(".use"):
                yield _component(f"{key} that include.{whole} sets", value, folder)
        yield from _all(found, vehicles.folder_of(entry), whole)


def _components(data, folder, vehicle):
    for name, entry in mapping(mapping(data).get("components")).items():
        yield _component(f"component {names.joined(vehicle, str(name))}", mapping(entry).get("use", ""), folder)
    for key, value in _varied(mapping(mapping(data).get("vary"))):
        if str(key).endswith(".use"):
            yield _component(f"{key} under vary", value, folder)


def _component(what, use, folder):
    return foreign.of_component(what, namespaces.split(str(use))[0], folder)


def _functions(data, folder, vehicle):
    named = {key: mapping(data).get(key) for key in ("metrics", "figure")}
    for what, name in {**named, "vary.function": mapping(mapping(data).get("vary")).get("function")}.items():
        if isinstance(name, str):
            yield foreign.of_function(names.joined(vehicle, what), name, folder)


def _varied(vary):
    """Yield (key, value) of all fixed values of a ``vary`` block."""
    for entry in _list(vary.get("cases")):
        yield from mapping(entry).items()
    for block in ("grid", "one_at_a_time"):
        for key, values in mapping(vary.get(block)).items():
            yield from ((key, value) for value in _list(values))
    for key, drawn in mapping(vary.get("random")).items():
        yield from ((key, value) for value in _list(mapping(drawn).get("choice")))


def _lies_in(code, own):
    return own is not None and code.source.endswith(".py") and own.resolve() in Path(code.source).parents


def _list(value) -> list:
    return value if isinstance(value, list) else []
