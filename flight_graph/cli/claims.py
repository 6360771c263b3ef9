"""flight claims: what a paper says, recomputed and judged."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.show import console, number, steps
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.papers import papers
from flight_graph.text_files import decoded, read_bytes

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
    flips: Annotated[bool, typer.Option(
        "--flips", help="Judge each row under the change that should make its verdict another one.")] = False,
    text: Annotated[Path | None, typer.Option(
        help="A text of the paper: say which quotations do not stand in it, and run nothing.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Recompute the claims of a paper from runs and say which hold. The status is 1 when a verdict has changed."""
    given = {"--text": text, "--flips": flips or None, "--figures": figures, "--bags": bags}
    alone = [name for name in ("--text", "--flips") if given[name] is not None]
    if alone and sum(value is not None for value in given.values()) > 1:
        raise FlightError(f"{alone[0]} goes with none of {', '.join(name for name in given if name != alone[0])}")
    for option, folder in (("--figures", figures), ("--bags", bags)):
        if folder is not None:
            _make_folder(option, folder)
    if text is not None:
        failed = _quotations(paper, text, only, as_json)
    elif flips:
        failed = _flips(_rows_of([paper] if paper else list(papers()), only), jobs, as_json)
    else:
        failed = _judge(_rows_of([paper] if paper else list(papers()), only), jobs, figures, bags, as_json)
    if failed:
        raise typer.Exit(1)


def _make_folder(option, folder) -> None:
    """Before anything runs. Raises FlightError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FlightError(f"{option} {folder}: this folder cannot be made ({reason})") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FlightError(f"{option} {folder}: this folder is read-only")


def _rows_of(names, only) -> dict:
    """Paper -> the ids that are asked of it (None for all rows). Of several papers each has those that it knows."""
    from flight_graph.claims.claims_file import read
    if not only or len(names) == 1:
        return dict.fromkeys(names, only)
    known = {name: {claim.id for claim in read(name).claims} for name in names}
    for one in only:
        if not any(one in ids for ids in known.values()):
            raise unknown("claim", one, set().union(*known.values()), "papers")
    wanted = {name: [one for one in only if one in ids] for name, ids in known.items()}
    return {name: ids for name, ids in wanted.items() if ids}


def _judge(names, jobs, figures, bags, as_json) -> bool:
    from flight_graph.claims import claims as engine
    kept = None
    if bags is not None:
        from flight_graph.claims.kept_runs import KeptRuns
        kept = KeptRuns(bags)
    rows = {}
    for name, only in names.items():
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
        return bool(changed)
    for name, found in rows.items():
        console.print(table(engine.read(name), found))
        console.print(counts(found))
    for path in drawn:
        print(path)
    if changed:
        console.print(f"[red]changed verdicts: {', '.join(row.claim.id for row in changed)}[/red]")
    return bool(changed)


def _flips(names, jobs, as_json) -> bool:
    from rich.markup import escape
    from rich.table import Table

    from flight_graph.claims.flips import flip
    found = {}
    for name, only in names.items():
        with steps(f"changes of {name}", not as_json) as advance:
            found[name] = flip(name, only, jobs, advance)
    stayed = [one for rows in found.values() for one in rows if not one.as_said]
    if as_json:
        print(json.dumps({"flips": [one.plain(name) for name, rows in found.items() for one in rows]}))
        return bool(stayed)
    for name, rows in found.items():
        shown = Table("row", "verdict", "what is changed", "found then", "verdict then", title=name, title_justify="left")
        for one in rows:
            mark = "" if one.as_said else f" (expected: {one.claim.flip.to})"
            shown.add_row(one.claim.id, _coloured(one.claim.expect), escape(one.claim.flip.change),
                          escape(_found(one.judged)), _coloured(one.judged.verdict, mark))
        console.print(shown)
    if stayed:
        console.print(f"[red]not as expected: {', '.join(one.claim.id for one in stayed)}[/red]")
    return bool(stayed)


def _quotations(paper, text, only, as_json) -> bool:
    from flight_graph.claims import quotations
    from flight_graph.claims.claims import chosen
    from flight_graph.claims.claims_file import read
    if paper is None:
        raise FlightError("--text is the text of one paper: name it, as in 'flight claims appc --text paper.txt'")
    rows = chosen(read(paper), only, paper)
    lacking = quotations.missing(rows, decoded(read_bytes(text, str(text)), str(text)))
    total = sum(len(claim.quotes) for claim in rows)
    if as_json:
        print(json.dumps({"quotations": total, "missing": lacking}))
        return bool(lacking)
    for name, quotes in lacking.items():
        for quote in quotes:
            print(f"{name}: not in {text}: {quote}")
    print(f"{total - sum(map(len, lacking.values()))} of {total} quotations of {paper} stand in {text}")
    return bool(lacking)


def counts(rows):
    """How many rows there are of each verdict, by whose statement they judge."""
    from collections import Counter

    from rich.table import Table

    from flight_graph.claims.claims_file import SAID, STATEMENTS, VERDICTS
    found = Counter((row.claim.statement, row.verdict) for row in rows)
    shown = Table("statement", *VERDICTS)
    for statement in STATEMENTS:
        shown.add_row(SAID[statement], *[str(found[statement, verdict]) for verdict in VERDICTS])
    return shown


def table(content, rows):
    """The verdicts of a paper as a table."""
    from rich.markup import escape
    from rich.table import Table
    judged = any(row.estimated_verdict for row in rows)
    columns = ["row, whose it is, where", "claim", "found", "wanted", "verdict",
               *(["with estimated state"] if judged else []), "reason"]
    shown = Table(*columns, title_justify="left", title=f"{content.title}\n{content.source}")
    for row in rows:
        mark = "" if row.as_expected else " (changed!)"
        wanted = row.claim.relation.text if row.claim.relation else ""
        place = f"[bold]{row.claim.id}[/bold]\n[dim]{row.claim.statement}[/dim]\n{escape(row.claim.where)}"
        cells = [place, escape(row.claim.says), escape(_found(row)), escape(wanted), _coloured(row.verdict, mark)]
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
    return f"{number(min(numbers))} to {number(max(numbers))} ({len(value)} values)" if numbers else "none"
