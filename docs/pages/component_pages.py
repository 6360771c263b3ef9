"""A page for each component that flies, from its declarations, the requirements, the scenarios and the tests."""

import ast
import re
import sys
from collections import Counter
from functools import cache
from pathlib import Path

from flight_graph.bags.message_types import field_trees
from flight_graph.bags.units import field_units
from flight_graph.components import registry
from flight_graph.components.component import Component
from flight_graph.components.described import described
from flight_graph.faults import fault_types
from flight_graph.graphs import source
from flight_graph.requirements import requirements_file
from msg_schemas.signal import Signal
from pages.staging import ROOT

PACKAGES = {"cubli_ros": "Flight software of the Cubli rover", "spacerobot_ros": "Flight software of the space robot",
            "lander_ros": "Flight software of the asteroid lander", "sim_nodes": "Simulated truth: plants and sensors"}
EXAMPLES = 3  # fields that are named in the table of faults
SHARED = 3  # laws of more components than this are told in a line


def write(stage) -> None:
    """The index and a page for each component."""
    found = registry.components()
    lines = ["# Components", "", "What each component promises, what it reads and says, how it is set, what it does on bad "
             "input, which requirements it serves and where that is tested. Frames: [frames](../frames.md). "
             "What every kernel keeps to: [component](../component.md#what-a-kernel-may-not-do-and-what-it-is-told).", ""]
    for package, title in PACKAGES.items():
        lines += [f"## {title}", "", "| component | what it is |", "|---|---|"]
        lines += [f"| [{name.partition('/')[2]}]({name}.md) | {cell(described(component).summary)} |"
                  for name, component in found.items() if name.startswith(f"{package}/")] + [""]
    stage.write("components/index.md", "\n".join(lines))
    stage.write("reference.md", without_components((ROOT / "docs/reference.md").read_text(encoding="utf-8")))
    for name, component in found.items():
        stage.write(f"components/{name}.md", "\n".join(page(name, component)) + "\n")


def without_components(reference: str) -> str:
    """The reference page, whose components have pages of their own here."""
    first, heading, _ = reference.partition("\n## Components\n")
    return f"{first}{heading}\nEach has a [page of its own](components/index.md): ports, parameters, promises, tests.\n"


def page(name: str, component: type[Component]):
    """The lines of a component's page."""
    told = described(component)
    module = component.__module__
    yield from [f"# {name}", "", told.summary, "",
                f"`{name}`, class `{component.__name__}` in [{module}]({_file(module)}); {component.rate_hz:g} Hz unless a "
                f"scenario says otherwise. By itself: `flight node {name.replace('/', ' ')}`.", ""]
    yield from ["## What it promises", "", _sentence(told.promises), ""]
    yield from _ports(component)
    yield from _parameters(component)
    yield from _bad_input(component, told)
    yield from _requirements(name)
    yield from _tests(name, component)
    yield from _faults(component)
    yield from _law(component)


def _ports(component):
    yield from ["## Ports", "", "| port | topic, message | frame, rate | what it carries |", "|---|---|---|---|"]
    for way, ports in (("in", component.inputs), ("out", component.outputs)):
        for port, signal in ports.items():
            optional = ", may be left out" if port in component.optional_inputs else ""
            frame = signal.fixed.get("header.frame_id", "")
            rate = f"{component.output_rate_hz.get(port, component.rate_hz):g} Hz" if way == "out" else ""
            yield _port(f"`{port}`<br>{way}{optional}", signal.topic, signal.type_name, frame, rate, signal.doc)
    for made in component.formatted:
        told = (made.function.__doc__ or "").strip().partition("\n")[0]
        yield _port(f"`{made.port}`<br>out", made.topic.lstrip("/"), made.type_name, "", "once" if made.once else "", told)
    yield ""
    signals = {signal.topic: signal for signal in [*component.inputs.values(), *component.outputs.values()]}
    yield from ["| quantity | numbers | unit | meaning |", "|---|---|---|---|"]
    for topic, signal in signals.items():
        yield f"| **`/{topic}`** | | | |"
        for quantity, numbers, unit, meaning in _quantities(signal):
            yield f"| `{quantity}` | {numbers} | {unit} | {cell(meaning)} |"
    yield ""


def _port(port, topic, type_name, frame, rate, told):
    where = "<br>".join(part for part in (f"`{frame}`" if frame else "", rate.replace(" ", "&nbsp;")) if part)
    return f"| {port} | `/{topic}`<br>{type_name.replace('/msg/', '/')} | {where} | {cell(told)} |"


