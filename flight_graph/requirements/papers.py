"""What a check of requirements leaves: junit.xml for continuous integration, requirements.md and .json, trace.csv."""

import csv
import io
import json
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from flight_graph.requirements.evidence import MET, Evidence, Judged

JUNIT, PAGE, PLAIN, TRACE = "junit.xml", "requirements.md", "requirements.json", "trace.csv"
TRACE_COLUMNS = ("requirement", "metric", "limit", "shown by", "scenario", "case", "bag", "campaign", "verdict")


def write(folder: Path, title: str, name: str, judged: list[Judged], wall_s: float) -> list[Path]:
    """Write all of them into a folder; returns the files. name: of the requirements."""
    texts = {JUNIT: junit(name, judged, wall_s), PAGE: page(title, judged, folder),
             PLAIN: json.dumps({"title": title, "requirements": [one.plain() for one in judged]}, indent=1) + "\n",
             TRACE: trace(judged, folder)}
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8", newline="\n")
    return [folder / file for file in texts]


def junit(name: str, judged: list[Judged], wall_s: float) -> str:
    """One test case for each entry of ``shown_by``. What is waived is skipped; a waiver for nothing fails."""
    cases = [(one, evidence) for one in judged for evidence in one.evidence]
    outcomes = [_outcome(one, evidence) for one, evidence in cases]
    kinds = [kind for kind, *_ in outcomes]
    counts = {"tests": str(len(cases)), "failures": str(kinds.count("failure")), "errors": "0",
              "skipped": str(kinds.count("skipped")), "time": f"{wall_s:.3f}"}
    root = ElementTree.Element("testsuites", {"name": "requirements", **counts})
    suite = ElementTree.SubElement(root, "testsuite", {"name": name, **counts})
    for (one, evidence), (kind, attributes, text) in zip(cases, outcomes):
        identifier = one.requirement.id
        case = ElementTree.SubElement(suite, "testcase", {
            "classname": f"{name}.{identifier}", "name": f"{identifier} by {_shown(evidence)}", "time": "0"})
        properties = ElementTree.SubElement(case, "properties")
        for key, value in {"requirement": one.requirement.id, "text": one.requirement.text, "limit": one.limit_text,
                           "scenario": evidence.showing.scenario, "found": evidence.found,
                           "campaign": evidence.campaign or "", **_bags(evidence)}.items():
            ElementTree.SubElement(properties, "property", {"name": key, "value": _text(value)})
        if kind:
            ElementTree.SubElement(case, kind, attributes).text = _text(text)
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _outcome(one: Judged, evidence: Evidence) -> tuple:
    """(failure, skipped or nothing, attributes, text)."""
    wanted = one.requirement
    if wanted.waived is not None:
        if one.verdict == MET:
            message = "waived, and met all the same: take the waiver away"
            return "failure", {"message": message, "type": "waiver"}, wanted.waived
        if evidence.verdict != MET:
            return "skipped", {"message": _text(f"{evidence.verdict}, waived: {wanted.waived}")}, ""
    if evidence.verdict == MET:
        return "", {}, ""
    message = f"{evidence.verdict}: {one.limit_text}; {evidence.found}"
    return "failure", {"message": _text(message), "type": evidence.verdict}, f"{wanted.text}\n{message}"


def _bags(evidence) -> dict:
    return {f"bag {label}".strip(): path for label, path in evidence.bags.items()}


def _shown(evidence: Evidence) -> str:
    """The entry of ``shown_by`` in a few words."""
    entry = evidence.showing.run or evidence.showing.campaign
    scenario = Path(entry.scenario).stem
    if evidence.showing.campaign:
        return f"{entry.runs} runs of {scenario}"
    words = [f"case {entry.case}"] if entry.case is not None else [f"cases {entry.cases}"] if entry.cases else []
    words += [f"{key} {value}" for key, value in entry.set.items()]
    return f"{scenario} ({', '.join(words)})" if words else scenario


def _text(value) -> str:
    """A text that XML can hold."""
    return "".join(letter if letter >= " " or letter in "\n\t" else "?" for letter in str(value))


def trace(judged: list[Judged], folder: Path) -> str:
    """The trace matrix as a table: a line for each requirement, scenario, case and bag."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(TRACE_COLUMNS)
    for one in judged:
        for evidence in one.evidence:
            for label, bag in (evidence.bags or {"": ""}).items():
                writer.writerow([
                    one.requirement.id, one.requirement.metric, one.limit_text, evidence.kind, _shown(evidence), label,
                    _below(bag, folder), _below(evidence.campaign or "", folder), evidence.verdict])
    return sink.getvalue()


def _below(path, folder) -> str:
    """A path as it is from the folder, with slashes."""
    return Path(os.path.relpath(path, folder)).as_posix() if path else ""


def page(title: str, judged: list[Judged], folder: Path) -> str:
    """The verdicts, and the trace matrix requirement - scenario, whose cells lead to the bags, in Markdown."""
    lines = [f"# {title}", "", _row("requirement", "what it says", "limit", "shown by", "found", "verdict"),
             "|---|---|---|---|---|---|"]
    for one in judged:
        for evidence in one.evidence:
            lines.append(_row(one.requirement.id, one.requirement.text, one.limit_text, _shown(evidence), evidence.found,
                              evidence.verdict))
        if one.requirement.waived:
            lines.append(_row("", f"waived: {one.requirement.waived}", "", "", "", one.verdict_text))
    shown = list(dict.fromkeys(_shown(evidence) for one in judged for evidence in one.evidence))
    lines += ["", "## Trace matrix", "", _row("requirement", *shown), "|---" * (len(shown) + 1) + "|"]
    for one in judged:
        cells = {_shown(evidence): _cell(evidence, folder) for evidence in one.evidence}
        lines.append(f"| {one.requirement.id} | " + " | ".join(cells.get(name, "") for name in shown) + " |")
    return "\n".join([*lines, ""])


def _cell(evidence, folder) -> str:
    links = [f"[{_escaped(label) or 'bag'}](<{_below(path, folder)}>)" for label, path in evidence.bags.items()]
    return f"{evidence.verdict}: {' '.join(links)}" if links else evidence.verdict


def _row(*cells) -> str:
    return f"| {' | '.join(_escaped(cell) for cell in cells)} |"


def _escaped(text) -> str:
    return str(text).replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ")
