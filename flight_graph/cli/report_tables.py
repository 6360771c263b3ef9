"""The tables of `flight report`, from the data of `flight_graph.campaigns.report`."""

from rich.table import Table
from rich.text import Text

from flight_graph.cli.show import add
from flight_graph.text_files import printable

MOST_ROWS = 60  # of a table on a terminal; --json has all


def overview_tables(found: dict):
    """What the campaign is, its rates, its percentiles, its texts, and what the numbers are not."""
    ends = ", ".join(f"{count} {status}" for status, count in found["statuses"].items())
    yield f"{found['scenario']}: {found['rows']} of {found['wanted']} runs ({ends}), draws: {found['plan']}"
    if found["ended"]:
        yield found["ended"]["sentence"]
    groups = found["groups"]
    level = f"{100 * found['confidence']:g} %"
    bound = f"{100 * found['share']:.10g} % / {100 * found['share_confidence']:g} %"
    rows = [(_of(group), _named(one), one["successes"], one["runs"], _short(one["rate"]), _short(one["low"]),
             _short(one["high"]), one["without"] or "") for group in groups for one in group["rates"]]
    yield from _table(rows, f"rates, with {level} intervals (Clopper-Pearson)",
                      "group", "metric", "successes", "runs", "rate", "from", "to", "without")
    rows = [(_of(group), _named(one), _short(one.get("least")), _case(one, "least"), *map(_interval, one["percentiles"]),
             _short(one.get("largest")), _case(one, "largest"), _bound(one["upper"]), _missing(one))
            for group in groups for one in group["metrics"]]
    yield from _table(rows, f"percentiles, with {level} intervals (order statistics); last: {bound} upper bound",
                      "group", "metric", "least", "case", "5 %", "median", "95 %", "largest", "case", bound, "without")
    rows = [(_of(group), _named(one), ", ".join(f"{text} {count}" for text, count in one["counts"].items()),
             one["without"] or "") for group in groups for one in group["texts"]]
    yield from _table(rows, "texts", "group", "metric", "how often", "without")
    if any(one["upper"]["value"] is None for group in groups for one in group["metrics"]):
        few = min((one["upper"] for group in groups for one in group["metrics"]), key=lambda limit: limit["runs"])
        yield few["sentence"]
    for note in found["notes"]:
        yield f"note: {note}"


def sensitivity_tables(groups: list[dict]):
    """Rank correlations, and Sobol indices where the design has them."""
    for entry in groups:
        where = f"{entry['metric']}{' (' + entry['group'] + ')' if entry['group'] else ''}"
        if entry["sobol"]:
            found = entry["sobol"]
            rows = [(one["factor"], *(_short(one[key]) for key in ("first", "first_low", "first_high", "total", "total_low",
                                                                  "total_high"))) for one in found["factors"]]
            yield from _table(rows, f"{where}: shares of the variance, of {found['samples']} base samples",
                              "factor", "alone", "from", "to", "in all", "from", "to")
            if not rows:
                yield f"{where}: no Sobol indices: it does not vary, or no base sample is whole"
            if found["left_out"]:
                yield f"note: {found['left_out']} base samples are left out: a row is not there, or has no finite value"
        ranked = entry["rank_correlations"]
        rows = [(one["key"], *(_short(one[key]) for key in ("value", "low", "high", "partial", "partial_low",
                                                           "partial_high")))
                for one in sorted(ranked, key=lambda one: -abs(one["value"] or 0.0))]
        yield from _table(rows, f"{where}: rank correlations (Spearman; partial: without what the others explain), "
                          f"of {ranked[0]['rows']} runs", "drawn", "rank", "from", "to", "partial", "from", "to")
        if ranked[0]["left_out"]:
            yield f"note: {ranked[0]['left_out']} runs are left out: they have no number"
        if entry["not_ranked"]:
            yield f"note: not ranked, being counted or no number: {', '.join(entry['not_ranked'])}"


