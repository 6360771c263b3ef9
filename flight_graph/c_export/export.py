"""Writing a component as C into a folder."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from flight_graph.c_export import example, header, machine_code
from flight_graph.c_export.archive import archive
from flight_graph.c_export.machine_code import TEXT
from flight_graph.components import declared, registry
from flight_graph.errors import FlightError
from flight_graph.recordings.recorded_run import RecordedRun
from flight_graph.timebase import SECOND, period_ns


@dataclass
class Exported:
    """What was written. needs: functions that the code calls outside of itself."""

    name: str
    folder: Path
    files: list[Path] = field(default_factory=list)
    needs: list[str] = field(default_factory=list)
    sizes: dict[str, int] = field(default_factory=dict)  # part -> bytes of its code


def export(use: str, folder: Path, target: str = machine_code.HOST, run: RecordedRun | None = None,
           node_name: str | None = None) -> Exported:
    """Write a component's header, library, records and example into a new folder. Raises FlightError.

    run: a recorded run, whose parameters and rate are taken, and whose firings of the component are written for the
    example; node_name: which of its components, where it has several of this kind.
    """
    node = _node(run, use, node_name) if run else None
    component = node.component if node else registry.component(use)
    name = re.sub("[^a-z0-9_]", "_", re.sub("(?<=[a-z0-9])(?=[A-Z])", "_", re.split("[/:]", use)[-1]).lower())
    values = node.values if node else declared.resolved(component, component.parameters.defaults(), use, None)
    period = node.period_ns if node else period_ns(component.rate_hz, use)
    parameters = component.parameters.record(values, use)
    parameters["period"] = period / SECOND
    if folder.exists():
        raise FlightError(f"--out {folder}: it exists already; name a new folder")
    parts = machine_code.parts(component, name, target)
    fired = example.firings(run, node) if run else None
    needs = sorted({one for part in parts.values() for one in part.needs})
    libm = bool({"floor", "ceil"} & set(needs))
    content = {f"{name}.h": header.header(component, use, name, period, parts, machine_code.address_bits(target)),
               f"{name}_data.c": header.data(component, name, parameters, component.initial_state(values)),
               "main.c": example.main_c(component, use, name, libm)}
    if target == TEXT:
        content |= {f"{part.symbol}.ll": part.code for part in parts.values()}
    else:
        content |= {f"lib{name}.a": archive({f"{key}.o": (part.code, [part.symbol]) for key, part in parts.items()}),
                    "CMakeLists.txt": example.CMAKE.format(name=name, libraries=" m" if libm else "")}
    if fired is not None:
        content["firings.bin"] = fired
    made = Exported(name, folder, needs=needs, sizes={key: len(part.code) for key, part in parts.items()})
    try:
        folder.mkdir(parents=True)
        for file, text in content.items():
            (folder / file).write_bytes(text if isinstance(text, bytes) else text.encode())
            made.files.append(folder / file)
    except OSError as error:
        raise FlightError(f"'{folder}' cannot be written: {(error.strerror or str(error)).lower()}") from None
    return made


def _node(run, use, node_name):
    nodes = run.scenario.graph.nodes
    found = [node for name, node in nodes.items() if node.use == use and node_name in (None, name)]
    if len(found) != 1:
        kinds = ", ".join(f"{name} ({node.use})" for name, node in nodes.items())
        raise FlightError(f"bag '{run.bag.path}': {'which' if found else 'no'} component is {use}"
                          f"{'? --component says it' if found else ''}; it has {kinds}")
    return found[0]
