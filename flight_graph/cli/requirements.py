"""flight check of requirements: what a vehicle has to do, run, judged, and traced to its bags."""

import json
import time
from pathlib import Path

import typer

from flight_graph.cli.show import add, console, number, status, steps
from flight_graph.cli.trust import asked


def check_requirements(target: str, out: Path | None, only, jobs: int, trust: bool, as_json: bool) -> None:
    """Check the requirements of a file or of a vehicle; the status is 1 when one is not as its file says."""
    from flight_graph.requirements import checking, papers
    from flight_graph.requirements.requirements_file import chosen, read
    content, path = read(target)
    wanted = checking.needs(chosen(content, only, str(path)), asked(trust))
    folder, began = checking.new_folder(out, path.stem), time.perf_counter()
    with steps(f"requirements of {path.stem}", not as_json) as advance:
        judged = checking.check(wanted, folder, jobs, number, advance, status)
    files = papers.write(folder, content.title, path.stem, judged, time.perf_counter() - began)
    failed = [one for one in judged if not one.passes]
    if as_json:
        print(json.dumps({"requirements": [one.plain() for one in judged], "passed": not failed,
                          "files": [str(file) for file in files]}))
    else:
        console.print(table(content, judged))
        for file in files:
            print(file)
        if failed:
            status(f"not as their file says: {', '.join(one.requirement.id for one in failed)}")
    if failed:
        raise typer.Exit(1)


def table(content, judged):
    """The verdicts as a table."""
    from rich.table import Table
    shown = Table("requirement", "what it says", "limit", "shown by", "found", "verdict", title=content.title,
                  title_justify="left")
    for one in judged:
        for place, evidence in enumerate(one.evidence):
            first = [one.requirement.id, one.requirement.text, one.limit_text] if place == 0 else ["", "", ""]
            verdict = one.verdict_text if len(one.evidence) == 1 else evidence.verdict
            scenario = Path(evidence.showing.scenario).stem
            add(shown, *first, f"{evidence.kind}: {scenario}", evidence.found, verdict)
        if one.requirement.waived:
            add(shown, "", f"waived: {one.requirement.waived}", "", "", "",
                one.verdict_text if len(one.evidence) > 1 else "")
    return shown
