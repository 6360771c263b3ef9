"""Claims files: what is refused, how rows are judged, and what the command says of them."""

import json

import pytest
from typer.testing import CliRunner

from flight_graph.claims import claim_runs, claims, claims_file
from flight_graph.claims.claim_expressions import Several
from flight_graph.claims.claim_runs import RunEntry
from flight_graph.cli.app import app
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load

TEXT = """
title: A paper
source: nowhere
runs:
  plain: {scenario: cubli_asteroid}
  each: {scenario: cubli_gains, cases: [case 1, case 2]}
claims:
  - {id: one, statement: paper, quote: the error is small, where: eq. (1), says: x is small, value: plain.x,
     relation: {below: 2}, expect: holds, because: it is,
     flip: {change: more gain, to: does not hold, set: {controller.lambda_a: 0.05}}}
  - {id: two, statement: ours, where: eq. (2), says: x is small, values: {here: plain.x, there: each.x},
     relation: {below: 2}, expect: depends, estimated: plain.y, estimated_expect: does not hold, because: it varies,
     flip: {change: the other, to: holds, instead: {each: plain}}}
"""
FOUND = {"plain": {"x": 1.0, "y": 3.0}, "each": Several({"case 1": {"x": 1.5}, "case 2": {"x": 2.5}})}


@pytest.fixture
def paper(tmp_path, monkeypatch):
    """Write claims of a paper called 'test'."""
    def write(text):
        (tmp_path / "claims.yaml").write_text(text)
        monkeypatch.setattr(claims_file, "papers", lambda: {"test": tmp_path / "claims.yaml"})
        return "test"
    return write


@pytest.fixture
def made(monkeypatch):
    """Runs that cost nothing; the list of names asked for."""
    asked = []

    def run_all(entries, jobs, progress=None, kept=None):
        asked.extend(entries)
        return {name: FOUND[name] for name in entries}
    monkeypatch.setattr(claims, "run_all", run_all)
    return asked


def test_rows_are_judged(paper, made):
    one, two = claims.judge(paper(TEXT))
    assert (one.verdict, one.found, one.as_expected) == ("holds", {"": 1.0}, True)
    assert two.found == {"here": 1.0, "there, case 1": 1.5, "there, case 2": 2.5}
    assert two.met == {"here": True, "there, case 1": True, "there, case 2": False}
    assert (two.verdict, two.estimated_verdict, two.as_expected) == ("depends", "does not hold", True)
    assert json.dumps(two.plain("test"))


def test_a_run_with_estimated_state_alone_is_judged_by_what_was_found_there(paper):
    name = paper(TEXT.replace("estimated: plain.y", "estimated: other.y").replace(
        "  each:", "  other: {scenario: cubli_seeds}\n  each:"))
    row, = claims.judge_run(name, "cubli_seeds", {"y": 3.0})
    assert (row.claim.id, row.found, row.verdict) == ("two", {claims.ESTIMATED: 3.0}, "does not hold")
    assert row.as_expected


def test_only_the_runs_that_are_needed_are_made(paper, made):
    claims.judge(paper(TEXT), only=["one"])
    assert made == ["plain"]


@pytest.mark.parametrize(("old", "new"), [
    ("expect: holds", "expect: depends"), ("estimated_expect: does not hold", "estimated_expect: holds")])
def test_a_changed_verdict_is_marked_and_is_the_exit_status(paper, made, old, new):
    name = paper(TEXT.replace(old, new))
    assert sum(not row.as_expected for row in claims.judge(name)) == 1
    result = CliRunner().invoke(app, ["claims", name])
    assert result.exit_code == 1
    assert "changed" in result.output


def test_the_command_prints_rows_as_a_table_and_as_json(paper, made):
    name = paper(TEXT)
    shown = CliRunner().invoke(app, ["claims", name])
    assert shown.exit_code == 0 and "with estimated state" in shown.output.replace("\n", " ")
    rows = json.loads(CliRunner().invoke(app, ["claims", name, "--json"]).output)["claims"]
    assert [row["id"] for row in rows] == ["one", "two"]
    assert rows[1]["estimated_verdict"] == "does not hold"


@pytest.mark.parametrize("option", ["--figures", "--bags"])
def test_a_folder_that_cannot_be_made_is_refused_before_anything_runs(paper, made, tmp_path, option):
    name = paper(TEXT)
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(FlightError, match=f"{option} .*taken: this folder cannot be made"):
        CliRunner().invoke(app, ["claims", name, option, str(tmp_path / "taken")], catch_exceptions=False)
    assert made == []


def test_a_row_is_found_in_the_paper_that_has_it(paper, made, tmp_path, monkeypatch):
    """Without a paper's name, by its id alone."""
    name = paper(TEXT)
    other = tmp_path / "other.yaml"
    other.write_text(TEXT.replace("id: one", "id: three"))
    known = {"another": other, name: tmp_path / "claims.yaml"}
    monkeypatch.setattr(claims_file, "papers", lambda: known)
    monkeypatch.setattr("flight_graph.cli.claims.papers", lambda: known)
    found = json.loads(CliRunner().invoke(app, ["claims", "--only", "one", "--only", "two", "--json"]).output)["claims"]
    assert [(row["paper"], row["id"]) for row in found] == [("another", "two"), ("test", "one"), ("test", "two")]
    with pytest.raises(FlightError, match="papers: no claim called 'thre'; did you mean 'three'"):
        CliRunner().invoke(app, ["claims", "--only", "thre"], catch_exceptions=False)


