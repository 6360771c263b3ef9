"""Ranges as REP 117 has them: out of reach is +inf, and no measurement."""

import numpy as np

from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate


def test_a_range_out_of_reach_is_infinite_and_not_taken():
    flown = {reach: simulate(load("lander_estimated", {"duration_s": 3, "altimeter.reach": reach})) for reach in (5000.0, 100.0)}
    assert np.isfinite(flown[5000.0]["lander/altimeter"]["range"]).all()
    assert (flown[100.0]["lander/altimeter"]["range"] == np.inf).all()
    assert not flown[100.0]["lander/navigation"]["range_innovation_squared"].any()
    for run in flown.values():
        assert np.isfinite(run["lander/odom"]["pose"]["pose"]["position"]).all()
