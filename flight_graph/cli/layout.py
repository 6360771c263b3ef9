"""flight layout: a layout for Foxglove and Lichtblick whose plots have the names of the numbers.

One tab a topic of named numbers, one plot a unit in it, and a 3-D panel of the frames.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.topic_tables import topic_rows
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

MOST_LINES = 12  # of one plot; longer quantities (matrices) are left to the person


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight layout cubli_asteroid --out cubli_asteroid.json")(layout)


def layout(
    scenario: Annotated[str, typer.Argument(help="A scenario's name, or the path of a YAML file.")],
    out: Annotated[Path | None, typer.Option(help="A new file; standard output when left out.")] = None,
    trust: Trust = False,
) -> None:
    """Write a layout for Foxglove or Lichtblick (there: import layout) in which every named number has its name."""
    from flight_graph.graphs.scenario import load
    text = json.dumps(made(topic_rows(load(scenario, consent=asked(trust)))), indent=1)
    if out is None:
        print(text)
        return
    try:
        with out.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text + "\n")
    except OSError as error:
        raise FlightError(f"--out {out}: cannot be written ({(error.strerror or str(error)).lower()})") from None
    print(out)


def made(rows: list[dict]) -> dict:
    """The layout of topics as `flight_graph.cli.topic_tables.topic_rows` gives them."""
    panels, tabs = {"3D!frames": {"layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True}},
                                  "topics": {}, "transforms": {}}}, [{"title": "frames", "layout": "3D!frames"}]
    for row in rows:
        plots = []
        for unit, numbers in _by_unit(row["numbers"]):
            name = f"Plot!{row['topic'].strip('/').replace('/', '_')}{len(plots)}"
            panels[name] = _plot(f"{row['topic']} [{unit}]", row["topic"], numbers)
            plots.append(name)
        if plots:
            tabs.append({"title": row["topic"].strip("/"), "layout": _column(plots)})
    panels["Tab!topics"] = {"activeTabIdx": 0, "tabs": tabs}
    return {"configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1},
            "layout": "Tab!topics"}


def _by_unit(numbers) -> list[tuple[str, list[dict]]]:
    """(unit, numbers of one plot) in their order. Quantities that are longer than one plot are left out."""
    lengths = Counter(_quantity(number) for number in numbers)
    found = []
    for number in numbers:
        if lengths[_quantity(number)] > MOST_LINES:
            continue
        plot = next((lines for unit, lines in found if unit == number["unit"] and len(lines) < MOST_LINES), None)
        if plot is None:
            found.append((number["unit"], plot := []))
        plot.append(number)
    return found


def _quantity(number) -> str:
    return number["label"].partition("[")[0].partition(" ")[0]


def _plot(title, topic, numbers):
    paths = [{"value": f"{topic}.{number['path']}", "label": number["label"], "enabled": True,
              "timestampMethod": "headerStamp"} for number in numbers]
    return {"title": title, "paths": paths, "showXAxisLabels": True, "showYAxisLabels": True, "showLegend": True,
            "legendDisplay": "left", "showPlotValuesInLegend": True, "isSynced": True, "xAxisVal": "timestamp"}


def _column(names):
    """Panels below each other, each of the same height."""
    if len(names) == 1:
        return names[0]
    return {"direction": "column", "first": names[0], "second": _column(names[1:]), "splitPercentage": 100 / len(names)}
