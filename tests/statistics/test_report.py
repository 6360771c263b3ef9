"""flight report: numbers against scipy on the same rows; groups, missing values and draws that are not independent are said."""

import json

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

from flight_graph.campaigns import paired
from flight_graph.campaigns import report as reports
from flight_graph.campaigns.folder import Campaign
from flight_graph.cli.app import app
from flight_graph.errors import FlightError
from flight_graph.graphs.vary import Vary
from tests.statistics.campaigns import MISS, miss, write
from tests.statistics.known import ISHIGAMI_FIRST, ishigami


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    here = tmp_path_factory.mktemp("campaigns")
    grid = {**MISS, "grid": {"p.g": [1, 2, 3]}, "runs": 200}
    return {"one": write(here / "one", MISS, miss()), "two": write(here / "two", MISS, miss(1.2), runs=390),
            "grid": write(here / "grid", grid, miss()), "other": write(here / "other", {**MISS, "seed": 5}, miss()),
            "sobol": write(here / "sobol", {**MISS, "sampling": "sobol"}, miss())}


@pytest.fixture(scope="module")
def truth():
    """Distance of each case, NaN where there is none; cases that stopped."""
    vary, judged = Vary(MISS, "toy"), miss()
    found = [judged(case, vary.overrides(case)) for case in range(400)]
    return np.array([metrics.get("lateral_m") or np.nan for _, metrics in found]), [status for status, _ in found].count("fault")


def asked(*words):
    result = CliRunner().invoke(app, ["report", *map(str, words)])
    assert result.exit_code == 0, result.output + str(result.exception)
    return result.output


def named(entries, metric):
    return next(one for one in entries if one["metric"] == metric)


def test_rates_and_percentiles_of_a_campaign(folders, truth):
    distances, stopped = truth
    found = json.loads(asked(folders["one"], "--json"))
    assert (found["rows"], found["wanted"], found["statuses"]) == (400, 400, {"fault": stopped, "ok": 400 - stopped})
    (group,) = found["groups"]
    rate = named(group["rates"], "landed")
    landed = stats.binomtest(rate["successes"], 400).proportion_ci(0.95)
    assert (rate["low"], rate["high"]) == pytest.approx(tuple(landed)) and rate["without"] == stopped and rate["runs"] == 400
    lateral = named(group["metrics"], "lateral_m")
    assert lateral["unit"] == "m" and lateral["values"] + lateral["without"] == 400 and lateral["not_a_number"] == 0
    assert lateral["percentiles"][1]["value"] == pytest.approx(np.nanmedian(distances))
    assert lateral["largest"] == np.nanmax(distances) and lateral["largest_case"] == np.nanargmax(distances)
    assert lateral["upper"]["value"] is None and lateral["upper"]["needed"] == 852
    speed = named(group["metrics"], "speed")
    assert speed["not_a_number"] == len([c for c in range(400) if c % 70 == 1 and c % 97 != 5]) and speed["without"] == stopped
    assert named(group["texts"], "mode")["counts"].keys() == {"safe", "land"}
    assert any(f"{stopped} of 400 runs did not end well" in note for note in found["notes"])


def test_what_a_person_sees(folders):
    shown = asked(folders["one"], "--worst", "lateral_m", "--count", "2")
    assert "largest lateral_m [m]" in shown and "have no finite lateral_m" in shown and "--case NUMBER" in shown
    shown = asked(folders["one"])
    assert "needs 852 runs" in shown and "too few" in shown and "did not end well" in shown and "lateral_m [m]" in shown
    assert "not independent" in asked(folders["sobol"])


def test_groups_are_never_pooled_silently(folders):
    found = json.loads(asked(folders["grid"], "--json"))
    assert [group["group"] for group in found["groups"]] == ["p.g 1", "p.g 2", "p.g 3"]
    assert [group["rows"] for group in found["groups"]] == [200] * 3 and not any("put together" in n for n in found["notes"])
    pooled = json.loads(asked(folders["grid"], "--pool", "--json"))
    assert [group["rows"] for group in pooled["groups"]] == [600] and any("put together" in note for note in pooled["notes"])
    worst = json.loads(asked(folders["grid"], "--worst", "speed", "--json"))["worst"][0]["groups"]
    assert len(worst) == 3 and all(one["case"] % 3 == number for number, group in enumerate(worst) for one in group["cases"])


def test_a_campaign_that_its_rule_has_ended_says_whose_interval_counts(tmp_path):
    until = {"metric": "landed", "half_width": 0.1}
    ended = {"runs": 128, "sentence": "ended by its stopping rule after 128 runs: landed 0.9 in [0.82, 0.95]"}
    folder = write(tmp_path / "ended", {**MISS, "until": until}, miss(), ended=ended)
    found = json.loads(asked(folder, "--json"))
    assert (found["rows"], found["wanted"]) == (128, 128), "chunks beyond the end are not counted"
    assert any("the interval of landed is the one that the rule gave" in note for note in found["notes"])
    assert "ended by its stopping rule" in asked(folder)


def test_worst_cases_are_those_of_a_sort(folders, truth):
    campaign = Campaign.at(folders["one"])
    (group,) = reports.worst(campaign, "lateral_m", 5)["groups"]
    order = np.argsort(-np.nan_to_num(truth[0], nan=-1.0), kind="stable")[:5]
    assert [one["case"] for one in group["cases"]] == order.tolist() and group["without"] == int(np.isnan(truth[0]).sum())
    (least,) = reports.worst(campaign, "bounces", 3, smallest=True)["groups"]
    assert [one["case"] for one in least["cases"]] == [0, 4, 8], "of equal values the first cases"


