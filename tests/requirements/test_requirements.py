"""Requirements: what a campaign shows, what a check leaves behind, and a sentence for everything that is wrong."""

import csv
import json
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

from flight_graph.claims.relation import Relation
from flight_graph.components.foreign import agree, refuse
from flight_graph.graphs import metrics
from flight_graph.recordings.recording import open_run
from flight_graph.requirements import checking, requirements_file
from flight_graph.requirements.evidence import MET, NOT_MET, NOT_SHOWN, of_campaign
from flight_graph.requirements.requirements_file import CampaignEntry, Requirement, Showing
from tests.commands import runner
from tests.graph import toy

DRAWN = {"random": {"plant.angle": {"uniform": [-0.5, 0.5], "size": 3}}, "runs": 5, "seed": 3}
SWING = {"scenario": "swing.yaml"}
REQUIREMENTS = [
    {"id": "SWING-1", "text": "Angles stay below half a radian.", "metric": "angle_max", "limit": {"at_most": 0.5}, "unit": "rad",
     "shown_by": [{"run": SWING}, {"campaign": {**SWING, "runs": 12, "share": 0.8, "confidence": 0.9}}]},
    {"id": "SWING-2", "text": "It comes to rest.", "metric": "quiet_s", "limit": {"below": 1.0}, "shown_by": [{"run": SWING}]},
    {"id": "SWING-3", "text": "It does not swing | over.", "metric": "swings", "limit": {"is": False}, "waived": "It is a toy.",
     "shown_by": [{"run": {**SWING, "set": {"duration_s": 5.0}}}]},
    {"id": "SWING-4", "text": "Angles stay small.", "metric": "angle_max", "limit": {"at_most": 0.3001},
     "shown_by": [{"campaign": {**SWING, "runs": 12, "share": 0.5, "confidence": 0.9}}]},
]


def shown(kept, runs, share, confidence, missing=0):
    """The verdict on so many runs that keep a limit."""
    requirement = Requirement(id="R", text="text", metric="m", limit=Relation(at_most=1.0), shown_by=[Showing(
        campaign=CampaignEntry(scenario="s", runs=runs, share=share, confidence=confidence))])
    found = [(case, True, 0.5 if case < kept else None if case < kept + missing else 2.0) for case in range(runs)]
    return of_campaign(requirement, requirement.shown_by[0], found, 1, str)


@pytest.mark.parametrize("runs, failures, share, confidence", [  # sizes of S. S. Wilks and of later tables of success runs
    (59, 0, 0.95, 0.95), (93, 1, 0.95, 0.95), (124, 2, 0.95, 0.95), (230, 0, 0.99, 0.90), (22, 0, 0.90, 0.90),
    (473, 1, 0.99, 0.95)])
def test_how_many_runs_show_a_share(runs, failures, share, confidence):
    assert shown(runs - failures, runs, share, confidence).verdict == MET
    assert shown(runs - 1 - failures, runs - 1, share, confidence).verdict == NOT_SHOWN


def test_runs_that_fail_or_have_no_number_count_against_it():
    assert shown(10, 100, 0.95, 0.9).verdict == NOT_MET
    one = shown(99, 100, 0.9, 0.9, missing=1)
    assert "99 of 100 runs keep it" in one.found and "1 have no m" in one.found and one.worst == "99"


