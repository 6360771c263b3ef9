"""The papers' section: its first page, and for each paper every row that is judged, with its verdict and its command."""

from flight_graph.claims.claims_file import SAID, STATEMENTS, VERDICTS, read
from flight_graph.graphs.papers import papers
from pages.component_pages import cell

REPORTS = {"appc": ("The Cubli rover", "appc.md"), "spacerobot": ("The space robot", "spacerobot.md"),
           "lander": ("The asteroid lander", "lander.md")}


def write(stage) -> None:
    """The index and a page for each paper."""
    lines = ["# Vehicles and papers", "", "Each vehicle comes from a paper. What it says is recomputed from runs, row by "
             "row, and shown as not holding where it does not hold. How to reproduce a number: "
             "[reproducibility](../reproducibility.md). The figures, beside what is judged on them: "
             "[gallery](../gallery.md).", "",
             "| vehicle | paper | " + " | ".join(VERDICTS) + " |", "|---|---|" + "---|" * len(VERDICTS)]
    for name in papers():
        content = read(name)
        title, report = REPORTS[name]
        counts = [sum(claim.expect == verdict for claim in content.claims) for verdict in VERDICTS]
        lines.append(f"| [{title}](../{report}) ([rows]({name}.md)) | {cell(content.title)} | "
                     f"{' | '.join(map(str, counts))} |")
        stage.write(f"papers/{name}.md", "\n".join(_page(name, content)) + "\n")
    lines += ["", "What each vehicle does when something breaks: [rover](../faults_rover.md), "
              "[space robot](../faults_spacerobot.md), [lander](../faults_lander.md). Gains that keep the rover on the "
              "ground: [design rules](../design_rules.md). Conventions of the lander's algebra: "
              "[conventions](../conventions_lander.md)."]
    stage.write("papers/index.md", "\n".join(lines) + "\n")


def _page(name, content):
    title, report = REPORTS[name]
    yield from [f"# {title}: every row", "",
                f"{content.title}. {content.source}. The report in words: [{title}](../{report}).", "",
                f"`flight claims {name}` recomputes all of it, `flight claims {name} --only ROW` one row, "
                f"`flight claims {name} --flips --only ROW` the change that makes its verdict another one.", ""]
    for statement in STATEMENTS:
        rows = [claim for claim in content.claims if claim.statement == statement]
        if not rows:
            continue
        yield from [f"## {SAID[statement][:1].upper()}{SAID[statement][1:]}", "",
                    "| row | what is judged | verdict | reason, and what would change it |",
                    "|---|---|---|---|"]
        for claim in rows:
            quotes = "".join(f'<br>"{cell(quote)}"' for quote in claim.quotes)
            yield (f"| `{claim.id}`<br>{cell(claim.where)} | {cell(claim.says)}{quotes} | {claim.expect} | "
                   f"{cell(claim.because)}<br>*{claim.flip.to}:* {cell(claim.flip.change)} |")
        yield ""
