"""flight check: a component of one's own, before any scenario."""

import json
from typing import Annotated

import typer

from flight_graph.cli.show import console, working


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight check examples/sliding_controller.py:SlidingController")(check)


def check(
    component: Annotated[str, typer.Argument(
        metavar="FILE[:CLASS]", help="A Python file (all its components), one class of it, or package/executable.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Check a component: read it, compile each part, run each once with bounds checks. The status is 1 when it is wrong.

    Every mistake is one sentence: file, line, component, part, what is wrong, what is allowed. FLIGHT_DEBUG=1 in the
    environment shows what the compiler itself says.
    """
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
