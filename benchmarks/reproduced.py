"""What of each paper is reproduced: recomputes all claims and prints a Markdown table (the README's).

    python benchmarks/reproduced.py [--rows PAPER]

Without --rows: one line a paper, counting verdicts. With --rows: every row of one paper.
"""

import argparse
from collections import Counter

from flight_graph.claims import claims
from flight_graph.cli.show import number, steps


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rows", metavar="PAPER", help="print every row of one paper")
    rows_of = options.parse_args().rows
    names = [rows_of] if rows_of else list(claims.papers())
    if rows_of:
        print("| where | claim | found | verdict |\n|---|---|---|---|")
    else:
        print("| paper | rows | hold | do not hold | depend |\n|---|---|---|---|---|")
    for name in names:
        with steps(name, True) as advance:
            rows = claims.judge(name, progress=advance)
        if rows_of:
            for row in rows:
                found = "; ".join(f"{label} {number(value)}".strip() for label, value in row.found.items())
                print(f"| {row.claim.where} | {row.claim.says} | {found} | {row.verdict} |".replace("\n", " "))
            continue
        counts = Counter(row.verdict for row in rows)
        print(f"| {claims.read(name).title} | {len(rows)} | {counts[claims.HOLDS]} | {counts[claims.FAILS]} | "
              f"{counts[claims.DEPENDS]} |")


if __name__ == "__main__":
    main()
