"""The workers of a Dask cluster: ``--on dask:tcp://host:8786``, with the extra [dask].

What starts a scheduler and workers (dask-jobqueue on Slurm, dask-kubernetes, or by hand) is no concern of a campaign.
"""

import time
from concurrent.futures import Future

from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.workers import Lost, part_of
from flight_graph.errors import FlightError
from flight_graph.extras import install

ANSWER_S = 10.0  # [s] that a scheduler has to answer
WORKERS_S = 60.0  # [s] that its first worker has to come, and any once all are gone


class DaskWorkers:
    """The workers that a scheduler has. Raises FlightError when nobody answers at its address, or it has no workers."""

    def __init__(self, manifest: Manifest, address: str, answer_s: float = ANSWER_S, workers_s: float = WORKERS_S):
        try:
            import distributed
        except ImportError:
            raise FlightError(f"--on dask:{address}: Dask is not installed here; {install('dask')} brings it, here and "
                              "where the workers run") from None
        self.address, self._manifest, self._killed = address, manifest, distributed.KilledWorker
        self._workers_s, self._alone_since = workers_s, None
        try:
            self._client = distributed.Client(address, timeout=answer_s, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            what = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise FlightError(f"--on dask:{address}: no Dask scheduler answers there ({what}); dask scheduler starts one, "
                              "and says its address") from None
        try:
            self._client.wait_for_workers(1, timeout=workers_s)
        except TimeoutError:
            self._client.close()
            raise FlightError(f"--on dask:{address}: the scheduler has no workers; dask worker {address} starts "
                              "one") from None

    @property
    def width(self) -> int:
        """Threads of all workers that are there now. Raises FlightError when there has been none for a while."""
        threads = sum(self._client.nthreads().values()) if self._client.status == "running" else 0
        if threads:
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = time.monotonic()
        elif time.monotonic() - self._alone_since > self._workers_s:
            raise FlightError(f"--on dask:{self.address}: the scheduler has had no worker for {self._workers_s:g} s; every "
                              "chunk that was done is kept, and the campaign goes on with --resume")
        return max(1, threads)

    def submit(self, chunk: int, earlier: bytes | None) -> Future:
        """A future of the bytes of a part; `Lost` when workers died over it."""
        made = Future()
        made.set_running_or_notify_cancel()
        asked = self._client.submit(part_of, self._manifest, chunk, earlier, pure=False, key=None)
        asked.add_done_callback(lambda done: self._hand_on(done, made))
        made.asked = asked  # Dask forgets what nobody holds
        return made

    def _hand_on(self, done, made):
        try:
            if done.status == "finished":
                made.set_result(done.result())
            elif done.status == "error":
                error = done.exception()
                is_lost = isinstance(error, self._killed)
                made.set_exception(Lost(f"{error.allowed_failures + 1} workers died over it") if is_lost else error)
            else:
                made.set_exception(FlightError(f"--on dask:{self.address}: the scheduler went away ({done.status})"))
        except Exception as error:
            made.set_exception(FlightError(f"--on dask:{self.address}: the scheduler went away ({error})"))

    def note(self) -> str:
        """Workers keep to themselves how runs flew."""
        return ""

    def close(self) -> None:
        """Let the cluster be; what is under way there ends unheard."""
        self._client.close()
