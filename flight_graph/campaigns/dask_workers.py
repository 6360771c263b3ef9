"""The workers of a Dask cluster: ``--on dask:tcp://host:8786``, with the extra [dask].

What starts a scheduler and workers (dask-jobqueue on Slurm, dask-kubernetes, or by hand) is no concern of a campaign.
"""

from concurrent.futures import Future

from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.workers import Lost, part_of
from flight_graph.errors import FlightError

ANSWER_S = 10.0  # [s] that a scheduler has to answer
WORKERS_S = 30.0  # [s] that its first worker has to come


class DaskWorkers:
    """The workers that a scheduler has. Raises FlightError when nobody answers at its address, or it has no workers."""

    def __init__(self, manifest: Manifest, address: str, answer_s: float = ANSWER_S, workers_s: float = WORKERS_S):
        try:
            import distributed
        except ImportError:
            raise FlightError(f"--on dask:{address}: Dask is not installed here; pip install 'flight_graph[dask]' brings "
                              "it, here and where the workers run") from None
        self.address, self._manifest, self._killed = address, manifest, distributed.KilledWorker
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
        """Threads of all workers that are there now."""
        return max(1, sum(self._client.nthreads().values())) if self._client.status == "running" else 1

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
                made.set_exception(Lost(str(error)) if isinstance(error, self._killed) else error)
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