def _quantities(signal: Signal):
    """Yield (name, numbers, unit, meaning) of what a message carries, stamps left out."""
    if signal.groups:
        for _, _, label, quantity in signal.columns():
            yield label, quantity.count, quantity.unit, quantity.doc
        return
    units = field_units(field_trees(signal.type_name, "", ""), signal.type_name) | signal.units
    for path, dtype, _, _ in signal.leaves():
        if "header" in path.split("."):
            continue
        count = dtype.shape[0] if dtype.ndim else 1
        names = signal.fixed.get("name")  # of joints
        unit = units.get(path, "1" if "orientation" in path or "quaternion" in path else "")
        yield path, count, unit, ", ".join(names) if names and count == len(names) else ""


def _parameters(component):
    entries = component.parameters.entries.values()
    yield from ["## Parameters", ""]
    if not entries:
        yield from ["None.", ""]
        return
    defaults = component.parameters.defaults()
    yield from ["| parameter | default | allowed | meaning | source |", "|---|---|---|---|---|"]
    for entry in entries:
        only = "".join(f"; with `{name}` {' or '.join(words)}" for name, words in entry.used_if)
        yield (f"| `{entry.name}` | {_short(defaults[entry.name])} | {cell(entry.range_text)} | {cell(entry.doc + only)} | "
               f"{cell(entry.source)} |")
    yield from ["", "A value that is not allowed, not finite or of the wrong length is refused before anything runs, by "
                "the scenario's check, `--set`, and the node's parameter service alike.", ""]


def _bad_input(component, told):
    yield from ["## On bad input", "", _sentence(told.bad_input), ""]
    if component.faults:
        yield from ["It ends the run, with the sentence that is filled in, when:", ""]
        yield from [f"- {cell(sentence)}" for sentence in component.faults.values()]
        yield ""
    yield from ["An output that is not finite ends the run and names component, field and time. A message of another type, "
                "length, frame or names is refused by its reader.", ""]


@cache
def _flown() -> dict[str, set[str]]:
    """scenario -> the components that fly in it, those of what it includes too."""
    found = {}
    for name, path in source.available().items():
        found[name] = _used(source.read_file(name)[0], path.parent)
    return found


def _used(data, folder) -> set[str]:
    own = {entry["use"] for entry in (data.get("components") or {}).values()}
    for entry in (data.get("include") or {}).values():
        inside = entry["scenario"] if isinstance(entry, dict) else entry
        own |= _used(inside if isinstance(inside, dict) else source.read_file(inside, folder)[0], folder)
    return own


@cache
def _all_requirements():
    return {name: requirements_file.read(name)[0].requirements for name in requirements_file.available()}


def _requirements(name):
    flown = [scenario for scenario, used in _flown().items() if name in used]
    rows = []
    for vehicle, requirements in _all_requirements().items():
        for one in requirements:
            by = sorted({showing.scenario for showing in one.shown_by if showing.scenario in flown})
            if by:
                waived = f" Waived: {one.waived}" if one.waived else ""
                rows.append(f"| {one.id} | {cell(one.text + waived)} | {', '.join(f'`{scenario}`' for scenario in by)} | "
                            f"`flight check {vehicle} --only {one.id}` |")
    yield from ["## Requirements", ""]
    if rows:
        yield from ["Those that are shown by runs in which it flies ([requirements](../../requirements.md)):", "",
                    "| requirement | what is asked | shown by | command |", "|---|---|---|---|", *rows, ""]
    else:
        yield from ["No requirement is shown by a run in which it flies.", ""]
    if flown:
        yield from [f"It flies in {', '.join(f'[{one}](../../../scenarios/{one}.yaml)' for one in flown)}.", ""]


@cache
def _test_files() -> dict[Path, tuple[str, str]]:
    """File of tests -> its text, and the first sentence of what it says of itself."""
    found = {}
    for path in sorted({*(ROOT / "tests").rglob("test_*.py")} - {*(ROOT / "tests/site").iterdir()}):
        text = path.read_text(encoding="utf-8")
        found[path] = text, (ast.get_docstring(ast.parse(text)) or "").partition("\n\n")[0].replace("\n", " ")
    return found


def _tests(name, component):
    words = [re.escape(name), re.escape(component.__module__) + r"\b", rf"import {component.__name__}\b",
             *(re.escape(law) + r"\b" for law in _laws(component))]
    words += [rf"from {law.rpartition('.')[0]} import [^\n]*\b{law.rpartition('.')[2]}\b"
              for law in (component.__module__, *_laws(component))]
    pattern = re.compile("|".join(words))
    rows = [f"| [{path.relative_to(ROOT / 'tests').as_posix()}](../../../{path.relative_to(ROOT).as_posix()}) | "
            f"{cell(about)} |" for path, (text, about) in _test_files().items() if pattern.search(text)]
    golden = [one for one, used in _flown().items() if name in used and (ROOT / "bags" / one).is_dir()]
    yield from ["## Where it is tested", ""]
    if rows:
        yield from ["| tests of it and of its equations | what they hold |", "|---|---|", *rows, ""]
    if golden:
        bags = ", ".join(f"`bags/{one}`" for one in golden)
        yield from [f"Golden bags, run again bit for bit in every engine: {bags}.", ""]


