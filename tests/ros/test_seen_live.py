"""A run of nodes that is watched while it runs: every message of its bag is shown, /tf too where no node can publish it."""

import pytest

from flight_graph import runs as one_run
from flight_graph.bags.reader import read_bag
from flight_graph.graphs.scenario import load

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("nodes")]


class Stream:
    """What a viewer is given: topic -> payloads, and the stamps of all of them."""

    def __init__(self):
        self.seen, self.stamps_ns = {}, set()

    def begin(self, series):
        self.series = series

    def add(self, bag):
        for topic in bag.topics:
            self.seen.setdefault(topic, []).extend(map(bytes, bag.payloads(topic)))
            self.stamps_ns |= set(bag.stamps_ns(topic).tolist())

    def flush(self):
        pass


def test_what_is_seen_is_what_the_bag_holds(tmp_path):
    scenario, stream = load("cubli_asteroid", {"duration_s": 1.0}), Stream()
    bag = read_bag(one_run.execute(scenario, "ros", out=tmp_path / "bag", live=stream).bag)
    for topic in bag.topics:
        said = list(map(bytes, bag.payloads(topic)))
        seen = [payload[:len(one)] for payload, one in zip(stream.seen[topic], said)]  # the middleware may fill up the last word
        assert len(stream.seen[topic]) == len(said) and seen == said, topic
    assert stream.seen.keys() == bag.topics.keys() and "/tf" in stream.seen
    assert min(stream.stamps_ns) == scenario.epoch_ns and max(stream.stamps_ns) <= scenario.epoch_ns + scenario.duration_ns
    assert {series.topic for series in stream.series} <= stream.seen.keys()
