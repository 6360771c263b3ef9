"""The parts of a campaign's page, from its numbers (`flight_graph.campaigns.report`): figures, tables and sentences."""

import numpy as np
from plotly import graph_objects

from flight_graph.campaigns import report as numbers
from flight_graph.errors import FlightError
from flight_graph.graphs.metric_entry import FLAG
from flight_graph.reports import distributions, histories
from flight_graph.reports import relations as points
from flight_graph.reports.page import Figure, Table, safe

MOST_METRICS = 10  # that are drawn
MOST_GROUPS = 6  # in one drawing
MOST_MATRIX = 3  # inputs, and metrics, in the matrix of scatter plots
MOST_BARS = 12
MOST_RATES = 40
RATE = ("rate", "low", "high", "successes", "runs")
MOST_WORST_FLOWN = 60
SUCCESS = ("success", "is_safe")  # the flags that colour points, the first that there is


def text(value) -> str:
    """A number for a person."""
    if value is None:
        return "none"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def overview(about) -> list:
    """What was run, what came of it, and what the numbers are not."""
    found, manifest = about.found, about.campaign.manifest
    made = manifest.made_with or {}
    rows = [["scenario", f"{manifest.name}: {manifest.scenario.get('title', '')}"],
            ["runs", f"{found['rows']} of {found['wanted']}"],
            ["how they ended", ", ".join(f"{count} {name}" for name, count in found["statuses"].items())],
            ["varied", ", ".join(column.name for column in about.values.columns.values() if column.kind == "parameter")],
            ["draws", f"{found['plan']}, seed {about.values.vary.file.seed}"],
            ["groups", str(len(found["groups"]))],
            ["made with", ", ".join(f"{name} {value}" for name, value in made.items())]]
    if manifest.set_by_hand:
        rows.append(["set by hand", ", ".join(f"{key} {value}" for key, value in manifest.set_by_hand.items())])
    if found["ended"]:
        rows.append(["ended by", str(found["ended"].get("sentence", ""))])
    notes = [*found["notes"]]
    if about.why:
        notes.append(f"Meanings, lines over time and the ground are left out: {about.why}")
    if len(found["groups"]) > MOST_GROUPS:
        notes.append(f"Drawings show the first {MOST_GROUPS} of {len(found['groups'])} groups; tables have all.")
    return [Table("What was run", ["", ""], rows), *notes]


def success(about) -> list:
    """Rates of all that is true or false; drawn are, of many, the lowest of what is declared to matter."""
    names = dict.fromkeys(row["metric"] for group in about.found["groups"] for row in group["rates"])
    flags = {name: about.glossary.entry(name) for name in names}
    flags = {name: entry for name, entry in flags.items() if entry.kind == FLAG or name not in about.glossary.metrics}
    rows = [{"name": _named(name, group), "headline": flags[name].headline, **{key: row[key] for key in RATE}}
            for name in flags for group in about.found["groups"] for row in group["rates"] if row["metric"] == name]
    if not rows:
        return []
    drawn = rows
    if len(rows) > MOST_RATES:
        drawn = sorted([row for row in rows if row["headline"]] or rows, key=lambda row: row["rate"])[:MOST_RATES]
    shown = [[row["name"], f"{row['successes']} of {row['runs']}", text(row["rate"]), text(row["low"]), text(row["high"])]
             for row in rows]
    head = ["metric", "runs", "rate", "at least", "at most"]
    title = f"The lowest {len(drawn)} of {len(rows)} rates" if len(rows) > MOST_RATES else "Rates"
    return [distributions.rates(title, drawn, about.choices.confidence), Table("Rates and their intervals", head, shown)]


def _named(name, group) -> str:
    return name if group["group"] is None else f"{name}: {group['group']}"


def dispersions(about) -> list:
    """Histogram and distribution of each headline."""
    found = []
    for name in about.headlines:
        column = about.column(name)
        groups = {group.label or "all runs": column[group.rows & np.isfinite(column)]
                  for group in about.values.groups[:MOST_GROUPS]}
        entry = about.glossary.entry(name)
        rows = [row for group in about.found["groups"] for row in group["metrics"] if row["metric"] == name]
        without, odd = sum(row["without"] for row in rows), sum(row["not_a_number"] for row in rows)
        words = [entry.meaning] if entry.meaning else []
        if without:
            words.append(f"{without} runs have none" + (f" ({entry.missing})" if entry.missing else ""))
        if odd:
            words.append(f"in {odd} runs it is no number")
        words.append(f"band of the whole distribution with {100.0 * about.choices.confidence:g} % confidence")
        if any(len(values) for values in groups.values()):
            found.append(distributions.dispersion(name, about.label(name), groups, about.choices.confidence,
                                                  "; ".join(words) + "."))
    return found


