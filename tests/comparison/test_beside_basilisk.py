"""The benchmark beside Basilisk where there is no Basilisk: what it asks for, and the physics of our side."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import beside_basilisk
from flight_graph import runs

SCRIPT = Path(beside_basilisk.__file__)


def test_without_basilisk_it_says_how_to_get_it():
    done = subprocess.run([sys.executable, SCRIPT], capture_output=True, text=True)
    assert done.returncode == 0 and "pip install bsk" in done.stdout


def test_an_interpreter_without_basilisk_is_refused():
    with pytest.raises(SystemExit, match="No module named 'Basilisk'(.|\n)*pip install bsk"):
        beside_basilisk.asked(sys.executable, SCRIPT.parent / "pointing/basilisk_program.py")


def test_differences_are_of_the_same_ticks(tmp_path):
    state = np.arange(36.0).reshape(3, 12)
    np.savez(tmp_path / "one.npz", t_ns=[0, 10, 20], state=state)
    np.savez(tmp_path / "other.npz", t_ns=[0, 10, 20, 30], state=np.vstack([state, state[:1]]) + np.eye(4, 12))
    found = beside_basilisk.differences(tmp_path / "one.npz", tmp_path / "other.npz")
    assert found == [("position, m", 1.0, 27.0), ("velocity, m/s", 0.0, 29.0), ("sigma, 1", 0.0, 32.0),
                     ("omega, rad/s", 0.0, 35.0)]
    with pytest.raises(SystemExit, match="1 of 4 ticks"):
        beside_basilisk.differences(tmp_path / "other.npz", tmp_path / "one.npz")


def test_wheels_do_not_change_the_angular_momentum():
    scenario = beside_basilisk.scenario_of("wheels", 60.0)
    plant = {name: np.array(value) for name, value in scenario.graph.nodes["plant"].values.items()}
    recording = runs.simulate(scenario)
    truth, wheels = recording["pointing/truth"], recording["pointing/wheel_speeds"]
    momentum = truth["omega"] @ plant["inertia"] + plant["wheel_inertia"] * wheels["speeds"] @ plant["axes"]
    turned = np.array([dcm.T @ h for dcm, h in zip(map(body_from_inertial, truth["sigma"]), momentum)])
    impulse = np.array([body_from_inertial(sigma).T @ plant["disturbance"] for sigma in truth["sigma"]])
    expected = turned[0] + np.vstack([np.zeros(3), np.cumsum(0.5 * (impulse[1:] + impulse[:-1]), axis=0) * 0.01])
    assert np.abs(turned - expected).max() < 1e-6 * np.abs(turned).max()


def body_from_inertial(sigma):
    """Direction cosines of an MRP, Schaub and Junkins, eq. (3.147)."""
    x, y, z = sigma
    tilde, square = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), sigma @ sigma
    return np.eye(3) + (8 * tilde @ tilde - 4 * (1 - square) * tilde) / (1 + square) ** 2
