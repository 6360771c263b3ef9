"""Short runs of every scenario leave the bits that are written down, on any machine. `make portable` flies whole ones."""

import dataclasses

import numpy as np
import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy
from tests.portable import scenario_digests

WHAT_THEN = ("where the numbers are meant to change, `python -m tests.portable.scenario_digests --write` writes them down "
             "anew; on another machine alone, some mathematics hangs on that machine")


@pytest.mark.parametrize("name", scenario_digests.scenarios())
def test_short_run(name):
    assert scenario_digests.fly(name, "short") == scenario_digests.written()[name]["short"], WHAT_THEN


def test_all_scenarios_are_written_down():
    lengths = {name: set(found) for name, found in scenario_digests.written().items()}
    assert lengths == {name: {"short", "whole"} for name in scenario_digests.scenarios()}


def test_a_digest_sees_every_bit():
    recording = CompiledRun(Scenario(toy.scenario(), "toy.yaml")).run()
    before = scenario_digests.digest(recording)
    assert before == scenario_digests.digest(CompiledRun(Scenario(toy.scenario(), "toy.yaml")).run())
    track = recording.tracks[-1]
    later = dataclasses.replace(track, stamps_ns=track.stamps_ns + np.int64(1))
    shorter = dataclasses.replace(track, stamps_ns=track.stamps_ns[:-1], records=track.records[:-1])
    changed = track.records.copy()
    changed.view("u1").reshape(len(changed), -1)[-1, track.signal.size - 1] ^= 1
    flipped = dataclasses.replace(track, records=changed)
    found = {scenario_digests.digest(dataclasses.replace(recording, tracks=[*recording.tracks[:-1], other]))
             for other in (later, shorter, flipped)}
    assert len(found | {before}) == 4