def all_metrics(about) -> list:
    """Every number with its percentiles, by group; of many groups the headlines alone, a table each."""
    if len(about.found["groups"]) > MOST_GROUPS:
        return [_by_group(about, name) for name in about.headlines]
    share = 100.0 * about.choices.share
    head = ["metric", "unit", "meaning", "values", "none", "no number", "least", "case", *(
        f"{100.0 * one:g} %" for one in numbers.SHARES), "largest", "case",
        f"{share:.10g} % are below"]
    found = []
    for group in about.found["groups"]:
        rows = []
        for row in group["metrics"]:
            least, largest = ([text(row.get(key)) for key in (end, f"{end}_case")] for end in ("least", "largest"))
            bound, meaning = row["upper"], about.glossary.entry(row["metric"]).meaning
            rows.append([row["metric"], row["unit"], meaning, row["values"], row["without"], row["not_a_number"], *least,
                         *(_percentile(one) for one in row["percentiles"]), *largest,
                         text(bound["value"]) if bound["value"] is not None else f"needs {bound['needed']} runs"])
        found.append(Table(group["group"] or "All runs", head, rows, (
            f"Percentiles with intervals of {100.0 * about.choices.confidence:g} % confidence that no distribution is "
            f"assumed for; last column: with {100.0 * about.choices.share_confidence:g} % confidence.")))
        words = [[row["metric"], ", ".join(f"{name} {count}" for name, count in row["counts"].items())]
                 for row in group["texts"]]
        if words:
            found.append(Table("Words", ["metric", "runs"], words))
    return found


def _by_group(about, name) -> Table:
    """A metric in each group."""
    rows = [[group["group"], row["values"], row["without"], row["not_a_number"], text(row.get("least")),
             *(_percentile(one) for one in row["percentiles"]), text(row.get("largest"))]
            for group in about.found["groups"] for row in group["metrics"] if row["metric"] == name]
    head = ["group", "values", "none", "no number", "least", *(f"{100.0 * one:g} %" for one in numbers.SHARES), "largest"]
    return Table(about.label(name), head, rows, about.glossary.entry(name).meaning)


def _percentile(one) -> str:
    ends = [text(one[key]) if one[key] is not None else "-" for key in ("low", "high")]
    return f"{text(one['value'])} ({ends[0]} to {ends[1]})"


def relations(about) -> list:
    """The matrix of scatter plots of what matters: the headlines, and the draws that decide most of them."""
    if len(about.values.groups) > 1 or len(about.headlines) < 2:
        return []
    metrics = about.headlines[:MOST_MATRIX]
    inputs, weight = about.values.inputs()[0], {}
    for name in metrics:
        for row in about.sensitivities(name)[0]["rank_correlations"] if inputs else ():
            weight[row["key"]] = max(weight.get(row["key"], 0.0), abs(row["value"] or 0.0))
    keys = sorted(weight, key=lambda key: -weight[key])[:MOST_MATRIX]
    columns = {**{key: inputs[key] for key in keys}, **{name: about.column(name) for name in metrics}}
    finite = np.isfinite(np.stack(list(columns.values()))).all(axis=0)
    rows = np.flatnonzero(finite & about.values.groups[0].rows)
    if len(rows) < 3:
        return []
    extremes = np.concatenate([[column[rows].argmin(), column[rows].argmax()] for column in columns.values()])
    shown = rows[points.chosen(len(rows), points.MOST_POINTS, extremes)]
    words = (f"The first metrics, and the draws that rank highest with them. {len(shown)} of {len(about.values.cases)} "
             "runs are drawn, the ends of each column among them.")
    drawn = {about.label(name): column[shown] for name, column in columns.items()}
    return [points.scatter_matrix("What hangs together", drawn, good(about)[shown], about.values.cases[shown], words)]


def good(about) -> np.ndarray:
    """Which runs were a success (n,): by the flag that says so, else all that ended well."""
    for name in SUCCESS:
        if name in about.values.metrics:
            return about.column(name) == 1
    return about.values.ok.copy()


def sensitivities(about) -> list:
    """Of each headline what of the draws decides it: rank correlations, of a design of Saltelli its Sobol indices."""
    found = []
    for name in about.headlines:
        try:
            groups = about.sensitivities(name)
        except FlightError as error:
            return [str(error)] if not found else found
        for group in groups[:MOST_GROUPS]:
            found += _bars(_named(name, group), group)
    return found


def _bars(title, group) -> list:
    if group["sobol"] and group["sobol"]["factors"]:
        factors = sorted(group["sobol"]["factors"], key=lambda one: -one["total"])[:MOST_BARS]
        rows = [{"name": one["factor"], "series": series, "value": one[key], "low": one[f"{key}_low"],
                 "high": one[f"{key}_high"]}
                for one in factors for series, key in (("first order", "first"), ("total", "total"))]
        return [distributions.bars(title, "share of the variance (Sobol index)", rows, (-0.1, 1.1))]
    ranked = [row for row in group["rank_correlations"] if row["value"] is not None]
    if not ranked:
        return []
    part = "partial" if all(row["partial"] is not None for row in ranked) else "value"
    ends = ("partial_low", "partial_high") if part == "partial" else ("low", "high")
    ranked.sort(key=lambda row: -abs(row[part]))
    rows = [{"name": row["key"], "series": "", "value": row[part], "low": row[ends[0]], "high": row[ends[1]]}
            for row in ranked[:MOST_BARS]]
    words = f"The {MOST_BARS} largest of {len(ranked)}." if len(ranked) > MOST_BARS else ""
    label = f"{'partial ' if part == 'partial' else ''}rank correlation"
    return [distributions.bars(title, label, rows, (-1.02, 1.02), words)]