def _faults(component):
    yield from ["## Faults that it can carry", "", "What a scenario, or `flight fault` on a running graph, may break here "
                "([faults](../../faults.md)); `NAME` is its name in the graph.", "", "| place | kinds |", "|---|---|"]
    outputs = [f"NAME.{port}.{path}" for port, signal in component.outputs.items() for path in _fields(signal)]
    inputs = [f"NAME <- {port}.{path}" for port, signal in component.inputs.items() for path in _fields(signal)]
    state = [f"NAME.state.{entry}" for entry in component.state.entries]
    parameters = [f"NAME.parameters.{entry.name}" for entry in component.parameters.entries.values()
                  if entry.kind == "float"]
    for kind, places in ((fault_types.OUTPUT, outputs), (fault_types.INPUT, inputs), (fault_types.STATE, state),
                         (fault_types.PARAMETER, parameters),
                         (fault_types.OUTPUT_MESSAGE, [f"NAME.{port}" for port in component.outputs]),
                         (fault_types.INPUT_MESSAGE, [f"NAME <- {port}" for port in component.inputs]),
                         (fault_types.COMPONENT, ["NAME"])):
        if places:
            more = f" and {len(places) - EXAMPLES} more" if len(places) > EXAMPLES else ""
            yield (f"| {kind}: {', '.join(f'`{place}`' for place in places[:EXAMPLES])}{more} | "
                   f"{', '.join(fault_types.allowed_at(kind))} |")
    yield ""


def _fields(signal):
    return [path for path, _, _, _ in signal.leaves() if "header" not in path.split(".")]


def _laws(component) -> list[str]:
    """Modules of its own package that its module imports, without those of other components."""
    package = component.__module__.partition(".")[0]
    others = {other.__module__ for other in registry.components().values()}
    return sorted({module for module in _imported(component.__module__) if module.startswith(f"{package}.")} - others)


@cache
def _imported(module: str) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(Path(sys.modules[module].__file__).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            inside = [f"{node.module}.{alias.name}" for alias in node.names]
            found += [one if one in sys.modules else node.module for one in inside]
    return found


def _law(component):
    yield from ["## Source and equations", ""]
    laws = _laws(component)
    for module in (component.__module__, *(law for law in laws if _shared()[law] <= SHARED)):
        yield from [f"[{module}]({_file(module)})", "", *_quoted(_told(module)), ""]
    for module in laws:
        if _shared()[module] > SHARED:
            yield f"- [{module}]({_file(module)}): {_escaped(' '.join(_told(module).partition(chr(10) * 2)[0].split()))}"
    yield ""


@cache
def _shared() -> Counter:
    """Module of laws -> of how many components."""
    return Counter(law for component in registry.components().values() for law in _laws(component))


def _told(module: str) -> str:
    return (sys.modules[module].__doc__ or "").strip()


def _quoted(text):
    """A module's prose as a quotation; equations, tables and what is set in columns as they stand."""
    for paragraph in text.split("\n\n"):
        lines = paragraph.splitlines()
        if any(line.startswith("    ") or re.search(r"\S {3,}\S", line) for line in lines):
            yield from ["> ```text", *(f"> {line}" for line in lines), "> ```", ">"]
        else:
            yield from [*(f"> {line}" for line in _escaped(paragraph).splitlines()), ">"]


def _escaped(text: str) -> str:
    """Prose with what would mean something to Markdown escaped, but for code in backticks."""
    parts = re.split(r"(``?[^`]+``?)", text)
    return "".join(part if number % 2 else re.sub(r"([*_|\\])", r"\\\1", part).replace("<", "&lt;")
                   for number, part in enumerate(parts))


def _file(module: str) -> str:
    """The link from a component's page to the page of a module's file."""
    return "../../../" + Path(sys.modules[module].__file__).relative_to(ROOT).as_posix()


def _sentence(text: str) -> str:
    """A part of a docstring as a paragraph of its own."""
    return _escaped(text[:1].upper() + text[1:])


def _short(value) -> str:
    text = str(value)
    return text if len(text) < 60 else f"{text[:50]}... ({text.count(',') + 1} numbers)"


def cell(text) -> str:
    """A text as a cell of a table."""
    return str(text).replace("|", "\\|").replace("\n", " ").replace("<", "&lt;").replace("*", "\\*").strip()


