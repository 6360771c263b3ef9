"""Runs kept as bags: made once, read from the bag afterwards, made again when something that can change a bit has."""

import numpy as np

from flight_graph.claims.kept_runs import KeptRuns
from flight_graph.graphs.scenario import load
from flight_graph.recordings import recording
from flight_graph.runs import simulate


def test_a_kept_run_is_read_from_its_bag_until_the_code_changes(tmp_path, monkeypatch):
    scenario = load("cubli_asteroid", {"duration_s": 1})
    monkeypatch.setattr(recording, "_commit", lambda: "1234")
    first = KeptRuns(tmp_path)(scenario)
    (folder,) = tmp_path.iterdir()
    made = (folder / "metadata.yaml").stat().st_mtime_ns
    again = KeptRuns(tmp_path)(scenario)
    assert (folder / "metadata.yaml").stat().st_mtime_ns == made
    fresh = simulate(scenario)
    for signals in (first, again):
        np.testing.assert_array_equal(signals["cubli/truth"]["angles"], fresh["cubli/truth"]["angles"])
    monkeypatch.setattr(recording, "_commit", lambda: "5678")
    KeptRuns(tmp_path)(scenario)
    assert (folder / "metadata.yaml").stat().st_mtime_ns > made
