"""The scenario that a bag carries, as data to be run: whatever code it names needs a consent first.

Component files are taken from the bag's attachments alone, never from a path that the bag names or lies at.
"""

from pathlib import Path, PurePosixPath

from flight_graph.bags.errors import quoted
from flight_graph.bags.reader import Bag
from flight_graph.components import foreign
from flight_graph.components.foreign import Consent, Foreign
from flight_graph.engines.cache import cache_folder, keep
from flight_graph.errors import FlightError
from flight_graph.graphs import vehicles
from flight_graph.graphs.scenario import Scenario
from flight_graph.text_files import parse_json
from flight_graph.timebase import SECOND

SCENARIO = "scenario.json"  # name of the attachment a bag can be run again from
INJECTED_FAULTS = "flight_graph.injected"  # metadata: the faults that were injected during the run, as JSON
SET_PARAMETERS = "flight_graph.set"  # metadata: the parameters that were set during the run, as entries of ``events``
LARGEST = 4 << 20  # [bytes] of it


def read_scenario(bag: Bag, consent: Consent, functions: tuple[str, ...] = (),
                  set_before_ns: int | None = None) -> Scenario:
    """The scenario of a run's bag. Raises FlightError.

    consent: is asked before code runs that does not come with the packages; functions: those keys of the scenario whose
    functions will be called as well ("metrics", "figure"). set_before_ns: forget the parameters that were set during the
    run at this time [ns] or later.
    """
    data = _data(bag)
    if set_before_ns is not None:
        _forget(bag, data, set_before_ns)
    components = [(name, entry) for name, entry, _ in vehicles.components(data)]
    found = [code for name, entry in components if (code := _component(bag, name, entry["use"]))]
    found += [code for key in functions for name in vehicles.values_of(data, key) if (code := _function(bag, key, name))]
    if found:
        consent(_where(bag), found)
    for name, entry in components:
        if _is_file(entry["use"]):
            entry["use"] = _unpacked(bag, name, entry["use"])
    return Scenario(data, _where(bag))


def _where(bag):
    return f"{bag.path} ({SCENARIO})"


def _data(bag):
    if SCENARIO not in bag.attachments:
        raise FlightError(f"{bag.path}: this bag carries no scenario; it was not recorded by a run of this project")
    content = bag.attachments[SCENARIO].data
    data = parse_json(content, f"{bag.path}: its attachment {SCENARIO}", LARGEST)
    vehicles.refuse_too_deep(data, _where(bag))
    found = list(vehicles.components(data))
    if not found or not all(isinstance(entry, dict) and isinstance(entry.get("use"), str) for _, entry, _ in found):
        raise FlightError(f"{bag.path}: its attachment {SCENARIO} is no scenario")
    for key, name in (("faults", INJECTED_FAULTS), ("events", SET_PARAMETERS)):
        if happened := bag.metadata.get(name, {}):
            known, where = data.get(key) or [], f"{bag.path}: its metadata {name}"
            data[key] = [*(known if isinstance(known, list) else []),
                         *(parse_json(text, where, LARGEST) for text in happened.values())]
    return data


def _forget(bag, data, from_ns):
    """Take out of ``events`` what was set during the run from a time on."""
    happened = [parse_json(text, "", LARGEST) for text in bag.metadata.get(SET_PARAMETERS, {}).values()]
    late = [entry for entry in happened if round(entry["at_s"] * SECOND) >= from_ns]
    if late:
        data["events"] = [entry for entry in data["events"] if entry not in late]


def _is_file(use):
    return use.rpartition(":")[0].endswith(".py")


def _attachment(bag, name):
    return f"component/{name}.py"


def _component(bag, name, use) -> Foreign | None:
    if not _is_file(use):
        return foreign.of_component(f"component {name}", use, None)
    attachment = bag.attachments.get(_attachment(bag, name))
    if attachment is None:
        raise FlightError(f"{bag.path}: component {name} is '{use}', and the bag does not carry this file")
    how = f"flight info {quoted(bag.path)} --attachment {quoted(_attachment(bag, name))}"
    file = PurePosixPath(use.rpartition(":")[0].replace("\\", "/")).name
    return Foreign(f"component {name}", use, f"{file}, which the bag carries ({how})", foreign.digest(attachment.data))


def _function(bag, key, name) -> Foreign | None:
    if _is_file(name):
        raise FlightError(f"{bag.path}: {key}: '{name}' is a function of a file that the bag does not carry")
    return foreign.of_function(key, name, None)


def _unpacked(bag, name, use) -> str:
    """The ``use`` of a component whose file is written from the bag into the cache folder."""
    source, _, attribute = use.rpartition(":")
    content = bag.attachments[_attachment(bag, name)].data
    stem = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in Path(source).stem)[:60]
    path = keep(cache_folder("components"), f"{stem}_{foreign.digest(content)[:16]}.py", content)
    return f"{path}:{attribute}"
