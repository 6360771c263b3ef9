"""flight claims: what a paper says, recomputed and judged."""

import json
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import console, number, steps

SHOWN_VALUES = 8  # in a cell


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight claims appc --json")(claims)


def claims(
    paper: Annotated[str | None, typer.Argument(help="A paper's name; all papers when left out.")] = None,
    only: Annotated[list[str] | None, typer.Option(help="The id of a row; may be repeated.")] = None,
    jobs: Annotated[int, typer.Option(min=1, max=256, help="Runs at a time.")] = 2,
    figures: Annotated[Path | None, typer.Option(help="Draw the paper's figures into this folder.")] = None,
    bags: Annotated[Path | None, typer.Option(
        help="Keep every run as a bag in this folder, and take from there what is kept already.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Recompute the claims of a paper from runs and say which hold. The status is 1 when a verdict has changed."""
    from flight_graph.claims import claims as engine
    kept = None
    if bags is not None:
        from flight_graph.claims.kept_runs import KeptRuns
        kept = KeptRuns(bags)
    rows = {}
    for name in [paper] if paper else engine.papers():
        with steps(f"claims of {name}", not as_json) as advance:
            rows[name] = engine.judge(name, jobs, only, advance, kept)
    drawn = []
    for name in rows if figures else ():
        with steps(f"figures of {name}", not as_json) as advance:
            drawn += engine.load_figures(name).draw(figures, advance, kept=kept)
    changed = [row for found in rows.values() for row in found if not row.as_expected]
    if as_json:
        print(json.dumps({"claims": [row.plain(name) for name, found in rows.items() for row in found],
                          "figures": [str(path) for path in drawn]}))
    else:
        for name, found in rows.items():
            console.print(table(engine.read(name), found))
        for path in drawn:
            print(path)
        if changed:
            console.print(f"[red]changed verdicts: {', '.join(row.claim.id for row in changed)}[/red]")
    if changed:
        raise typer.Exit(1)


def table(content, rows):
    """The verdicts of a paper as a table."""
    from rich.markup import escape
    from rich.table import Table
    judged = any(row.estimated_verdict for row in rows)
    columns = ["where", "claim", "found", "wanted", "verdict", *(["with estimated state"] if judged else []), "reason"]
    shown = Table(*columns, title_justify="left", title=f"{content.title}\n{content.source}")
    for row in rows:
        mark = "" if row.as_expected else " (changed!)"
        cells = [escape(row.claim.where), escape(row.claim.says), escape(_found(row)),
                 escape(row.claim.relation.text if row.claim.relation else ""), _coloured(row.verdict, mark)]
        if judged:
            cells.append("" if row.estimated_verdict is None else
                         f"{_coloured(row.estimated_verdict)}\n{escape(_estimated(row.estimated))}")
        shown.add_row(*cells, escape(row.claim.because))
    return shown


def _coloured(verdict, mark=""):
    colour = {"holds": "green", "does not hold": "red", "depends": "yellow"}[verdict]
    return f"[{colour}]{verdict}{mark}[/]"


def _found(row):
    """The values of a row; of many, the range and where the relation fails."""
    if len(row.found) <= SHOWN_VALUES:
        return "\n".join(f"{label}: {number(value)}" if label else number(value) for label, value in row.found.items())
    numbers = [value for value in row.found.values() if isinstance(value, (int, float))]
    failed = [f"{label}: {number(row.found[label])}" for label, held in row.met.items() if not held]
    lines = [f"{sum(row.met.values())} of {len(row.found)}" + (
        f", {number(min(numbers))} to {number(max(numbers))}" if numbers else "")]
    if failed and len(failed) < len(row.found):
        lines += ["not: " + failed[0], *failed[1:SHOWN_VALUES], *(["..."] if len(failed) > SHOWN_VALUES else [])]
    return "\n".join(lines)


def _estimated(value):
    numbers = [one for one in value.values() if one is not None] if isinstance(value, dict) else None
    if numbers is None:
        return number(value)
    return f"{number(min(numbers))} to {number(max(numbers))} ({len(value)} runs)" if numbers else "never"