def test_comparison_on_the_same_draws(folders):
    found = json.loads(asked(folders["one"], "--compare", folders["two"], "--json"))["comparison"]
    (group,) = found["groups"]
    lateral = named(group["metrics"], "lateral_m")
    assert lateral["larger"] == lateral["pairs"] and lateral["mean_low"] > 0.0, "a larger gain is further off in every case"
    assert found["only_here"] == 10 and found["not_compared"] == ["mode"]
    landed = named(group["rates"], "landed")
    assert landed["only_b"] == 0 and landed["probability"] == pytest.approx(2.0 * 0.5 ** landed["only_a"])
    for other, words in (("other", "vary.seed differs"), ("grid", "has 3 combinations"), ("sobol", "vary.sampling differs")):
        with pytest.raises(FlightError, match=words):
            paired.compare(Campaign.at(folders["one"]), Campaign.at(folders[other]))


def test_groups_of_one_campaign_on_the_same_draws(folders, tmp_path):
    """The distance of a toy landing grows by 0.2 a step of p.g, whatever is drawn: every difference is that, to rounding."""
    found = json.loads(asked(folders["grid"], "--between", "p.g", "--json"))["between"]
    assert [entry["group"] for entry in found["groups"]] == ["p.g 2 less p.g 1", "p.g 3 less p.g 1"]
    for entry, step in zip(found["groups"], (0.2, 0.4)):
        lateral = named(entry["metrics"], "lateral_m")
        missing = {case // 3 for case in range(600) if case % 3 in (0, int(entry["second"][-1]) - 1)
                   and (case % 97 == 5 or case % 50 == 0)}
        assert (lateral["pairs"], entry["pairs"]) == (200 - len(missing), 200)
        assert [lateral[key] for key in ("mean", "median", "median_low")] == pytest.approx([step] * 3)
        landed, stopped = named(entry["rates"], "landed"), [case for case in range(0, 600, 3) if case % 97 == 5]
        assert landed["only_b"] <= len(stopped) == landed["without_a"], "further off it lands alone where the other stopped"
    assert found["not_compared"] == ["mode"] and found["without_partner"] == 0
    two = {**MISS, "grid": {"p.g": [1, 2], "p.h": ["a", "b"]}, "runs": 20}
    campaign = Campaign.at(write(tmp_path / "two", two, miss()))
    assert [entry["group"] for entry in paired.between(campaign, "p.h")["groups"]] == [
        "p.g 1, p.h b less p.g 1, p.h a", "p.g 2, p.h b less p.g 2, p.h a"]
    assert [entry["first"] for entry in paired.between(campaign, "p.g 2, p.h a")["groups"]] == ["p.g 2, p.h a"] * 3
    with pytest.raises(FlightError, match="did you mean 'p.h' or 'p.g'"):
        paired.between(campaign, "p.q")
    with pytest.raises(FlightError, match="one group"):
        paired.between(Campaign.at(folders["one"]), "p.g")


def test_whole_numbers_that_are_0_or_1_are_no_rate(tmp_path):
    campaign = Campaign.at(write(tmp_path / "counts", MISS, lambda case, values: ("ok", {
        "restarts": int(case % 9 == 0), "landed": case % 2 == 0, "how": "fell" if case % 3 else None})))
    (group,) = reports.report(campaign)["groups"]
    assert [[one["metric"] for one in group[kind]] for kind in ("metrics", "rates", "texts")] == [
        ["restarts"], ["landed"], ["how"]]


def test_sobol_indices_of_a_campaign_are_those_of_ishigami(tmp_path):
    """The design's rows in case order, of which one has no number: its base sample is left out, and counted."""
    vary = {"random": {f"p.{name}": {"uniform": [0.0, 1.0]} for name in "abc"}, "runs": 5 * 1024, "sampling": "saltelli",
            "grid": {"p.k": [1, 2]}}

    def judged(case, values):
        height = values["p.k"] * float(ishigami(np.array([values["p.a"], values["p.b"], values["p.c"]])))
        return "ok", {"height": None if case == 23 else height}

    campaign = Campaign.at(write(tmp_path / "design", vary, judged, step=2048))
    found = reports.sensitivities(campaign, "height")
    assert [one["group"] for one in found] == ["p.k 1", "p.k 2"]
    assert [(one["sobol"]["samples"], one["sobol"]["left_out"]) for one in found] == [(1024, 0), (1023, 1)]
    ranked = [one["rank_correlations"][0] for one in found]
    assert [(one["rows"], one["left_out"]) for one in ranked] == [(2048, 0), (2047, 1)], "ranks are of the rows A and B"
    for one in found:
        assert [factor["first"] for factor in one["sobol"]["factors"]] == pytest.approx(ISHIGAMI_FIRST, abs=0.04)
    assert [group["rows"] for group in reports.report(campaign)["groups"]] == [2048, 2048]


@pytest.mark.parametrize(("words", "sentence"), [
    (["--metric", "latral_m"], "did you mean 'lateral_m'"), (["--worst", "mode"], "this is a text, no number"),
    (["--share", "99.73"], "allowed: between 0 and 1"), (["--confidence", "nan"], "allowed: between 0 and 1"),
    (["--sensitivity", "wind"], "no metric called 'wind'"), (["--compare", "nowhere"], "holds no campaign")])
def test_bad_input_is_a_sentence(folders, words, sentence):
    result = CliRunner().invoke(app, ["report", str(folders["one"]), *words])
    assert isinstance(result.exception, FlightError) and sentence in str(result.exception), result.exception


def test_a_campaign_without_rows(tmp_path):
    folder = write(tmp_path / "none", MISS, miss())
    for part in folder.glob("part-*"):
        part.unlink()
    with pytest.raises(FlightError, match="no run of this campaign has ended"):
        reports.report(Campaign.at(folder))
