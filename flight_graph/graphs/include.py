"""Vehicles: scenarios inside a scenario, each under a name.

    include:
      rover_a: cubli_asteroid                            # of the packages, or a file: rover.yaml
      rover_b: {scenario: cubli_asteroid, set: {controller.lambda_a: 0.03, seed: 7}}

`gathered` puts the data of what is included in the place of its name, `with_settings` what ``set:`` says into that data.
From then on a scenario is one piece of data, as a bag carries it, and no file is looked for.
"""

from pathlib import Path

from flight_graph.errors import FlightError
from flight_graph.graphs import setting
from flight_graph.graphs.source import read_file
from flight_graph.graphs.vehicles import DEEPEST, folder_of, mapping, own
from flight_graph.text_files import short, size_text

MOST = 100  # scenarios in one, all in all
LARGEST = 4 << 20  # [bytes] of their files, all in all


def gathered(data: dict, path: Path) -> dict:
    """A scenario's data with that of all it includes. path: its file. Raises FlightError."""
    return _gathered(data, path.parent, str(path.name), [path.resolve()], _Files())


class _Files:
    """The files that are read for one scenario, each once."""

    def __init__(self):
        self._read, self._bytes, self._count = {}, 0, 0

    def count(self, where):
        """One more scenario. Raises FlightError."""
        self._count += 1
        if self._count > MOST:
            raise FlightError(f"{where}: more than {MOST} scenarios are included in all")

    def read(self, name, folder, where):
        """The data of a scenario, and its file. Raises FlightError."""
        if (name, folder) not in self._read:
            try:
                data, path = read_file(name, folder)
            except FlightError as error:
                raise FlightError(f"{where}: {error}") from None
            self._bytes += path.stat().st_size
            if self._bytes > LARGEST:
                raise FlightError(f"{where}: the included files are larger than {size_text(LARGEST)} in all")
            self._read[name, folder] = data, path
        return self._read[name, folder]


def _gathered(data, folder, where, chain, files):
    entries = data.get("include")
    if not isinstance(entries, dict):
        return data
    return {**data, "include": {name: _entry(entry, folder, f"{where}: include.{short(str(name), 60)}", chain, files)
                                for name, entry in entries.items()}}


def _entry(entry, folder, where, chain, files):
    entry = {"scenario": entry} if isinstance(entry, str) else entry
    wanted = mapping(entry).get("scenario")
    if not isinstance(wanted, (str, dict)):
        return entry
    if len(chain) > DEEPEST:
        raise FlightError(f"{where}: scenarios include each other more than {DEEPEST} deep")
    files.count(where)
    inside, path = wanted, None
    if isinstance(wanted, str):
        inside, path = files.read(wanted, folder, where)
        if path.resolve() in chain:
            circle = [*chain[chain.index(path.resolve()):], path]
            raise FlightError(f"{where}: a scenario cannot include itself: {' -> '.join(one.name for one in circle)}")
        inside = {key: value for key, value in own(inside).items() if key != "seed"}
    inner = path.parent if path else Path(entry["folder"]) if isinstance(entry.get("folder"), str) else folder
    inside = _gathered(inside, inner, f"{where} ({path.name})" if path else where,
                       [*chain, path.resolve() if path else Path()], files)
    return {**entry, "scenario": inside, "folder": str(inner)}


def with_settings(data: dict, origin: str, folder: Path | None) -> dict:
    """A scenario's gathered data with what each ``set:`` says, the innermost first. Raises FlightError."""
    entries = data.get("include")
    if not isinstance(entries, dict):
        return data
    made = {}
    for name, entry in entries.items():
        given = mapping(entry).get("set")
        if isinstance(entry, dict) and isinstance(entry.get("scenario"), dict):
            where = f"{origin}: include.{name}"
            entry = {**entry, "scenario": with_settings(entry["scenario"], where, folder_of(entry))}
            if isinstance(given, dict):
                given = {str(key): setting.with_whole_use(str(key), value, folder) for key, value in given.items()}
                inside = setting.override(entry["scenario"], given, f"{where}.set", folder_of(entry), inside="")
                entry = {**{key: value for key, value in entry.items() if key != "set"}, "scenario": inside}
        made[name] = entry
    return {**data, "include": made}
