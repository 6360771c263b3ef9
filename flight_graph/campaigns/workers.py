"""Who runs the chunks: threads or processes of this machine, or the workers of a Dask cluster.

Each is a pool with ``width`` (chunks that it runs at once), ``submit(chunk, earlier)``, which gives a future of the
part's bytes, and ``note()``: what a person should know of how runs flew, at the end. No worker needs the campaign's folder:
it gets the manifest, and gives back bytes.
"""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from flight_graph.campaigns.cases import Batch
from flight_graph.campaigns.chunk import decode
from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.run import ChunkRunner
from flight_graph.components.foreign import agree
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, vary_case
from flight_graph.lanes.batch import Report

MOST_LOST = 3  # workers that may die over one chunk
_SAFE_PATH = "PYTHONSAFEPATH"


class Stopped(Exception):
    """Raised inside of a run when the work is to end."""


class Lost(Exception):
    """A worker died over a chunk; others may run it."""


class Threads:
    """Threads of this process: the machine code of a run does not hold the interpreter. batch: as of `ChunkRunner`."""

    def __init__(self, manifest: Manifest, scenario: Scenario, width: int, batch: Batch | None = None):
        self.width, self._manifest, self._scenario, self._batch = width, manifest, scenario, batch
        self._stop, self._local, self._reports = threading.Event(), threading.local(), []
        self._pool = ThreadPoolExecutor(width, "chunk")

    def submit(self, chunk: int, earlier: bytes | None) -> Future:
        """A future of the bytes of a part."""
        return self._pool.submit(self._part, chunk, earlier)

    def _part(self, chunk, earlier):
        if not hasattr(self._local, "runner"):
            self._local.runner = ChunkRunner(self._manifest, self._scenario, batch=self._batch)
            self._reports.append(self._local.runner.together.report)
        return self._local.runner.part(chunk, self._watch, _table(earlier))

    def _watch(self):
        if self._stop.is_set():
            raise Stopped

    def note(self) -> str:
        """What did not fly side by side, where other things did."""
        total = Report()
        for report in self._reports:
            total.add(report)
        return total.sentence() if total.side_by_side and total.reasons else ""

    def close(self) -> None:
        """End what is under way; its chunks are not done."""
        self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)


class Processes:
    """Processes of this machine, each with an interpreter of its own; one that dies is replaced."""

    def __init__(self, manifest: Manifest, width: int):
        self.width, self._manifest = width, manifest
        self._usual = os.environ.get(_SAFE_PATH)
        os.environ[_SAFE_PATH] = "1"  # files of the folder where one types are no modules of the processes
        self._pool = self._fresh()

    def _fresh(self):
        return ProcessPoolExecutor(self.width, multiprocessing.get_context("spawn"), _begin, (self._manifest,))

    def submit(self, chunk: int, earlier: bytes | None) -> Future:
        """A future of the bytes of a part; `Lost` when its process died."""
        made = Future()
        made.set_running_or_notify_cancel()
        try:
            inner = self._pool.submit(_part, chunk, earlier)
        except BrokenProcessPool:
            self._pool = self._fresh()
            inner = self._pool.submit(_part, chunk, earlier)
        inner.add_done_callback(lambda done: _hand_on(done, made))
        return made

    def note(self) -> str:
        """Processes keep to themselves how runs flew."""
        return ""

    def close(self) -> None:
        """End the processes; the chunks under way are not done."""
        if self._usual is None:
            os.environ.pop(_SAFE_PATH, None)
        else:
            os.environ[_SAFE_PATH] = self._usual
        processes = list((self._pool._processes or {}).values())
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()


def _hand_on(done, made):
    if done.cancelled():
        made.set_exception(Stopped())
    elif isinstance(error := done.exception(), BrokenProcessPool):
        made.set_exception(Lost("a worker process died"))
    elif error is not None:
        made.set_exception(error)
    else:
        made.set_result(done.result())


_RUNNERS = threading.local()  # of this process: identity -> ChunkRunner


def _begin(manifest):
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the coordinator hears it
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _RUNNERS.only = ChunkRunner(manifest, consent=agree)


def _end_with_parent():
    multiprocessing.parent_process().join()
    os._exit(1)


def _part(chunk, earlier):
    return _RUNNERS.only.part(chunk, None, _table(earlier))


_LOADING = threading.Lock()


def part_of(manifest: Manifest, chunk: int, earlier: bytes | None = None) -> bytes:
    """The bytes of a part: what a worker of a cluster is asked for. Raises FlightError, also when its code is other code.

    Whoever asks has seen to it that the scenario's code may run.
    """
    if getattr(_RUNNERS, "identity", None) != manifest.identity:
        with _LOADING:
            _RUNNERS.only, _RUNNERS.identity = ChunkRunner(manifest, consent=agree), manifest.identity
    return _part(chunk, earlier)


def _table(earlier):
    return None if earlier is None else decode(earlier, "the chunk so far").table


def compile_first(scenario: Scenario, runs: int) -> None:
    """Make machine code of the first case that can be built, before workers wait for each other."""
    for number in range(runs):
        try:
            CompiledRun(vary_case(scenario, number)).compile()
            return
        except FlightError:
            continue