def landings(about) -> list:
    """Where runs came down, of each group."""
    place = about.glossary.landing
    if place is None or place.x not in about.values.metrics or place.y not in about.values.metrics:
        return []
    columns, success = np.stack([about.column(place.x), about.column(place.y)], axis=1), good(about)
    found = []
    for group in about.values.groups[:MOST_GROUPS]:
        rows = group.rows & np.isfinite(columns).all(axis=1)
        if not rows.any():
            continue
        title = "Landing points" + (f": {group.label}" if group.label else "")
        drawn = points.landing(title, columns[rows], about.values.cases[rows], success[rows],
                               (about.label(place.x), about.label(place.y)),
                               lambda x, y: place.terrain(about.scenario, x, y))
        drawn.text += f" {int((group.rows & ~rows).sum())} of {int(group.rows.sum())} runs did not come down."
        found.append(drawn)
    return found


def funnels(about, flown, wanted) -> list:
    """Percentiles over time of the first cases."""
    if flown is None:
        return []
    first = [flown.row(case) for case in about.values.cases[:wanted].tolist()]
    together = ", all groups together" if len(about.values.groups) > 1 else ""
    return [histories.funnel(trace.name, f"{trace.name} [{trace.unit}]", flown.t, flown.values[trace.name][first],
                             f"{trace.meaning}; the first {len(first)} cases, run again{together}.")
            for trace in about.glossary.traces if trace.name in flown.values
            and np.isfinite(flown.values[trace.name][first]).any()]


def worst_cases(about, listed, flown) -> list:
    """Of each headline its worst cases, and their lines over time."""
    rows, shown = [], {}
    for entry in listed:
        for group in entry["groups"]:
            cases = ", ".join(f"{row['case']}: {text(row['value'])}" for row in group["cases"])
            absent = f"{group['without']}, first: {', '.join(map(str, group['first_without']))}" if group["without"] else ""
            rows.append([_named(entry["metric"], group), "smallest" if entry["smallest"] else "largest", cases, absent])
        shown[entry["metric"]] = [row["case"] for row in entry["groups"][0]["cases"]]
    if not rows:
        return []
    folder = about.campaign.path
    found = [Table("Worst cases", ["metric", "worst are the", "case: value", "cases without"], rows,
                   f"Each is run again to a full bag, bit for bit: flight run {folder} --case NUMBER.")]
    for trace in about.glossary.traces if flown is not None else ():
        if trace.name not in flown.values:
            continue
        cases = list(dict.fromkeys(case for one in shown.values() for case in one[:1]))
        named = {f"case {case} (worst {', '.join(name for name, one in shown.items() if one[:1] == [case])})":
                 flown.values[trace.name][flown.row(case)] for case in cases if case in flown.cases}
        if named:
            found.append(histories.lines(f"Worst cases: {trace.name}", f"{trace.name} [{trace.unit}]", flown.t, named))
    return found


def faults(rows) -> list:
    """The table of faults and monitors, and in what share of its runs each actionpoint acted first."""
    if not rows:
        return []
    monitors = sorted({name for row in rows for name in row.by})
    columns = [*monitors, "missed", "blamed wrongly", "false alarm"]
    shares = [[*(row.by[name] / max(1, row.active) for name in monitors), row.missed / max(1, row.active),
               row.wrong / max(1, row.active), row.false_alarms / max(1, row.runs)] for row in rows]
    drawing = graph_objects.Figure(graph_objects.Heatmap(
        z=shares, x=[safe(name) for name in columns], y=[safe(row.name) for row in rows], zmin=0.0, zmax=1.0,
        colorscale="Blues", colorbar={"title": "share"}, xgap=1, ygap=1,
        hovertemplate="%{y}<br>%{x}: %{z:.3f}<extra></extra>"))
    drawing.update_yaxes(autorange="reversed", automargin=True, dtick=1)
    drawing.update_xaxes(side="top", automargin=True, tickangle=-45, dtick=1)
    data = {"fault": [row.name for row in rows]}
    data |= {name: [line[at] for line in shares] for at, name in enumerate(columns)}
    head = ["fault", "runs", "active", "detected", "missed", "isolated", "wrong", "false alarms", "stopped",
            "delay, median [s]", "first to act", "mode at the end"]
    table = []
    for row in rows:
        plain = row.plain()
        table.append([row.name, *(plain[key] for key in ("runs", "active", "detected", "missed", "isolated", "wrong",
                                                         "false_alarms", "stopped")), text(plain["median_delay_s"]),
                      *(", ".join(f"{name} {count}" for name, count in one.most_common()) for one in (row.by, row.modes))])
    return [Figure("Which actionpoint acts first", drawing, data, "Share of the runs of each fault.",
                   height=200 + 22 * len(rows)), Table("Faults and monitors", head, table)]