def test_one_run_judges_the_rows_it_can(paper):
    rows = claims.judge_run(paper(TEXT), "cubli_asteroid", {"x": 1.0, "y": 1.0})
    assert [row.claim.id for row in rows] == ["one", "two"]
    assert (rows[1].found, rows[1].estimated, rows[1].estimated_verdict) == ({"here": 1.0}, 1.0, "holds")
    assert claims.judge_run("test", "cubli_gains", {"x": 1.0}) == []


def test_a_run_with_estimated_state_is_judged_on_all_that_the_row_says(paper):
    """A row of two values, of which one holds: the run that flies on the estimate may not be called one that holds."""
    text = TEXT.replace("plain: {scenario: cubli_asteroid}",
                        "plain: {scenario: cubli_asteroid_paper}\n  sensed: {scenario: cubli_asteroid}").replace(
        "estimated: plain.y, estimated_expect: does not hold", "estimated: {each: sensed.x, all: sensed.y}")
    [row] = claims.judge_run(paper(text), "cubli_asteroid", {"x": 1.0, "y": 3.0})
    assert row.found == {"with estimated state, each": 1.0, "with estimated state, all": 3.0}
    assert row.verdict == "depends" and row.as_expected
    full = claims.row(claims.read("test").claims[1], {**FOUND, "sensed": {"x": 1.0, "y": 3.0}})
    assert full.estimated == {"each": 1.0, "all": 3.0} and full.estimated_verdict == "depends" and full.as_expected


@pytest.mark.parametrize(("old", "new", "part"), [
    ("id: two", "id: one", "stands twice"),
    ("value: plain.x", "value: plane.x", "no run called 'plane'; did you mean 'plain'"),
    ("value: plain.x,\n", "\n", "either value or values"),
    ("{below: 2}, expect: holds", "{below: 2, above: 1}, expect: holds", "exactly one of below"),
    ("{below: 2}, expect: holds", "{under: 2}, expect: holds", "under"),
    ("expect: holds", "expect: maybe", "expect"),
    ("because: it is", "why: it is", "because|why"),
    ("{scenario: cubli_asteroid}", "{scenario: cubli_asteroid, case: 1, cases: all}", "either case or cases"),
    ("value: plain.x,\n     relation: {below: 2}", "check: 'a:b', relation: {below: 2}", "or a check"),
    ("cases: [case 1, case 2]", "cases: []", "at least 1 item"),
    ("value: plain.x,", "value: '1.0',", "every value of a claim is over 'run.metric'"),
    ("values: {here: plain.x, there: each.x}", "values: {}", "there is one at least"),
    ("quote: the error is small", "quote: '...'", "a quotation has words"),
    ("statement: paper", "statement: theirs", "'paper', 'implied' or 'ours'"),
    ("quote: the error is small, ", "", "quoted word for word"),
    ("statement: paper", "statement: ours", "one of ours is not"),
    (", set: {controller.lambda_a: 0.05}", "", "at least one of set, instead, arguments"),
    ("more gain, to: does not hold", "more gain, to: holds", "changes nothing: its verdict is 'holds'"),
    ("set: {controller.lambda_a: 0.05}", "arguments: {factor: 2}", "of values has set or instead"),
    ("instead: {each: plain}", "instead: {plane: plain}", "of the run plane, which the row's values do not need"),
    ("instead: {each: plain}", "instead: {each: plane}", "no run called 'plane'"),
    ("set: {controller.lambda_a: 0.05}", "set: {controller.lambda_a: 0.05}, of: [each]", "of the run each"),
    ("instead: {each: plain}", "instead: {each: plain}, of: [each]", "'of' names the runs"),
])
def test_bad_files_are_refused_with_a_sentence(paper, old, new, part):
    assert old in TEXT
    with pytest.raises(FlightError, match=part):
        claims.read(paper(TEXT.replace(old, new, 1)))


def test_unknown_papers_rows_and_figures_are_named(paper, made):
    with pytest.raises(FlightError, match="no paper called 'apc'"):
        claims.read("apc")
    with pytest.raises(FlightError, match="no claim called 'on'"):
        claims.judge(paper(TEXT), only=["on"])


@pytest.mark.parametrize(("data", "part"), [
    ({"scenario": "cubli_gains", "case": "case 9"}, "no case called 'case 9'"),
    ({"scenario": "cubli_asteroid", "case": 1}, "no 'vary' block"),
    ({"scenario": "cubli_gains", "case": 99}, "no case 99"),
    ({"scenario": "cubli_disturbances", "case": "in phase"}, "8 cases of the grid"),
    ({"scenario": "cubli_gains", "case": "case 2", "set": {"controller.lambda_a": 0.03}}, "cannot be set"),
])
def test_runs_that_cannot_be_made_are_refused(data, part):
    with pytest.raises(FlightError, match=part):
        RunEntry(**data).scenarios()


def test_cases_are_called_by_name_and_grid():
    made = RunEntry(scenario="cubli_disturbances", cases=[0, 15]).scenarios()
    assert list(made) == ["in phase, gravity_sign 1, disturbance_frequency 0.1",
                          "120 degrees apart, gravity_sign -1, disturbance_frequency 2"]


def test_runs_that_are_the_same_are_made_once():
    first = RunEntry(scenario="cubli_gains", case="case 1").scenarios()[""]
    same = RunEntry(scenario="cubli_boundaries", case=0).scenarios()[""]
    assert claim_runs.identity(first) == claim_runs.identity(same)
    assert claim_runs.identity(first) != claim_runs.identity(load("cubli_gains", {"duration_s": 10}, 0))


def test_a_run_that_stops_says_so():
    found = claim_runs.run_one(RunEntry(scenario="cubli_gains", case="lambda 0.05").scenarios()[""])
    assert found["stopped"] is True and found["stopped_s"] == 0.0
    assert "take a lambda_a below" in found["sentence"]
