"""flight compile: machine code made ahead of the first run."""

import json
import time
from typing import Annotated

import typer

from flight_graph.cli.scenarios import CheckBounds, Json
from flight_graph.cli.show import steps
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError


def register(app: typer.Typer) -> None:
    app.command("compile", epilog="Example: flight compile cubli_asteroid my_scenario.yaml")(compile_)


def compile_(
    names: Annotated[list[str] | None, typer.Argument(metavar="SCENARIO", help="Scenarios: names or files.")] = None,
    everything: Annotated[bool, typer.Option("--all", help="All scenarios that come with the packages.")] = False,
    jobs: Annotated[int | None, typer.Option(
        min=1, max=256, help="Components at a time; one a core when left out.")] = None,
    check_bounds: CheckBounds = False,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """Compile the components of scenarios into the cache; a run compiles what it needs by itself.

    A component is compiled once, for all scenarios, engines and nodes, and again only when its kernels or records change.
    """
    from flight_graph.engines import compilation
    from flight_graph.graphs import scenario as scenarios
    from flight_graph.graphs.source import available
    if not names and not everything:
        raise FlightError("flight compile: name scenarios, or write --all")
    wanted = [*(names or []), *(available() if everything else ())]
    consent = asked(trust)
    graphs = [scenarios.load(name, consent=consent).graph for name in dict.fromkeys(wanted)]
    components = {node.use: node.component for graph in graphs for node in graph.nodes.values()}
    began = time.perf_counter()
    with steps("compiling", not as_json) as advance:
        made = compilation.compile_missing(components, check_bounds, advance, jobs)
    seconds = time.perf_counter() - began
    if as_json:
        print(json.dumps({"components": sorted(components), "compiled": made, "wall_s": seconds}))
    else:
        print(f"{len(components)} components are compiled" + (f", {made} of them now, in {seconds:.1f} s" if made else ""))
