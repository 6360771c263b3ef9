"""The same source gives the same bits compiled and as plain Python (NUMBA_DISABLE_JIT=1)."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spacerobot_ros.inertial_parameters import prior
from tests.spacerobot.spacerobot_loop import FILTERED, HARMONIC, LYAPUNOV, NATURAL, RLS, ROBOT, run

pytestmark = pytest.mark.xdist_group("the robot's loop")  # compiled once

ROOT = Path(__file__).parents[2]


def digest() -> str:
    """SHA-256 over the histories of four control periods with each estimator."""
    start = prior(ROBOT.pi, 0.1, 104)
    noise = 1e-4 * np.random.default_rng(0).standard_normal((4, 21))
    result = hashlib.sha256()
    for estimator in (RLS, LYAPUNOV, NATURAL, FILTERED):
        r = run(
            HARMONIC, 0.08, prior=start, noise=noise, g_diagonal=np.full(50, 1e4), gamma=np.full(50, 0.3),
            estimator=estimator,
        )  # fmt: skip
        for part in (r.attitude, r.joints, r.torque, r.balance, r.pi_hat, r.state):
            result.update(part.tobytes())
    return result.hexdigest()


def test_compiled_and_plain_give_the_same_bits():
    program = "from tests.spacerobot.test_spacerobot_bits import digest; print(digest())"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == digest()
