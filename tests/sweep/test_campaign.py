"""Campaigns: the same table wherever and in whatever order it was made; what is damaged, foreign or unequal is said."""

import errno
import hashlib
import json
import os
import random
from dataclasses import replace

import pyarrow
import pyarrow.compute
import pytest

from flight_graph.campaigns import coordinator, opening
from flight_graph.campaigns.cases import Cases
from flight_graph.campaigns.chunk import Damaged, decode, digest, encode
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.manifest import Manifest, chunk_of
from flight_graph.campaigns.run import run_chunk
from flight_graph.campaigns.summary import ends, summary
from flight_graph.campaigns.workers import Processes, Threads
from flight_graph.components.foreign import agree
from flight_graph.errors import FlightError
from tests.sweep.sweep_scenarios import RANDOM, swept


def made(folder, scenario=None, **options):
    """A campaign of 12 runs in chunks of 5, not run yet; its scenario."""
    scenario = scenario or swept(RANDOM)
    manifest = Manifest.of(scenario, options.pop("runs", None), options.pop("chunk", 5))
    return opening._saved(Campaign(coordinator.folder_of(folder), manifest), manifest), scenario


def parts(campaign):
    return {path.name: path.read_bytes() for path in sorted(campaign.path.glob("part-*.parquet"))}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign that nothing disturbed."""
    return opening.run_here(swept(RANDOM), tmp_path_factory.mktemp("whole") / "c", chunk=5, workers=1)


def filled(campaign, scenario, width=2, tell=lambda sentence: None):
    return opening.fill(campaign, scenario, lambda *given: Threads(*given, width), tell=tell)


# -- the same table -----------------------------------------------------------------------------------------------------
def test_threads_processes_and_chunks_in_any_order_make_the_same_files(whole, tmp_path):
    two, scenario = made(tmp_path / "threads")
    assert parts(filled(two, scenario)) == parts(whole)
    several, _ = made(tmp_path / "processes")
    assert parts(opening.fill(several, scenario, lambda manifest, _: Processes(manifest, 2))) == parts(whole)
    tasks, _ = made(tmp_path / "tasks")
    for number in (2, 0, 2, 1):
        assert opening.run_chunks(tasks, scenario, [number], False, print)[0]["outcome"] in ("done", "done again, equal")
    assert parts(tasks) == parts(whole)
    assert run_chunk(whole.manifest, 1, agree).equals(whole.read_part(1).table)
    expected = Cases(scenario).rows(range(12))
    assert list(whole.rows()) == expected and whole.row(7) == expected[7]


def test_reading(whole):
    table = whole.read()
    assert table.column("case").to_pylist() == list(range(12)) and whole.missing() == []
    assert pyarrow.concat_tables(whole.batches()).equals(table)
    assert whole.read(["angle", "case"]).column_names == ["angle", "case"]
    found = {column.name: (column.unit, column.kind, column.type) for column in whole.columns()}
    assert found["plant.angle"] == ("rad", "parameter", "double[3]") and found["angle"] == ("", "metric", "double")
    with pytest.raises(FlightError, match="did you mean 'angle'"):
        whole.read(["angel"])


def test_an_extended_campaign_runs_the_new_cases_only(whole, tmp_path, monkeypatch):
    """Also those of a chunk that was not full; the result is that of a campaign which was so long from the beginning."""
    campaign, scenario = made(tmp_path / "c", runs=7)
    filled(campaign, scenario)
    old, flown, fly = parts(campaign), [], Cases._fly
    monkeypatch.setattr(Cases, "_fly", lambda self, structure, group, watch: (
        flown.extend(row.case for row, _ in group), fly(self, structure, group, watch))[1])
    campaign, _ = opening.existing(campaign.path, 12, agree)
    assert campaign.missing() == [1, 2]
    filled(campaign, scenario)
    assert sorted(flown) == [7, 8, 9, 10, 11] and parts(campaign) == parts(whole)
    assert parts(campaign)["part-000000.parquet"] == old["part-000000.parquet"]
    with pytest.raises(FlightError, match="has 12 runs already"):
        opening.existing(campaign.path, 11, agree)


def test_columns_of_chunks_become_one_type(tmp_path):
    """A vector of equal numbers stands as one number in its chunk; whole numbers meet reals; a metric comes late."""
    vary = {"grid": {"plant.angle": [[0.1, 0.1, 0.1], [0.1, 0.2, 0.3]]}, "random": {"seed": {"count": 50}}, "runs": 4}
    scenario = swept(vary, metrics="tests.sweep.sweep_scenarios:patchy")
    campaign = opening.run_here(scenario, tmp_path / "c", chunk=1)
    table = campaign.read()
    assert table.column("plant.angle").to_pylist()[:2] == [[0.1] * 3, [0.1, 0.2, 0.3]]
    assert table.column("whole").to_pylist() == [50.0, 50.0, 0.5, 0.5, 52.0, 52.0, 53.0, 53.0]
    assert table.column("flag").to_pylist()[:4] == [True, True, False, False]


def test_what_is_missing_or_no_number_is_counted(tmp_path):
    """Of the seeds 50 to 61: absent where 4 divides, None at remainder 2, NaN at remainder 3."""
    campaign = opening.run_here(swept(RANDOM, metrics="tests.sweep.sweep_scenarios:patchy"), tmp_path / "c", chunk=5)
    found = summary(campaign)
    assert (found["sometimes"]["missing"], found["sometimes"]["not_a_number"]) == (6, 3)
    assert found["sometimes"]["least"] == found["sometimes"]["largest"] == 1.0
    assert (found["unbounded"]["missing"], found["unbounded"]["not_a_number"]) == (0, 1)
    assert (found["always"]["least_case"], found["always"]["median"], found["always"]["largest_case"]) == (0, 55.5, 11)
    assert found["flag"]["counts"] == {"yes": 6, "no": 6} and found["flag"]["missing"] == 0
    assert ends(campaign) == ({"ok": 12}, [])


def test_chunks_are_round_numbers():
    assert [chunk_of(runs) for runs in (1, 63, 64, 1000, 10_000, 1_000_000)] == [1, 1, 2, 20, 200, 1000]


# -- damage -------------------------------------------------------------------------------------------------------------
def test_a_flipped_bit_is_found_or_changes_no_row(whole):
    """Wherever in the file it lies."""
    content, draw = bytearray(whole.part(1).read_bytes()), random.Random(5)
    table, found = whole.read_part(1).table, 0
    for _ in range(400):
        place, bit = draw.randrange(len(content)), 1 << draw.randrange(8)
        content[place] ^= bit
        try:
            assert decode(bytes(content), "it").table.equals(table)
        except Damaged:
            found += 1
        content[place] ^= bit
    assert found > 200


def test_a_part_that_unpacks_to_more_than_is_read_of_one(whole):
    table = pyarrow.table({"case": pyarrow.array([0] * 100_001)})
    content = encode(table, whole.manifest.identity, 0)
    assert len(content) < 10_000
    with pytest.raises(Damaged, match="claims 100001 rows of"):
        decode(content, "it")


def test_damaged_parts_are_run_again_and_that_is_said(whole, tmp_path):
    campaign, scenario = made(tmp_path / "c")
    filled(campaign, scenario)
    whole_content = campaign.part(0).read_bytes()
    campaign.part(0).write_bytes(whole_content[:1000])
    campaign.part(1).write_bytes(campaign.part(2).read_bytes())  # a part of this campaign under another's name
    other = replace(campaign.manifest, chunk=4)
    campaign.part(2).write_bytes(encode(whole.read_part(2).table, other.identity, 2))
    with pytest.raises(FlightError, match="--resume runs its 5 cases again"):
        campaign.read()
    said = []
    filled(campaign, scenario, tell=said.append)
    assert parts(campaign) == parts(whole) and len(said) == 3
    for sentence, words in zip(said, ("is damaged", "is chunk 2 under another name", "belongs to another campaign")):
        assert words in sentence and "run again" in sentence
    assert len(list(campaign.path.glob("damaged-*.parquet"))) == 3


def test_a_manifest_that_was_changed_is_refused(whole, tmp_path):
    campaign, _ = made(tmp_path / "c")
    file = campaign.path / "campaign.json"
    file.write_text(file.read_text().replace('"runs": 12', '"runs": 13', 1))
    with pytest.raises(FlightError, match="damaged: it is not what was written"):
        Campaign.at(campaign.path)


@pytest.mark.parametrize(("field", "value"), [
    ("runs", "12"), ("runs", 10**15), ("chunk", 0), ("ended", {"runs": -3}), ("vary", [1]), ("code", {"driver": 1}), ("more", 1)])
def test_a_manifest_of_a_stranger_holds_what_it_may(whole, tmp_path, field, value):
    data = json.loads((whole.path / "campaign.json").read_text()) | {field: value}
    data.pop("sha256")
    data["sha256"] = hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
    (tmp_path / "campaign.json").write_text(json.dumps(data))
    with pytest.raises(FlightError, match=f"no campaign of this program: {field}"):
        Campaign.at(tmp_path)


def test_what_killed_processes_left_is_taken_away(tmp_path):
    campaign, scenario = made(tmp_path / "c")
    gone = campaign.path / f".part-000000.parquet.{os.uname().nodename}.999999999.0123abcd.tmp"
    mine = campaign.path / f".part-000000.parquet.{os.uname().nodename}.{os.getpid()}.0123abcd.tmp"
    gone.write_bytes(b"half"), mine.write_bytes(b"half")
    filled(campaign, scenario)
    assert not gone.exists() and mine.exists()


def test_a_full_disk(whole, tmp_path, monkeypatch):
    campaign, scenario = made(tmp_path / "c")
    opening.run_chunks(campaign, scenario, [1], False, print)

    def full(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FlightError, match=r"no space left on device; nothing that was there is lost: the campaign goes on"):
        filled(campaign, scenario)
    with pytest.raises(FlightError, match=r"no space left on device; nothing that was there is lost$"):
        opening.run_here(scenario, tmp_path / "new")
    assert not (tmp_path / "new").exists(), "a folder that holds no campaign is in the way of the next one"
    assert sorted(path.name for path in campaign.path.iterdir()) == ["campaign.json", "part-000001.parquet"]
    monkeypatch.undo()
    assert parts(filled(campaign, scenario)) == parts(whole)


# -- what does not belong together --------------------------------------------------------------------------------------
def test_two_results_of_a_chunk_name_the_machines(whole, tmp_path, monkeypatch):
    campaign, scenario = made(tmp_path / "c")
    table = whole.read_part(0).table
    wrong = table.column("angle").to_pylist()
    wrong[3] += 2.0**-50
    at = table.schema.get_field_index("angle")
    wrong = table.set_column(at, table.schema.field(at), pyarrow.array(wrong))
    monkeypatch.setattr("flight_graph.campaigns.chunk.machine", lambda: ("hot-node-17", "Overclocked"))
    coordinator.publish(campaign, 0, encode(wrong, campaign.manifest.identity, 0), print)
    monkeypatch.undo()
    with pytest.raises(coordinator.Disagreement, match=r"hot-node-17 \(Overclocked\).*first difference is angle of case 3"):
        opening.run_chunks(campaign, scenario, [0], False, print)
    assert len(campaign.disagreements()) == 1


def test_another_scenario_and_other_code_are_refused_with_what_differs(tmp_path):
    campaign, scenario = made(tmp_path / "c")
    other = Manifest.of(swept({**RANDOM, "seed": 1}), chunk=5)
    assert other.differences(campaign.manifest) == ["vary.seed is null there and 1 here"]
    assert other.identity != campaign.manifest.identity
    heavier = swept({**RANDOM, "random": {"seed": {"count": 50}}}, title="another title")
    found = "; ".join(Manifest.of(heavier, chunk=5).differences(campaign.manifest))
    assert "title is" in found and "vary.random.plant.angle is" in found
    code = {**campaign.manifest.code, "controller.kernel": "0", "metrics": "0"}
    replace(campaign.manifest, code=code).save(campaign.path)
    with pytest.raises(FlightError, match="begun with other code: controller.kernel, metrics differ here"):
        opening.existing(campaign.path, None, agree)
    with pytest.raises(FlightError, match="add --trust"):  # the toy is no component of the packages
        campaign.manifest.load(opening_consent())


def opening_consent():
    from flight_graph.components.foreign import refuse
    return refuse


# -- the stopping rule --------------------------------------------------------------------------------------------------
def test_the_end_by_a_rule_does_not_depend_on_who_finished_first(tmp_path):
    """Half of the runs count. Chunks from beyond the end are kept, and no reader sees their rows."""
    until = {"metric": "flag", "half_width": 0.2, "confidence": 0.9}
    scenario = swept({"random": {"seed": {"count": 0}}, "runs": 60, "until": until},
                     metrics="tests.sweep.sweep_scenarios:patchy", duration_s=0.1)
    said, found = [], []
    for name, first, width in (("a", (), 1), ("b", (11, 3), 2)):
        campaign, _ = made(tmp_path / name, scenario)
        for number in first:
            opening.run_chunks(campaign, scenario, [number], False, print)
        campaign = filled(campaign, scenario, width, said.append)
        found.append((campaign.manifest.ended, digest(campaign.read()), campaign.read().num_rows))
    assert found[0] == found[1]
    assert found[0][2] == found[0][0]["runs"] < 60 and "ended by its stopping rule" in said[0]
    assert Campaign.at(tmp_path / "b").part(11).exists() and Campaign.at(tmp_path / "b").missing() == []
    wrong = swept({"random": {"seed": {"count": 0}}, "runs": 60, "until": {**until, "metric": "flog"}},
                  metrics="tests.sweep.sweep_scenarios:patchy", duration_s=0.1)
    campaign, _ = made(tmp_path / "c", wrong)
    with pytest.raises(FlightError, match="vary.until: no metric called 'flog'; did you mean 'flag'"):
        filled(campaign, wrong)
