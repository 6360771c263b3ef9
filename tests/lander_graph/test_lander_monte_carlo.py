"""The Monte Carlo of the landing: its draws, and some of its runs (all of them: benchmarks/lander_monte_carlo.py)."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_graph.campaigns.cases import Cases
from flight_graph.graphs.scenario import load
from flight_math import Vec3, view
from lander_ros.constraints import clearance
from sim_nodes.lander.plant import LanderPlant
from sim_nodes.lander.start import drawn, motion_at_start

CASES = (0, 1, 2, 45, 117, 122, 126, 134, 176, 188)  # the first ones, and the extreme ones of the whole set


@pytest.mark.parametrize("name", ["lander_monte_carlo", "lander_monte_carlo_perturbed"])
def test_runs_succeed(name):
    cases = Cases(load(name))
    assert cases.vary.count == 200
    for case in CASES:
        row = cases.row(case)
        assert row.status == "ok" and row.metrics["success"] == 1, (case, row)


def test_draws_are_those_of_the_definition():
    """Read back from the first true state of a run: range, azimuth, clearance, view error, sizes of the rates."""
    scenario = load("lander_monte_carlo", {"plant.draw_seed": 20208})
    assert scenario.graph.nodes["plant"].values["draw_seed"] == 20208
    random = np.random.default_rng(20208)
    horizontal, azimuth, d = random.uniform(200, 1200), random.uniform(0, 360), random.uniform(40, 400)
    error, direction, yaw = random.uniform(0, 25), random.uniform(0, 360), random.uniform(-180, 180)
    v_axis, v = random.normal(size=3), random.uniform(0, 0.5)
    w_axis, w = random.normal(size=3), random.uniform(0, 0.3)
    values = drawn(20208)
    record = LanderPlant.parameters.record({**LanderPlant.parameters.defaults(), **values})
    p = view(record[0], LanderPlant.parameters.kinds)
    motion = motion_at_start(p)
    r, turn = np.array(motion.position), Rotation.from_quat(motion.attitude)
    assert abs(math.hypot(r[0], r[1]) - horizontal) < 1e-9
    assert abs(math.degrees(math.atan2(r[1], r[0])) % 360.0 - azimuth) < 1e-9
    assert abs(clearance(p, Vec3(*r)) - d) < 1e-9
    assert abs(math.degrees(math.acos(turn.apply([0, 0, 1]) @ r / np.linalg.norm(r))) - error) < 1e-6
    np.testing.assert_allclose(motion.velocity, v_axis / np.linalg.norm(v_axis) * v, rtol=1e-12)
    np.testing.assert_allclose(motion.rates, np.radians(w_axis / np.linalg.norm(w_axis) * w), rtol=1e-12)
    least = Rotation.align_vectors([r / np.linalg.norm(r)], [[0, 0, 1]])[0]
    tilt = Rotation.from_rotvec(math.radians(error) * np.array([math.cos(math.radians(direction)),
                                                                math.sin(math.radians(direction)), 0.0]))
    expected = least * Rotation.from_euler("z", yaw, degrees=True) * tilt
    assert (expected.inv() * turn).magnitude() < 1e-7


def test_perturbations_are_drawn():
    """Gravity N(1, 0.05) and mass N(500, 10) kg over the 200 cases."""
    vary = load("lander_monte_carlo_perturbed").vary
    values = [vary.overrides(case) for case in range(200)]
    for key, mean, sigma in (("gravity.scale", 1.0, 0.05), ("controller.mass", 500.0, 10.0)):
        drawn_values = np.array([value[key] for value in values])
        assert abs(drawn_values.mean() - mean) < 4.0 * sigma / math.sqrt(200)
        assert abs(drawn_values.std() / sigma - 1.0) < 0.25
    assert [value["plant.draw_seed"] for value in values] == list(range(20201, 20401))