def worst_tables(entry: dict, folder):
    """The worst cases of a metric, and how each is seen again."""
    word, name = "smallest" if entry["smallest"] else "largest", _named(entry)
    for group in entry["groups"]:
        title = f"{word} {name}{' (' + group['group'] + ')' if group['group'] else ''}"
        yield from _table([(one["case"], f"{one['value']:.6g}") for one in group["cases"]], title, "case", name)
        if group["without"]:
            first = ", ".join(map(str, group["first_without"]))
            yield f"note: {group['without']} runs have no finite {entry['metric']}; the first: {first}"
    yield f"any of them as a full bag, bit for bit: flight run {folder} --case NUMBER"


def comparison_tables(found: dict):
    """Differences case by case of two campaigns, or of groups of one."""
    level = f"{100 * found['confidence']:g} %"
    rows = [(_of(group), _named(one), one["pairs"], one["both"], one["only_a"], one["only_b"], _short(one["value"]),
             _short(one["low"]), _short(one["high"]), _short(one["probability"]))
            for group in found["groups"] for one in group["rates"]]
    yield (f"{found['other']} less {found['campaign']}, case by case" if "other" in found
           else f"groups of {found['campaign']} on the same draws, by {found['between']}")
    yield from _table(rows, f"rates (interval of Tango, {level}; last: McNemar's exact test)", "group", "metric", "pairs",
                      "both", "only first", "only second", "difference", "from", "to", "by chance")
    rows = [(_of(group), _named(one), one["pairs"], _short(one["mean"]), _short(one["mean_low"]), _short(one["mean_high"]),
             _short(one["median"]), _short(one["median_low"]), _short(one["median_high"]), one["larger"], one["smaller"],
             _unpaired(one))
            for group in found["groups"] for one in group["metrics"]]
    yield from _table(rows, f"differences, with {level} intervals (mean: Student, median: order statistics)", "group",
                      "metric", "pairs", "mean", "from", "to", "median", "from", "to", "larger", "smaller",
                      "only first, only second, none")
    if found.get("without_partner"):
        yield f"note: {found['without_partner']} runs have no partner"
    if found.get("only_here") or found.get("only_there"):
        yield f"note: {found['only_here']} runs of the first and {found['only_there']} of the second have no partner"
    if found["not_compared"]:
        yield f"note: not compared, being texts or in one campaign alone: {', '.join(found['not_compared'])}"


def _table(rows, title, *columns):
    if not rows:
        return
    shown = [number for number in range(len(columns)) if any(str(row[number]) != "" for row in rows)]
    table = Table(title=Text(printable(title), style="italic"), title_justify="left")
    for number in shown:
        table.add_column(Text(printable(columns[number])))
    for row in rows[:MOST_ROWS]:
        add(table, *(row[number] for number in shown))
    yield table
    if len(rows) > MOST_ROWS:
        yield f"and {len(rows) - MOST_ROWS} more rows (--metric picks, --json has all)"


def _of(group) -> str:
    return group["group"] or ""


def _named(one) -> str:
    return f"{one['metric']} [{one['unit']}]" if one.get("unit") else one["metric"]


def _short(value) -> str:
    return "-" if value is None else f"{value:.4g}"


def _interval(one) -> str:
    if one["value"] is None:
        return "-"
    ends = ("-" if one[end] is None else f"{one[end]:.4g}" for end in ("low", "high"))
    return f"{one['value']:.4g} [{', '.join(ends)}]"


def _bound(limit) -> str:
    return f"needs {limit['needed']}" if limit["value"] is None else _short(limit["value"])


def _case(one, end) -> str:
    return str(one[f"{end}_case"]) if f"{end}_case" in one else ""


def _unpaired(one) -> str:
    counts = [one[key] for key in ("only_a", "only_b", "neither")]
    return ", ".join(map(str, counts)) if any(counts) else ""


def _missing(one) -> str:
    words = [f"{one['without']}"] if one["without"] else []
    return " + ".join(words + [f"{one['not_a_number']} no number"] if one["not_a_number"] else words)
