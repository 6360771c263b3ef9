"""A scenario as tables: its graph and all parameters, or, where its code may not run, what its file says."""

import json

from flight_graph.cli.show import add, console, status
from flight_graph.text_files import printable


def show(name_or_path: str, trust: bool, as_json: bool) -> None:
    """Print a scenario. Code that does not come with the packages is imported with ``trust`` alone."""
    from flight_graph.graphs import include
    from flight_graph.graphs import scenario as scenarios
    from flight_graph.graphs.named_code import foreign_code
    from flight_graph.graphs.source import read_file
    data, path = read_file(name_or_path)
    data = include.gathered(data, path)
    found = foreign_code(data, path.parent)
    if found and not trust:
        _show_file(data, path, found, as_json)
    else:
        _show_scenario(scenarios.load(name_or_path), as_json)


def _show_file(data, path, found, as_json):
    from flight_graph.graphs import vehicles
    from flight_graph.graphs.scenario_file import ScenarioFile
    file = ScenarioFile.read(data, path.name)
    if as_json:
        print(json.dumps({**file.model_dump(by_alias=True, exclude_none=True),
                          "not_imported": [code.__dict__ for code in found]}))
        return
    from rich.table import Table
    _title(file)
    table = Table("component", "is a", "rate [Hz]", "parameters of the file")
    for name, entry, _ in vehicles.components(data):
        given = vehicles.mapping(vehicles.mapping(entry).get("parameters"))
        add(table, name, *(vehicles.mapping(entry).get(key, "") for key in ("use", "rate_hz")),
            "\n".join(f"{key}: {value}" for key, value in given.items()))
    console.print(table)
    for code in found:
        status(f"not imported: {printable(str(code))}")
    status("graph and all parameters are shown with --trust, which imports this code; read it first")


def _show_scenario(scenario, as_json):
    if as_json:
        print(json.dumps(scenario.resolved()))
        return
    from rich.table import Table

    from flight_graph.faults.report import does_nothing
    _title(scenario.file)
    _show_vehicles(scenario)
    table = Table("component", "is a", "rate [Hz]", "input <- source", "output topics")
    for name, node in scenario.graph.nodes.items():
        inputs = [f"{port} <- {edge.node}.{edge.port}{' (delay 1)' if edge.delay else ''}"
                  for port, edge in node.inputs.items()]
        topics = ["/" + signal.topic for signal in node.component.outputs.values()]
        use = node.use.partition(":")[0] if does_nothing(node.component) else node.use.partition("@")[0]
        add(table, name, use, f"{node.rate_hz:g}", "\n".join(inputs), "\n".join(topics))
    console.print(table)
    _show_events(scenario)
    _show_faults(scenario)
    table = Table("parameter", "value", "allowed", "meaning", "source")
    for name, node in scenario.graph.nodes.items():
        for entry in node.component.parameters.entries.values():
            add(table, f"{name}.{entry.name}", node.values[entry.name], entry.range_text, entry.doc, entry.source)
    console.print(table)
    if scenario.vary:
        varied = [*scenario.vary.declared_keys(), *([scenario.vary.file.function] if scenario.vary.file.function else [])]
        console.print(f"flight sweep {scenario.name}: {scenario.vary.count} cases of {', '.join(varied)}", markup=False)


def _show_events(scenario):
    """What changes while it runs."""
    from rich.table import Table
    if found := scenario.events():
        table = Table("at (s)", "what is set", "value", title="events", title_justify="left")
        for entry in sorted(found, key=lambda entry: entry.at_s):
            placed = {f"{name}, put: {key}": value
                      for name, given in (entry.place or {}).items() for key, value in given.items()}
            for name, value in [*(entry.set or {}).items(), *placed.items()]:
                add(table, f"{entry.at_s:g}", name, value)
        console.print(table)


def _show_vehicles(scenario):
    """Which scenarios it includes."""
    from rich.table import Table
    if scenario.vehicles:
        table = Table("vehicle", "scenario", "seed", "what it is", title="vehicles", title_justify="left")
        for name, vehicle in scenario.vehicles.items():
            add(table, name, vehicle.name, vehicle.seed, vehicle.file.title)
        console.print(table)


def _show_faults(scenario, vehicle=""):
    """What breaks, and what flight software watches, of the whole and then of each vehicle."""
    from rich.table import Table
    of = f" of {vehicle}" if vehicle else ""
    if scenario.faults.faults:
        table = Table("fault", "at", "type", "unit", "more", title=f"faults{of}", title_justify="left")
        for fault in scenario.faults.faults:
            more = {key: value for key, value in fault.entry.given.items() if key not in ("id", "at", "type", "unit")}
            add(table, fault.id, fault.entry.at, fault.entry.type, fault.unit,
                ", ".join(f"{key} {value}" for key, value in more.items()))
        console.print(table)
    if (monitors := scenario.faults.monitors) is not None:
        _show_monitors(monitors, of)
    for name, inside in scenario.vehicles.items():
        _show_faults(inside, f"{vehicle}.{name}".lstrip("."))


def _show_monitors(monitors, of):
    from rich.table import Table
    table = Table("watchpoint", "holds while", title=f"watchpoints{of}", title_justify="left")
    for watch in monitors.watches:
        add(table, watch.entry.id, watch.condition.text)
    console.print(table)
    table = Table("actionpoint", "when", "in a row", "acts", "level", "blames", "does", title=f"actionpoints{of}",
                  title_justify="left")
    for action in monitors.actions:
        entry = action.entry
        does = [*(f"{name}: mode {mode}" for name, mode in entry.mode.items()),
                *(f"{path} = {value:g}" for path, value in entry.set.items())]
        add(table, entry.id, entry.when, entry.in_a_row, entry.act, entry.level, ", ".join(entry.blames), ", ".join(does))
    console.print(table)


def _title(file):
    from rich.text import Text
    console.print(Text.assemble((printable(file.name), "bold"), printable(f": {file.title}\n{file.description}").rstrip()))
