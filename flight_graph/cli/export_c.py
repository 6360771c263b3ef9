"""flight export-c: a component as C."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Json
from flight_graph.cli.show import status, working
from flight_graph.cli.trust import Trust, asked


def register(app: typer.Typer) -> None:
    app.command("export-c", epilog="Example: flight export-c cubli_ros/appc_controller --out appc --bag "
                                   "bags/cubli_asteroid")(export_c)


def export_c(
    use: Annotated[str, typer.Argument(metavar="COMPONENT", help="package/executable, or file.py:Class.")],
    out: Annotated[Path, typer.Option(help="Folder for the C files (a new one).")],
    target: Annotated[str, typer.Option(
        help="host, x86_64, aarch64, riscv64, armv7 (hard float): a static library; ir: LLVM's code.")] = "host",
    bag: Annotated[Path | None, typer.Option(
        help="A recorded run: its parameters are taken, and its inputs written for the example program.")] = None,
    component: Annotated[str | None, typer.Option(
        help="Which component of the bag, where several are of this kind.")] = None,
    trust: Trust = False, as_json: Json = False,
) -> None:
    """Write a component as C: header, static library of its machine code, and a program that flies a bag's inputs.

    The structs of its messages are their CDR bodies. Nothing in the library allocates or needs Python.
    """
    import os
    if target != "host":
        os.environ["NUMBA_CPU_NAME"] = "generic"  # before numba is imported: code for no processor in particular
    from flight_graph.c_export.export import export
    from flight_graph.components import foreign, registry
    from flight_graph.recordings.recorded_run import open_recorded
    consent = asked(trust)
    if found := foreign.of_component("component", use, Path.cwd()):
        consent(use, [found])
    with working(f"compiling {use}", not as_json):
        run = open_recorded(bag, consent) if bag else None
        made = export(registry.absolute(use, Path.cwd()), out, target, run, component)
    if as_json:
        print(json.dumps({"name": made.name, "files": [str(file) for file in made.files], "needs": made.needs,
                          "sizes": made.sizes}))
        return
    status(", ".join(f"{part} {size} bytes" for part, size in made.sizes.items())
           + f"; needs from outside: {', '.join(made.needs) or 'nothing'}")
    print(out)
