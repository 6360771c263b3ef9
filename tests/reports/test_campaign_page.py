"""The page of a campaign: its numbers are the table's, and it draws in a real browser."""

import numpy as np
import pytest

from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import agree, refuse
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import vary_case
from flight_graph.reports import campaign_page, page
from tests.commands import runner
from tests.reports.browser import Browser
from tests.reports.campaigns import made


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return made(tmp_path_factory.mktemp("campaigns") / "toy")


@pytest.fixture(scope="module")
def sections(campaign):
    """Title of a section -> its parts."""
    return {section.title: section.parts for section in campaign_page.page(campaign, Choices(), agree, flights=25, worst=4)[2]}


def test_the_page_says_what_the_table_says(campaign, sections):
    assert list(sections) == ["Overview", "Success", "Dispersion", "All metrics", "Relations", "Sensitivities", "Over time",
                              "Worst cases"]
    table = campaign.read()
    angles = table.column("angle_max").to_numpy()
    rates = sections["Success"][0].columns
    assert rates["name"] == ["swings"] and rates["successes"] == [sum(table.column("swings").to_pylist())]
    histogram = sections["Dispersion"][0]
    assert sum(histogram.columns["runs"]) == len(angles) == 40 and "largest |angle| of any axis" in histogram.text
    row = next(row for row in sections["All metrics"][0].rows if row[0] == "angle_max")
    assert row[1] == "rad" and float(row[6]) == pytest.approx(angles.min(), rel=1e-4) and int(row[-2]) == angles.argmax()
    worst = sections["Worst cases"][0].rows[0]
    assert [int(text.split(":")[0]) for text in worst[2].split(", ")] == np.argsort(-angles)[:4].tolist()
    quiet = next(row for row in sections["All metrics"][0].rows if row[0] == "quiet_s")
    assert quiet[4] == table.column("quiet_s").null_count  # what is missing is counted


def test_lines_over_time_are_those_of_the_cases(campaign, sections):
    scenario = campaign.manifest.load(agree)
    flown = [np.abs(CompiledRun(vary_case(scenario, case)).run()["toy/truth"]["angle"]).max(axis=1) for case in range(25)]
    funnel = sections["Over time"][0].columns
    assert funnel["runs"][0] == 25 and funnel["largest"][0] == pytest.approx(max(run[0] for run in flown))
    assert funnel["median"][0] == pytest.approx(np.median([run[0] for run in flown]))
    lines = sections["Worst cases"][1].columns
    name = next(name for name in lines if name.startswith("case "))
    case = int(name.split()[1])
    assert lines[name][0] == pytest.approx(np.abs(campaign.row(case).varied["plant.angle"]).max())


def test_without_consent_no_code_runs_and_the_page_says_so(tmp_path):
    campaign = made(tmp_path / "toy", vary={"grid": {"plant.stiffness": [0.5, 1.0]}, **{"random": {"seed": {"count": 1}}},
                                            "runs": 6})
    sections = {one.title: one.parts for one in campaign_page.page(campaign, Choices(), refuse)[2]}
    assert any("left out" in part and "does not come with the packages" in part for part in sections["Overview"]
               if isinstance(part, str))
    assert "Over time" not in sections and "Relations" not in sections
    assert {"plant.stiffness 0.5", "plant.stiffness 1"} == set(sections["Dispersion"][0].columns["group"])


@pytest.fixture
def flight(monkeypatch, capsys):
    """Run a command; return (status, standard output, standard error)."""
    return runner(monkeypatch, capsys)


def test_the_command_writes_one_file(flight, campaign, tmp_path):
    path = tmp_path / "new" / "report.html"
    status, out, err = flight("report", campaign.path, "--html", path, "--flights", 0, "--trust", "--metric", "angle_max")
    assert (status, out.strip()) == (0, str(path)), err
    assert [one.name for one in path.parent.iterdir()] == ["report.html"]
    status, _, err = flight("report", campaign.path, "--html", tmp_path, "--flights", 0, "--trust")
    assert status == 2 and "cannot be written" in err


def test_the_page_draws_in_a_browser_and_asks_for_nothing(campaign, sections, tmp_path):
    text = page.rendered("Toy", "", [page.Section(title, parts) for title, parts in sections.items()])
    figures = sum(isinstance(part, page.Figure) for parts in sections.values() for part in parts)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with Browser(tmp_path / "page.html") as browser:
        browser.run("drawAll()")
        assert browser.bad == [] and browser.asked == 0  # no error, nothing against the policy, no file, no address
        assert browser.run("document.querySelectorAll('[data-drawn=yes] .main-svg').length") >= figures > 5
        header, first = browser.run("tableOf(1)").splitlines()[:2]
    assert header == "name,rate,low,high,successes,runs" and first.startswith("swings,")
