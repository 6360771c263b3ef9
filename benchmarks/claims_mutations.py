"""The smallest change that flips each row of the claims tables, as a Markdown table.

    python benchmarks/claims_mutations.py [PAPER] [--steps 6] [--jobs 2]

Each row names a change under which its verdict is another one. Where the change is of real numbers, it is halved towards
the nominal values again and again, and the smallest share of it found that still flips the row is printed with the values
then (verdicts are taken to change once on the way). A change of names, switches and whole numbers has no smaller one.
"""

import argparse

from flight_graph.claims import flips
from flight_graph.claims.claims_file import read
from flight_graph.cli.show import number, steps
from flight_graph.graphs.papers import papers


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("paper", nargs="?", help="a paper; all when left out")
    options.add_argument("--steps", type=int, default=6, help="halvings")
    options.add_argument("--jobs", type=int, default=2, help="runs at a time")
    chosen = options.parse_args()
    for paper in [chosen.paper] if chosen.paper else sorted(papers()):
        content = read(paper)
        with steps(f"changes of {paper}", True) as advance:
            found = smallest(content, chosen.steps, chosen.jobs, advance)
        print(f"\n**{content.title}**\n\n| row | verdict | flipped by | smallest | verdict then |\n|---|---|---|---|---|")
        for one in found:
            claim = one.claim
            stays = "" if one.judged.verdict != claim.expect else " **not flipped**"
            print(f"| {claim.id} | {claim.expect} | {claim.flip.change} | {values(content, one)} | "
                  f"{one.judged.verdict}{stays} |")


def smallest(content, halvings, jobs, advance) -> list[flips.Flipped]:
    """Each row under the smallest share of its change that was found to flip it, by bisection, all rows side by side."""
    whole = flips.flip_rows(content, [(claim, 1.0) for claim in content.claims], jobs, advance)
    best = {one.claim.id: one for one in whole}
    low = {claim.id: 0.0 for claim in content.claims if flips.is_gradual(content, claim)
           and best[claim.id].judged.verdict != claim.expect}
    for _ in range(halvings):
        tried = [(claim, 0.5 * (low[claim.id] + best[claim.id].share)) for claim in content.claims if claim.id in low]
        for one in flips.flip_rows(content, tried, jobs, advance):
            if one.judged.verdict != one.claim.expect:
                best[one.claim.id] = one
            else:
                low[one.claim.id] = one.share
    return [best[claim.id] for claim in content.claims]


def values(content, one) -> str:
    """What was set, with the values of the smallest change."""
    claim, share = one.claim, one.share
    if claim.check is not None:
        return "; ".join(f"{name} {shown(value)}" for name, value in flips.changed_arguments(claim, share).items())
    said = [f"{name} is {other}" for name, other in claim.flip.instead.items()]
    if claim.flip.set:
        run = (claim.flip.of or sorted(claim.judged_runs - set(claim.flip.instead)))[0]
        made = flips.changed_run(content, claim, run, share).set
        said += [f"{path} {shown(made[path])}" for path in claim.flip.set]
    return "; ".join(said)


def shown(value) -> str:
    """A value; a vector of equal entries as one."""
    if isinstance(value, list):
        return shown(value[0]) if all(part == value[0] for part in value) else "/".join(map(shown, value))
    return number(value)


if __name__ == "__main__":
    main()
