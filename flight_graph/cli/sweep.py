"""flight sweep: a campaign of many runs of a scenario, in a folder."""

import json
import signal
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.scenarios import Json, Params, Settings, overrides
from flight_graph.cli.show import add, console, next_command, number, status, steps
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

SHOWN_FAILURES = 5
_DASK, _CUDA = "dask:", "cuda"


@dataclass(frozen=True)
class Where:
    """Who runs the chunks: threads, processes, a graphics processor, or a Dask scheduler's workers; exactly one of them, or
    none (threads). Raises FlightError, also where there is no graphics processor.
    """

    workers: int | None = None
    processes: int | None = None
    on: str | None = None
    device: object | None = None

    def __post_init__(self):
        given = [name for name, value in (("--workers", self.workers), ("--processes", self.processes), ("--on", self.on))
                 if value is not None]
        if len(given) > 1:
            raise FlightError(f"{' and '.join(given)}: allowed: one of them")
        if self.on == _CUDA:
            from flight_graph.cuda import devices
            object.__setattr__(self, "device", devices.opened())
        elif self.on is not None and not self.on.startswith(_DASK):
            raise FlightError(f"--on {self.on}: allowed: cuda, or dask:ADDRESS, such as dask:tcp://host:8786")

    def batch(self, scenario):
        """How runs of a chunk are advanced in this process; None: as it pays."""
        if self.device is None:
            return None
        from flight_graph.campaigns.cases import Batch
        from flight_graph.cuda.batch import OnDevice, width
        return Batch(width(scenario), OnDevice(self.device).advance)

    def pool(self, manifest, scenario):
        """The pool of a campaign."""
        import os

        from flight_graph.campaigns import workers
        if self.on == _CUDA:
            return workers.Threads(manifest, scenario, 1, self.batch(scenario))
        if self.on is not None:
            from flight_graph.campaigns.dask_workers import DaskWorkers
            return DaskWorkers(manifest, self.on.removeprefix(_DASK))
        if self.processes is not None:
            return workers.Processes(manifest, self.processes)
        return workers.Threads(manifest, scenario, self.workers or os.cpu_count() or 1)


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight sweep cubli_asteroid --vary plant.mass=normal:2,0.04 --runs 1000 --out mass")(
        sweep)


