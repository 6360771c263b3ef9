"""What the space robot costs: regressor against Pinocchio's, updates, the compiled engine, the first compile.

    python benchmarks/spacerobot.py

Prints one line a number; ratios are of the same process. Without the package ``pin`` the comparison is left out.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from papers.spacerobot.timing import REPEATS, update_times

SCENARIO = "spacerobot_harmonic_rls"
RUN = f"""
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
run = CompiledRun(load("{SCENARIO}"))
print(run.run().compile_s)
"""


def pinocchio_regressor() -> float | None:
    """Seconds of Pinocchio's regressor of the same robot, the call from Python included."""
    try:
        import pin as pinocchio
    except ImportError:
        try:
            import pinocchio
        except ImportError:
            return None
    from spacerobot_ros.robot_files import find_model
    sys.path.append(str(Path(__file__).resolve().parents[1]))  # where the tests stand
    from tests.spacerobot.spacerobot_cases import PinocchioTwin
    twin = PinocchioTwin(pinocchio, find_model("mini_space_robot"))
    rng = np.random.default_rng(1)
    q = pinocchio.randomConfiguration(twin.model, -np.ones(twin.model.nq), np.ones(twin.model.nq))
    v, a = rng.standard_normal((2, twin.model.nv))
    
    def batch():
        began = time.perf_counter()
        for _ in range(REPEATS):
            pinocchio.computeJointTorqueRegressor(twin.model, twin.data, q, v, a)
        return (time.perf_counter() - began) / REPEATS

    return min(batch() for _ in range(3))


def first_compile() -> tuple[float, float]:
    """Seconds until the first step of the scenario, with an empty cache and with a warm one, whole process."""
    with tempfile.TemporaryDirectory() as folder:
        found = []
        for _ in range(2):
            began = time.perf_counter()
            subprocess.run([sys.executable, "-c", RUN], check=True, stdout=subprocess.DEVNULL,
                           env={**os.environ, "FLIGHT_CACHE_DIR": folder})
            found.append(time.perf_counter() - began)
    return found[0], found[1]


def real_time_factor() -> tuple[float, int]:
    """Simulated over wall seconds of the compiled engine, and the samples a second."""
    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.graphs.scenario import load
    scenario = load(SCENARIO)
    run = CompiledRun(scenario)
    wall = min(run.run().wall_s for _ in range(3))
    simulated = scenario.duration_ns / 1e9
    return simulated / wall, int(50 * simulated / wall)


def main() -> None:
    """Print the table."""
    times = update_times()
    for name, seconds in times.items():
        print(f"{name:34s} {1e6 * seconds:10.2f} us   (paper: of the order of 100 us for a whole update)")
    for name in ("least squares, 7 rows", "least squares, 10 rows", "Lyapunov"):
        print(f"regressor and {name:20s} {1e6 * (times['regressor'] + times[name]):10.2f} us")
    other = pinocchio_regressor()
    if other is not None:
        print(f"{'Pinocchio regressor':34s} {1e6 * other:10.2f} us   ratio {times['regressor'] / other:.2f}")
    factor, samples = real_time_factor()
    print(f"{'compiled engine, least squares':34s} {factor:10.0f} times real time ({samples} samples/s)")
    cold, warm = first_compile()
    print(f"{'process, empty cache':34s} {cold:10.1f} s")
    print(f"{'process, warm cache':34s} {warm:10.1f} s")


if __name__ == "__main__":
    main()
