"""The topics of a scenario as a table: types, rates, frames, and where each named number stands in its array.

A named vector travels as a sensor_msgs/JointState, whose names viewers leave out: they plot `/cubli/funnel.position[6]`.
"""

import json

from flight_graph.cli.show import add, console


def topic_rows(scenario) -> list[dict]:
    """One row a topic: topic, type, rate_hz (None: once), frame, doc, and its ``numbers``: path, label, unit, meaning."""
    rows = []
    for node, port, signal in scenario.graph.outputs():
        rate_hz = 1e9 / node.output_period_ns(port)
        rows.append({"topic": f"/{signal.topic}", "type": signal.type_name, "rate_hz": rate_hz, "doc": signal.doc,
                     "frame": signal.fixed.get("header.frame_id", ""), "numbers": list(_numbers(signal))})
        rows += [{"topic": f"/{made.topic}", "type": made.type_name, "rate_hz": None if made.once else rate_hz,
                  "frame": "", "doc": (made.function.__doc__ or "").strip().partition("\n")[0], "numbers": []}
                 for made in node.component.formatted if made.port == port]
    return rows


def show_topics(name: str, consent, as_json: bool) -> None:
    """Print the topics of a scenario. consent: as for `flight_graph.graphs.scenario.load`."""
    from flight_graph.graphs.scenario import load
    rows = topic_rows(load(name, consent=consent))
    if as_json:
        print(json.dumps(rows))
        return
    from rich.table import Table
    table = Table("topic", "type", "rate [Hz]", "frame", "what it carries")
    for row in rows:
        add(table, row["topic"], row["type"], "once" if row["rate_hz"] is None else f"{row['rate_hz']:g}", row["frame"],
            row["doc"])
    console.print(table)
    table = Table("path", "number", "unit", "meaning")
    for row in rows:
        for number in row["numbers"]:
            add(table, f"{row['topic']}.{number['path']}", number["label"], number["unit"], number["meaning"])
    console.print(table)


def _numbers(signal):
    """Every entry of the signal's named quantities, with its own name where the signal has one for it."""
    for path, indices, name, quantity in signal.columns():
        for k, index in enumerate(indices):
            own = signal.fixed["name"][index]
            plain = name if quantity.length is None else f"{name}[{k}]"
            label = own if own == plain else f"{name} {own}"
            yield {"path": f"{path}[{index}]", "label": label, "unit": quantity.unit, "meaning": quantity.doc}
