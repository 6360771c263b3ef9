"""docs/faults.md: its tables are what the declarations say, its example flies, and its numbers are those of the runs."""

import re
from pathlib import Path

import pytest

from flight_graph import runs
from flight_graph.campaigns.cases import Cases
from flight_graph.campaigns.fault_table import fault_rows
from flight_graph.cli import fault_pages
from flight_graph.cli.show import number
from flight_graph.faults.fault_types import TYPES
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load

pytestmark = pytest.mark.xdist_group("faults")
PATH = Path(__file__).parents[2] / "docs/faults.md"
PAGE = PATH.read_text(encoding="utf-8")


def rows(text) -> dict:
    """First cell -> other cells, of the first table of a text."""
    table = re.search(r"(?m)(^\|.*\n)+", text)[0].splitlines()[2:]
    cells = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in table]
    return {first: rest for first, *rest in cells}


def test_tables_are_what_the_declarations_say():
    assert PAGE == fault_pages.filled(PAGE), "run: python -m flight_graph.cli.fault_pages docs/faults.md"
    for name, table in fault_pages.tables().items():
        assert "\n".join(table) in PAGE, name
    assert {name.removesuffix("` (event)") for name in rows(PAGE.partition("<!-- types -->")[2])} == TYPES.keys()


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    path = tmp_path_factory.mktemp("example") / "my_faults.yaml"
    path.write_text(re.search(r"(?s)<!-- example -->\n```yaml\n(.*?)```", PAGE)[1], encoding="utf-8")
    return load(str(path))


def test_the_run_of_the_example(example):
    found = metrics.compute(example, runs.simulate(example))
    said = rows(PAGE.partition("whether it blamed the right unit:")[2])
    assert said.keys() == found.keys()
    for name, value in found.items():
        assert said[name] == [number(value)], name


def test_the_sweep_of_the_example(example):
    cases = Cases(example)
    found = fault_rows(cases.rows(range(cases.vary.count)))
    said = rows(PAGE.partition("<!-- sweep -->")[2])
    assert list(said) == [row.name for row in found]
    for row in found:
        plain = row.plain()
        delay = number(plain["median_delay_s"])
        assert said[row.name] == [*(str(plain[key]) for key in ("active", "detected", "missed", "isolated", "false_alarms")), delay,
                                  ", ".join(f"{name} {count}" for name, count in row.by.most_common())], row.name
        assert plain["wrong"] == plain["stopped"] == 0 and plain["runs"] == 2