def sweep(
    scenario: Annotated[str, typer.Argument(
        help="A scenario's name, or a YAML file, with a 'vary' block (or --vary); or the folder of a campaign.")],
    runs: Annotated[int | None, typer.Option(
        help="Runs in all; as the scenario says when left out. Of a campaign's folder: extend it.")] = None,
    vary: Annotated[list[str] | None, typer.Option(
        metavar="KEY=VALUES", help="Vary plant.mass=normal:2,0.04 or c.gain=0.01:0.05:9 or c.angles=3xuniform:-1,1 or ...; "
                                   "may be repeated.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, max=256, help="Threads; one a core when left out.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, max=256, help="Processes in place of threads.")] = None,
    on: Annotated[str | None, typer.Option(
        metavar="cuda|dask:ADDRESS", help="A graphics processor, or the workers of a Dask scheduler.")] = None,
    settings: Settings = None,
    params: Params = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the draws.")] = None,
    sampling: Annotated[str | None, typer.Option(
        metavar="PLAN", help="Of the draws: independent, latin_hypercube:BLOCK, sobol or saltelli.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds of each run.")] = None,
    out: Annotated[Path | None, typer.Option(help="The campaign's folder (a new one, except with --resume).")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the campaign that is there.")] = False,
    plan: Annotated[bool, typer.Option("--plan", help="Make the folder, and run nothing: job arrays do.")] = False,
    chunk: Annotated[str | None, typer.Option(
        metavar="N|N-M", help="Run these chunks of a campaign's folder and end: one task of a job array.")] = None,
    chunk_size: Annotated[int | None, typer.Option(help="Runs in a chunk; by itself some dozens of chunks.")] = None,
    figure: Annotated[Path | None, typer.Option(
        help="Draw the table of faults and monitors into this PNG (of a scenario that has them).")] = None,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """Run all cases of what a scenario varies into a folder: a row for each run, the same wherever it ran.

    A campaign that was ended by anything goes on with --resume. A case is run again to a full bag, bit for bit the same, by
    its number: flight run FOLDER --case K.
    """
    from flight_graph import runs as one_run
    from flight_graph.campaigns import opening
    from flight_graph.sampling.specifications import Besides
    if chunk is not None and (workers, processes, on) not in ((None, None, None), (None, None, _CUDA)):
        raise FlightError("--chunk: chunks run in this process; of --workers, --processes and --on, --on cuda is allowed")
    where, consent = Where(workers, processes, on), asked(trust)
    if opening.is_folder(scenario):
        opening.refuse_what_is_fixed({
            "--vary": vary, "--set": settings, "--params": params, "--seed": seed, "--sampling": sampling,
            "--duration": duration, "--out": out, "--chunk-size": chunk_size, "--plan": plan or None})
        campaign, loaded = opening.existing(Path(scenario), runs, consent)
        if chunk is None and not resume and runs is None:
            raise FlightError(f"{scenario} is a campaign already: --resume goes on with it, --runs extends it, --chunk "
                              "runs chunks of it")
    else:
        if chunk is not None:
            raise FlightError("--chunk: name the folder of a campaign; flight sweep SCENARIO --out DIR --plan makes one")
        if resume and out is None:
            raise FlightError("--resume: name the campaign's folder (flight sweep FOLDER --resume), or give it with --out")
        given = overrides(scenario, settings, params, None, duration, consent)
        campaign, loaded = opening.of_scenario(
            scenario, given, Besides(tuple(vary or ()), seed, sampling), runs, chunk_size,
            lambda checked: out if resume else one_run.new_folder(out, checked, "sweep"), resume, consent)
    for key, count in loaded.vary.alike(loaded).items():
        status(f"note: {key} is one number a run, for all of its {count} entries; {count}xuniform:FROM,TO (in a file size: "
               f"{count}) draws each by itself")
    if plan:
        _planned(campaign, as_json)
    elif chunk is not None:
        _some(campaign, loaded, chunk, resume, as_json, where)
    else:
        _all(campaign, loaded, where, figure, as_json)


def _planned(campaign, as_json):
    manifest = campaign.manifest
    if as_json:
        print(json.dumps({"campaign": str(campaign.path), "runs": manifest.runs, "chunks": len(manifest.chunks),
                          "chunk_size": manifest.chunk}))
        return
    status(f"{manifest.runs} runs in {len(manifest.chunks)} chunks of {manifest.chunk}: flight sweep {campaign.path} "
           f"--chunk 0 to {len(manifest.chunks) - 1}")
    print(campaign.path)


def _some(campaign, scenario, text, resume, as_json, where):
    from flight_graph.campaigns import opening
    numbers = opening.chunk_numbers(text, campaign.manifest)
    done = opening.run_chunks(campaign, scenario, numbers, resume, status, where.batch(scenario))
    if as_json:
        print(json.dumps({"campaign": str(campaign.path), "chunks": done}))
        return
    for row in done:
        print(f"{row['part']}: {row['outcome']}")


def _all(campaign, scenario, where, figure, as_json):
    from flight_graph.bags.errors import quoted
    from flight_graph.campaigns import opening
    from flight_graph.campaigns.fault_table import draw, faults_of
    from flight_graph.campaigns.summary import ends, summary
    began = time.perf_counter()
    with steps(f"campaign of {campaign.manifest.name}", not as_json) as advance, _one_interrupt():
        try:
            campaign = opening.fill(campaign, scenario, where.pool,
                                    lambda done, total: advance(done, total, "runs"), status)
        except KeyboardInterrupt:
            raise FlightError(f"interrupted; every chunk that was done is in {quoted(campaign.path)}; go on with: flight "
                              f"sweep {quoted(campaign.path)} --resume") from None
    wall_s = time.perf_counter() - began
    found, (counted, failed), faults = summary(campaign), ends(campaign), faults_of(campaign)
    if figure is not None:
        if not faults:
            raise FlightError(f"--figure {figure}: {campaign.manifest.name} has no monitors, so there is no such table")
        draw(faults, figure)
    total, ended = sum(counted.values()), campaign.manifest.ended
    if as_json:
        print(json.dumps({
            "scenario": campaign.manifest.name, "campaign": str(campaign.path), "runs": total, "ok": counted.get("ok", 0),
            "ends": counted, "wall_s": wall_s, "metrics": found, "faults": [row.plain() for row in faults],
            "failed": failed, "ended": ended}))
        return
    console.print(_table(campaign.manifest.name, found, total, wall_s))
    if faults:
        console.print(_fault_table(faults))
    for row in failed[:SHOWN_FAILURES]:
        console.print(f"case {row['case']} ({row['status']}): {row['sentence']}", markup=False)
    if bad := total - counted.get("ok", 0):
        console.print(f"{bad} of {total} runs did not end well; the table's column 'sentence' says why")
    print(campaign.path, flush=True)
    if figure is not None:
        print(figure, flush=True)
    is_grid = len(campaign.manifest.vary.get("grid") or {}) == 1 and not scenario.vary.is_random
    next_command("plot" if is_grid else "report", campaign.path)


@contextmanager
def _one_interrupt():
    """Hear Ctrl-C once: whoever presses it again waits, while what is under way ends and nothing of it is torn."""
    usual = signal.getsignal(signal.SIGINT)

    def heard(number, frame):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        raise KeyboardInterrupt

    if usual is signal.default_int_handler:
        signal.signal(signal.SIGINT, heard)
    yield
    signal.signal(signal.SIGINT, usual)


def _fault_table(rows):
    from rich.table import Table
    table = Table("fault", "runs", "active", "detected", "missed", "isolated", "wrong", "false alarm", "delay [s]",
                  "first to act", "mode at the end", "stopped", title="faults and monitors", title_justify="left")
    for row in rows:
        plain = row.plain()
        add(table, row.name, row.runs, row.active, row.detected, row.missed, row.isolated, row.wrong, row.false_alarms,
            number(plain["median_delay_s"]), _counted(row.by), _counted(row.modes), row.stopped or "")
    return table


def _counted(counter) -> str:
    return ", ".join(f"{name} {count}" for name, count in counter.most_common())


def _table(name, found, runs, wall_s):
    from rich.table import Table
    table = Table("metric", "least", "case", "median, or how often", "largest", "case", "none in", "no number in",
                  title=f"{name}: {runs} runs in {wall_s:.3g} s", title_justify="left")
    for metric, row in found.items():
        if "counts" in row:
            cells = ["", "", ", ".join(f"{value} {count}" for value, count in row["counts"].items()) or "-", "", ""]
        else:
            cells = [number(row[key]) if key in row else "-"
                     for key in ("least", "least_case", "median", "largest", "largest_case")]
        add(table, metric, *cells, row["missing"] or "", row["not_a_number"] or "")
    return table