@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """Run a command in a folder with a scenario, its requirements and nothing else; (status, output, errors)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    data = toy.scenario(metrics="tests.requirements.swing_metrics:compute", duration_s=1.0)
    (tmp_path / "swing.yaml").write_text(yaml.safe_dump({**data, "vary": DRAWN}))

    return runner(monkeypatch, capsys)


def written(folder, requirements):
    (folder / "needs.yaml").write_text(yaml.safe_dump({"title": "Toy", "requirements": requirements}))
    return folder / "needs.yaml"


def test_a_check_leaves_verdicts_junit_and_the_trace_to_bags(flight, tmp_path):
    status, out, err = flight("check", written(tmp_path, REQUIREMENTS), "--trust", "--out", "checked", "--json")
    assert out, err
    found = json.loads(out)
    verdicts = {one["id"]: one["verdict"] for one in found["requirements"]}
    assert verdicts == {"SWING-1": MET, "SWING-2": NOT_MET, "SWING-3": NOT_MET, "SWING-4": NOT_MET}
    assert status == 1 and not found["passed"]
    root = ElementTree.parse("checked/junit.xml").getroot()
    assert {key: root.get(key) for key in ("tests", "failures", "skipped", "errors")} == {
        "tests": "5", "failures": "2", "skipped": "1", "errors": "0"}
    assert [len(root.findall(f".//{kind}")) for kind in ("testcase", "failure", "skipped")] == [5, 2, 1]
    rows = list(csv.DictReader(open("checked/trace.csv", encoding="utf-8")))
    assert [row["requirement"] for row in rows] == ["SWING-1", "SWING-1", "SWING-2", "SWING-3", "SWING-4"]
    for row in rows:
        assert (tmp_path / "checked" / row["bag"] / "metadata.yaml").is_file()
    _, scenario, signals = open_run(tmp_path / "checked" / rows[1]["bag"], trust=True)  # the campaign's worst case
    worst = found["requirements"][0]["shown_by"][1]
    assert metrics.compute(scenario, signals)["angle_max"] == worst["values"][worst["worst"]]
    page = (tmp_path / "checked/requirements.md").read_text()
    assert "It does not swing \\| over." in page and "waived: It is a toy." in page and "## Trace matrix" in page


def test_what_is_met_and_what_is_waived_in_vain(flight, tmp_path):
    path = written(tmp_path, REQUIREMENTS)
    status, out, _ = flight("check", path, "--trust", "--only", "SWING-3", "--only", "SWING-1", "--out", "one")
    assert status == 0 and "not met (waived)" in out and "82.54" in out  # of 12 runs, 0.1^(1/12)
    path = written(tmp_path, [{**REQUIREMENTS[0], "waived": "for nothing", "shown_by": [{"run": SWING}]}])
    status, out, err = flight("check", path, "--trust", "--out", "two")
    assert status == 1 and "waived for nothing" in out and "not as their file says: SWING-1" in err


@pytest.mark.parametrize("change, sentence", [
    ({"metric": "angel_max"}, "no metric called 'angel_max'; did you mean 'angle_max'"),
    ({"unit": "deg"}, "unit: 'angle_max' is in rad, not in deg"),
    ({"limit": {"is": True}}, "'angle_max' is a number, so 'is True' cannot hold of it"),
    ({"metric": "swings", "unit": None}, "'swings' is true or false, so '<= 0.5' cannot hold of it; allowed: is: true or false"),
    ({"limit": {"at_most": 0.5, "below": 1}}, "requirements.0.limit (SWING-1): a relation has exactly one of below"),
    ({"limit": {"at_most": ".inf"}}, "limit"),
    ({"limits": 3}, "requirements.0.limits (SWING-1): there is no such key; allowed: id, text, because"),
    ({"shown_by": []}, "shown_by"),
    ({"shown_by": [{"run": {"scenario": "swang.yaml"}}]}, "there is no scenario file"),
    ({"shown_by": [{"run": {"scenario": "swing.yaml", "case": "fast"}}]}, "no case called 'fast'"),
    ({"shown_by": [{"campaign": {**SWING, "runs": 12, "share": 1.0, "confidence": 0.9}}]}, "share"),
    ({"shown_by": [{"campaign": {"scenario": "cubli_asteroid", "runs": 9, "share": 0.5, "confidence": 0.9}}]},
     "a campaign draws at random, and this scenario has no 'vary' block that does"),
    ({"shown_by": [{"campaign": {**SWING, "vary": {**DRAWN, "sampling": "sobol"}, "runs": 9, "share": 0.5, "confidence": 0.9}}]},
     "needs independent draws, and vary.sampling is sobol"),
])
def test_what_is_wrong_is_told_before_anything_runs(flight, tmp_path, change, sentence):
    path = written(tmp_path, [{**REQUIREMENTS[0], **change}])
    status, _, err = flight("check", path, "--trust", "--out", "checked")
    assert status == 2 and sentence.lower() in err.lower(), err
    assert not (tmp_path / "checked").exists()


def test_other_mistakes(flight, tmp_path):
    twice = flight("check", written(tmp_path, [REQUIREMENTS[0]] * 2), "--trust")
    assert twice[0] == 2 and "the id SWING-1 stands twice" in twice[2]
    assert "this is a scenario, not requirements" in flight("check", "swing.yaml")[2]
    assert "names code that does not come with the packages" in flight("check", written(tmp_path, REQUIREMENTS))[2]
    assert "no requirement called 'SWING-9'" in flight("check", "needs.yaml", "--only", "SWING-9")[2]
    assert "--out and --only go with requirements" in flight("check", "cubli_ros/appc_controller", "--out", "x")[2]
    (tmp_path / "there").mkdir()
    assert "it exists already" in flight("check", "needs.yaml", "--trust", "--out", "there")[2]


@pytest.mark.parametrize("vehicle", requirements_file.available())
def test_the_requirements_of_the_packages_are_valid(vehicle):
    content, path = requirements_file.read(vehicle)
    needs = checking.needs(content.requirements, refuse)
    assert len(needs) == sum(len(one.shown_by) for one in content.requirements) and path.suffix == ".yaml"
    assert checking.needs(content.requirements[:1], agree)[0].unit
