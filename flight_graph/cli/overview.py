"""What there is: the scenarios by vehicle and purpose, the components by package."""

import json

from flight_graph import yaml_text
from flight_graph.cli.show import add, console

VEHICLES = {"cubli_ros": "rover", "spacerobot_ros": "space robot", "lander_ros": "lander"}
SEVERAL = "several vehicles"
RUN, SWEEP = "one run: flight run NAME", "many runs: flight sweep NAME"
FAULTS = "faults: flight run NAME --case N, or flight sweep NAME"
PURPOSES = (RUN, SWEEP, FAULTS)


def vehicle(data: dict) -> str:
    """Whose a scenario is, by the flight packages of its components."""
    if data.get("include"):
        return SEVERAL
    packages = {str(entry.get("use", "")).partition("/")[0].partition(".")[0] for entry in data["components"].values()}
    return next((name for package, name in VEHICLES.items() if package in packages), "others")


def purpose(data: dict) -> str:
    """What a scenario is for."""
    return RUN if not data.get("vary") else FAULTS if data.get("faults") else SWEEP


def show_all(components: bool, as_json: bool) -> None:
    """Print the scenarios, or the components."""
    from flight_graph.components import registry
    from flight_graph.graphs.source import available
    found = {name: yaml_text.read(path) for name, path in available().items()}
    if as_json:
        print(json.dumps({
            "scenarios": {name: data["title"] for name, data in found.items()},
            "groups": {name: [vehicle(data), purpose(data).partition(":")[0]] for name, data in found.items()},
            "components": {name: one.summary() for name, one in registry.components().items()}}))
        return
    if components:
        _components(registry.components())
        return
    for name in [*VEHICLES.values(), SEVERAL, "others"]:
        mine = {key: data for key, data in found.items() if vehicle(data) == name}
        if mine:
            _vehicle(name, mine)
    console.print("flight list NAME shows one, flight list --components what they are made of", highlight=False)


def _vehicle(name, found):
    from rich.padding import Padding
    from rich.table import Table
    longest = max(map(len, found))
    console.print(f"\n[bold]{name}[/bold]")
    for what in PURPOSES:
        mine = {key: data["title"] for key, data in found.items() if purpose(data) == what}
        if mine:
            console.print(f"  {what}", style="dim", highlight=False)
        grid = Table.grid(padding=(0, 1, 0, 0))
        grid.add_column(width=longest, no_wrap=True)
        grid.add_column()
        for key, title in mine.items():
            add(grid, key, title)
        if mine:
            console.print(Padding(grid, (0, 0, 0, 4), expand=False))


def _components(found):
    from rich.table import Table
    table = Table("name", "what it is", title="components", title_justify="left")
    for name, one in found.items():
        add(table, name, one.summary())
    console.print(table)
