"""flight check: a component of one's own before any scenario, or the requirements of a vehicle."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import console, working
from flight_graph.cli.trust import Trust
from flight_graph.errors import FlightError


def register(app: typer.Typer) -> None:
    app.command(epilog="Examples: flight check examples/sliding_controller.py:SlidingController; flight check lander --out "
                "checks/lander")(check)


def check(
    target: Annotated[str, typer.Argument(
        metavar="FILE[:CLASS]|REQUIREMENTS", help="A Python file (all its components), one class of it, or "
        "package/executable; or a YAML file of requirements, or one of rover, spacerobot, lander.")],
    out: Annotated[Path | None, typer.Option(
        help="Of requirements: a new folder for bags, table, JUnit XML and trace.")] = None,
    only: Annotated[list[str] | None, typer.Option(help="Of requirements: the id of one; may be repeated.")] = None,
    jobs: Annotated[int, typer.Option(min=1, max=256, help="Of requirements: runs at a time.")] = 2,
    trust: Trust = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a component, or the requirements of a vehicle. The status is 1 when something is wrong, or not met.

    A component is read, each part compiled and run once with bounds checks. Every mistake is one sentence: file, line,
    component, part, what is wrong, what is allowed. FLIGHT_DEBUG=1 in the environment shows what the compiler itself says.

    Requirements are checked by the runs and campaigns that they name. Every run is kept as a bag; junit.xml,
    requirements.md and .json, and the trace matrix trace.csv stand beside the bags.
    """
    from flight_graph.requirements.requirements_file import is_requirements
    if is_requirements(target):
        from flight_graph.cli.requirements import check_requirements
        check_requirements(target, out, only, jobs, trust, as_json)
        return
    if out is not None or only:
        raise FlightError("--out and --only go with requirements; a component has neither")
    _check_component(target, as_json)


def _check_component(component, as_json):
    """Check ``FILE[:CLASS]`` or ``package/executable``."""
    from flight_graph.engines.checking import check as check_component
    with working(f"checking {component}", not as_json):
        reports = check_component(component)
    wrong = any(report.mistakes for report in reports)
    if as_json:
        print(json.dumps({"correct": not wrong, "components": [
            {"component": report.name, "parts": report.parts, "remark": report.remark, "mistakes": report.mistakes}
            for report in reports]}))
    else:
        for report in reports:
            lines = [mistake["sentence"] for mistake in report.mistakes] or [
                f"{report.name}: correct ({', '.join(report.parts)}{'; ' if report.remark else ''}{report.remark})"]
            for line in lines:
                console.print(line, markup=False, highlight=False)
    if wrong:
        raise typer.Exit(1)
