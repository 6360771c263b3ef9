"""What kill -9 costs a campaign: coordinators, workers of a Dask cluster and tasks of a job array, killed at random.

    python benchmarks/campaign_kills.py [--kills 25] [--tasks 50] [--at-once 4] [--runs 1200] [--only dask]

Three times the same campaign (cubli_asteroid, 60 s, drawn masses): its coordinator is killed and started again; processes
of its Dask cluster are killed; 50 array tasks of which every third is killed and repeated, every fifth runs twice at once.
After each, all parts must be those of a campaign that nothing disturbed, byte for byte.
"""

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from pathlib import Path

from flight_graph.campaigns import opening
from flight_graph.campaigns.dask_workers import DaskWorkers
from flight_graph.campaigns.folder import Campaign
from flight_graph.components.foreign import refuse
from flight_graph.sampling.specifications import Besides

FLIGHT = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())", "sweep"]
PATIENCE_S = 120.0  # [s] for a process to start
VARY = ["plant.mass=normal:2,0.04", "seed=count:1"]


def campaign(folder: Path, runs: int, chunk: int):
    """A campaign that is not run yet, and its scenario."""
    return opening.of_scenario("cubli_asteroid", {}, Besides(tuple(VARY), 1), runs, chunk, lambda scenario: folder,
                               False, refuse)


def parts(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("part-*.parquet")}


def started(*words) -> subprocess.Popen:
    return subprocess.Popen([*FLIGHT, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def coordinators(folder: Path, kills: int, draw: random.Random) -> int:
    """Kill the coordinator again and again, whenever it has written another part; returns how often it was killed."""
    killed = 0
    while True:
        before, process = len(parts(folder)), started(folder, "--resume", "--workers", 2)
        if killed < kills:
            while process.poll() is None and len(parts(folder)) == before:
                time.sleep(0.005)
            time.sleep(draw.uniform(0.0, 0.2))
            if process.poll() is None:
                process.kill()
                killed += 1
        said = process.communicate()[0]
        if process.returncode == 0:
            return killed
        if process.returncode != -signal.SIGKILL:
            raise SystemExit(said)


def workers(made, scenario, kills: int, draw: random.Random) -> int:
    """Kill workers of a Dask cluster of three while they have a chunk in work, spread over the campaign, and start another
    one for each; returns how many. The campaign waits until there are two, or it would be over before."""
    import distributed
    steps, killed, alive = deque(sorted(draw.uniform(0.05, 0.9) for _ in range(kills))), 0, {}
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        def begin():
            name = f"worker-{killed + len(alive)}"
            alive[name] = subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address, "--no-nanny", "--nthreads",
                 "1", "--no-dashboard", "--name", name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def kill(done, total):
            nonlocal killed
            if not steps or done < steps[0] * total:
                return
            until = time.monotonic() + PATIENCE_S
            while sum(one.name in alive for one in list(cluster.scheduler.workers.values())) < 2:
                if time.monotonic() > until:
                    raise SystemExit(f"no second worker has started within {PATIENCE_S:g} s")
                time.sleep(0.1)
            busy = sorted(one.name for one in list(cluster.scheduler.workers.values())
                          if one.name in alive and one.processing)
            if busy:
                victim = alive.pop(draw.choice(busy))
                victim.kill()
                victim.wait()
                killed += 1
                steps.popleft()
                begin()

        for _ in range(3):
            begin()
        try:
            opening.fill(made, scenario, lambda manifest, _: DaskWorkers(manifest, cluster.scheduler_address), kill, print)
        finally:
            for process in alive.values():
                process.kill()
                process.wait()
    return killed


def tasks(folder: Path, count: int, at_once: int, draw: random.Random) -> tuple[int, int]:
    """Array tasks, of which every third is killed and repeated, every fifth runs twice at once; returns both numbers."""
    waiting, running = deque(range(count)), []
    killed, twice, again = 0, 0, set()
    while waiting or running:
        while waiting and len(running) < at_once:
            number = waiting.popleft()
            running.append((number, started(folder, "--chunk", number), time.monotonic() + draw.uniform(0.5, 4.0)))
            if number % 5 == 0 and number not in again:
                running.append((number, started(folder, "--chunk", number), None))
                twice += 1
        for one in running[:]:
            number, process, at = one
            if process.poll() is not None:
                said = process.communicate()[0]
                if process.returncode not in (0, -signal.SIGKILL):
                    raise SystemExit(said)
                running.remove(one)
            elif number % 3 == 0 and number not in again and at is not None and time.monotonic() > at:
                process.kill()
                process.communicate()
                running.remove(one)
                again.add(number)
                waiting.append(number)
                killed += 1
        time.sleep(0.02)
    return killed, twice


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=25)
    options.add_argument("--tasks", type=int, default=50)
    options.add_argument("--at-once", type=int, default=4, help="array tasks at a time")
    options.add_argument("--runs", type=int, default=1200)
    options.add_argument("--only", choices=("coordinator", "dask", "array"), help="one of the three")
    chosen = options.parse_args()
    chunk = -(-chosen.runs // chosen.tasks)
    with tempfile.TemporaryDirectory() as work:
        whole, scenario = campaign(Path(work) / "whole", chosen.runs, chunk)
        opening.fill(whole, scenario, lambda *given: opening.Threads(*given, 2))
        expected = parts(whole.path)
        print(f"{chosen.runs} runs in {len(expected)} parts of {chunk}; processes killed with kill -9, seeded moments")
        for kind in (chosen.only,) if chosen.only else ("coordinator", "dask", "array"):
            made, scenario = campaign(Path(work) / kind, chosen.runs, chunk)
            if kind == "coordinator":
                who, killed = kind, coordinators(made.path, chosen.kills, random.Random(1))
            elif kind == "dask":
                who, killed = "workers of a Dask cluster", workers(made, scenario, chosen.kills, random.Random(2))
            else:
                killed, twice = tasks(made.path, len(made.manifest.chunks), chosen.at_once, random.Random(3))
                who = f"array tasks ({len(made.manifest.chunks)}, {twice} of them twice at once)"
            report(who, killed, made, expected)


def report(who: str, killed: int, made: Campaign, expected: dict) -> None:
    """One line; ends the program when a byte differs."""
    found = parts(made.path)
    left = [path.name for path in made.path.iterdir() if path.name not in found and path.name != "campaign.json"]
    equal = found == expected and not made.missing() and not made.disagreements()
    print(f"{who}: {killed} killed; {len(found)} parts, {'all equal byte for byte' if equal else 'NOT EQUAL'}; "
          f"temporary files left: {len(left)}", flush=True)
    if not equal:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
