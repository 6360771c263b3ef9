"""What of each paper is reproduced: recomputes all claims and prints a Markdown table (the README's).

    python benchmarks/reproduced.py [--rows PAPER]

Without --rows: the verdicts of each paper counted, by whose statement is judged. With --rows: every row of one paper.
"""

import argparse
from collections import Counter

from flight_graph.claims import claims
from flight_graph.claims.claims_file import STATEMENTS, VERDICTS
from flight_graph.cli.claims import SAID
from flight_graph.cli.show import number, steps
from flight_graph.graphs.papers import papers


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rows", metavar="PAPER", help="print every row of one paper")
    rows_of = options.parse_args().rows
    names = [rows_of] if rows_of else list(papers())
    if rows_of:
        print("| statement | where | claim | found | verdict |\n|---|---|---|---|---|")
    else:
        print("| paper | statements | rows | hold | do not hold | depend |\n|---|---|---|---|---|---|")
    for name in names:
        with steps(name, True) as advance:
            rows = claims.judge(name, progress=advance)
        if rows_of:
            for row in rows:
                found = "; ".join(f"{label} {number(value)}".strip() for label, value in row.found.items())
                claim = row.claim
                cells = [claim.statement, claim.where, claim.says, found, row.verdict]
                print(f"| {' | '.join(cells)} |".replace("\n", " "))
            continue
        found = Counter((row.claim.statement, row.verdict) for row in rows)
        title = claims.read(name).title
        for statement in STATEMENTS:
            each = [found[statement, verdict] for verdict in VERDICTS]
            print(f"| {title} | {SAID[statement]} | {sum(each)} | {' | '.join(map(str, each))} |")
            title = ""


if __name__ == "__main__":
    main()
