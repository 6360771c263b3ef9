"""The reference pages of the handbook, written from the declarations: components, parameters, topics, scenarios.

    python -m flight_graph.cli.handbook docs/reference.md
"""

import importlib
import pkgutil
import sys
from dataclasses import is_dataclass
from pathlib import Path

from flight_graph import yaml_text
from flight_graph.components import functions, registry
from flight_graph.graphs import fault_scores, source
from flight_graph.graphs.scenario_file import PARTS, ScenarioFile
from msg_schemas.qos import QOS
from msg_schemas.signal import Signal

_NOTE = "<!-- Written by `python -m flight_graph.cli.handbook docs/reference.md` from the declarations; do not edit. -->"


def vehicles() -> dict[str, dict[str, Signal]]:
    """Module name -> constant name -> signal, of every topic table in msg_schemas."""
    import msg_schemas
    found = {}
    for info in pkgutil.iter_modules(msg_schemas.__path__):
        module = importlib.import_module(f"msg_schemas.{info.name}")
        signals = {name: value for name, value in vars(module).items() if isinstance(value, Signal)}
        for table in vars(module).values():  # of a vehicle whose topics depend on its joints
            if is_dataclass(table) and not isinstance(table, type):
                signals |= {name.upper(): value for name, value in vars(table).items() if isinstance(value, Signal)}
        if signals:
            found[info.name] = signals
    return found


def reference() -> str:
    """The page as Markdown."""
    return "\n".join([_NOTE, "# Reference", "", *_scenarios(), *_scenario_keys(), *_qos(), *_topics(), *_metrics(),
                      *_components(), ""])


def _scenarios():
    yield from ["## Scenarios", "", "| scenario | what it is | simulated |", "|---|---|---|"]
    for name, path in source.available().items():
        data = yaml_text.read(path)
        yield f"| `{name}` | {_cell(data['title'])} | {data['duration_s']:g} s |"
    yield ""


def _scenario_keys():
    yield from ["## Keys of a scenario file", "", "| key | default | meaning |", "|---|---|---|"]
    for name, info in ScenarioFile.model_fields.items():
        yield _key_row(name, info)
        for part, details in PARTS[name].model_fields.items() if name in PARTS else ():
            between = "<name>." if name in ("components", "connect", "include") else ""
            yield _key_row(f"{name}.{between}{details.alias or part}", details)
    yield ""


def _key_row(name, info):
    has_none = info.default_factory or info.default in (None, "")
    default = "required" if info.is_required() else "" if has_none else info.default
    return f"| `{name}` | {_cell(default)} | {_cell(info.description)} |"


def _qos():
    yield from ["## Quality of service by role", "", "| role | depth | reliable | latched |", "|---|---|---|---|"]
    for role, qos in QOS.items():
        yield f"| {role.value} | {qos.depth} | {_yes(qos.reliable)} | {_yes(qos.transient_local)} |"
    yield ""


def _topics():
    yield from ["## Topics", "", "Numbers before the names of quantities are their places in `position`: what viewers show "
                "as `/cubli/funnel.position[6]` is the first of `attitude_xi`. `flight list SCENARIO --topics` prints them "
                "one by one.", ""]
    for vehicle, signals in vehicles().items():
        yield from [f"### {vehicle}", "", "| topic | type | role | bytes | what it carries |", "|---|---|---|---|---|"]
        for signal in signals.values():
            parts = ", ".join(f"{index_text(indices)} {name} [{quantity.unit}]"
                              for _, indices, name, quantity in signal.columns())
            text = signal.doc + (f": {parts}" if parts else "")
            yield f"| `/{signal.topic}` | {signal.type_name} | {signal.role.value} | {signal.size + 4} | {_cell(text)} |"
        yield ""


def metric_tables() -> dict[str, tuple]:
    """The metrics function that a scenario of the packages names -> the declarations beside it; faults' scores first."""
    named = {data.get("metrics") for data in map(yaml_text.read, source.available().values())} - {None}
    found = {f"{fault_scores.__name__}:scores": fault_scores.METRICS}
    for name in sorted(named):
        found[name] = functions.load(name, "metrics").__globals__["METRICS"]
    return found


def _metrics():
    yield from ["## Metrics", "", "A metric that a run does not have is `none` (`null` in JSON and tables), never a "
                "number that stands for it.", ""]
    for name, entries in metric_tables().items():
        yield from [f"### {name}", "", "| metric | unit | meaning | none means |", "|---|---|---|---|"]
        for entry in entries:
            yield f"| `{entry.name}` | {entry.unit or entry.kind} | {_cell(entry.meaning)} | {_cell(entry.missing)} |"
        yield ""


def index_text(indices: range) -> str:
    """Where a quantity stands in its array."""
    return str(indices[0]) if len(indices) == 1 else f"{indices[0]}-{indices[-1]}"


def _components():
    yield from ["## Components", ""]
    for name, component in registry.components().items():
        inputs = ", ".join(f"{port} `/{signal.topic}`" for port, signal in component.inputs.items()) or "none"
        outputs = ", ".join(f"{port} `/{signal.topic}`" for port, signal in component.outputs.items()) or "none"
        package, executable = name.split("/")
        yield from [f"### {name}", "", component.summary(), "", f"`ros2 run {package} {executable}`; "
                    f"{component.rate_hz:g} Hz by default. In: {inputs}. Out: {outputs}.", ""]
        entries = component.parameters.entries.values()
        if entries:
            yield from ["| parameter | default | allowed | meaning | source |", "|---|---|---|---|---|"]
        for entry in entries:
            default = component.parameters.defaults()[entry.name]
            yield (f"| `{entry.name}` | {_cell(_short(default))} | {_cell(entry.range_text)} | {_cell(entry.doc)} | "
                   f"{_cell(entry.source)} |")
        yield ""


def _short(value):
    text = str(value)
    return text if len(text) < 60 else f"{text[:50]}... ({text.count(',') + 1} numbers)"


def _cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")


def _yes(flag):
    return "yes" if flag else "no"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference(), encoding="utf-8", newline="\n")
