"""A graph of nodes begins where the compiled engine stood, and leaves checkpoints from which that one goes on."""

import pytest

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.errors import FlightError
from flight_graph.recordings import beginning
from flight_graph.recordings.continuation import continued
from tests.faults import chain
from tests.faults.everything import FAULTS, MONITORS

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("faults")]


def messages(bag, begin_ns: int = 0) -> list:
    return [message for message in read_bag(bag).messages() if message[1] >= begin_ns]


def test_from_the_compiled_engine_to_nodes_and_back(tmp_path):
    """Every type of fault acts; the digests of the checkpoints are the same in both engines."""
    data = chain.data(FAULTS, monitors=MONITORS, record={"checkpoint_period_s": 0.13})
    scenario = chain.Scenario(data, "chain.yaml")
    runs.execute(scenario, out=tmp_path / "compiled")
    made = continued(f"{tmp_path / 'compiled'}@0.43", trust=True)
    outcome = runs.execute(made.scenario, "ros", out=tmp_path / "ros", begin=made.begin)
    assert outcome.lost == 0
    assert messages(tmp_path / "ros") == messages(tmp_path / "compiled", scenario.epoch_ns + 430_000_000)
    one, other = (read_bag(tmp_path / name) for name in ("compiled", "ros"))
    later = [tick for tick in beginning.ticks(one) if tick > 43]
    assert beginning.ticks(other) == [43, *later] and len(later) == 4
    for tick in later:
        assert beginning.checkpoint(one, tick).difference(beginning.checkpoint(other, tick)) == ""
        assert beginning.checkpoint(one, tick).digest == beginning.checkpoint(other, tick).digest
    back = continued(f"{tmp_path / 'ros'}@0.65", trust=True)
    runs.execute(back.scenario, out=tmp_path / "back", begin=back.begin)
    assert messages(tmp_path / "back") == messages(tmp_path / "compiled", scenario.epoch_ns + 650_000_000)
    result = runs.verify(tmp_path / "ros", trust=True)
    assert result.verdict == "equal" and "equal, too: 4 checkpoints" in result.sentences


def test_no_checkpoint_of_a_realtime_run(tmp_path):
    made = continued(_short(tmp_path), trust=True)
    with pytest.raises(FlightError, match="a realtime run begins at t = 0"):
        runs.execute(made.scenario, "ros", "realtime", tmp_path / "ros", begin=made.begin)


def _short(folder) -> str:
    runs.execute(chain.Scenario(chain.data([]), "chain.yaml"), out=folder / "short")
    return f"{folder / 'short'}@0.5"
