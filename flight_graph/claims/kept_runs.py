"""Runs that are kept as bags: made once, read from their bags ever after, as long as nothing that can change a bit has."""

import hashlib
import shutil
from pathlib import Path

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import RunStopped
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import open_run, versions, write_recording


class KeptRuns:
    """``kept(scenario)`` gives the signals of a run from its bag in ``folder``, where it is recorded first if need be.

    A bag of other versions, of a working tree with changes of its own, or of a run that was stopped, is made again.
    trust: code that the scenarios name beyond the packages may run (it has, when they were loaded).
    """

    def __init__(self, folder, trust: bool = False):
        self.folder, self._trust = Path(folder), trust
        self.folder.mkdir(parents=True, exist_ok=True)
        self._versions = versions()

    def path(self, scenario: Scenario) -> Path:
        """Where the bag of a run is, or will be."""
        from flight_graph.claims.claim_runs import identity
        key = hashlib.sha256(identity(scenario).encode()).hexdigest()[:16]
        return self.folder / f"{scenario.name}-{key}"

    def __call__(self, scenario: Scenario):
        path = self.path(scenario)
        if path.exists():
            bag, _, signals = open_run(path, self._trust)
            made = bag.metadata["flight_graph"]
            is_whole = bag.metadata.get("flight_graph.outcome", {}).get("complete") == "true"
            if (is_whole and {name: made[name] for name in self._versions} == self._versions
                    and "-dirty" not in made["commit"]):
                return signals
            shutil.rmtree(path)
        try:
            write_recording(CompiledRun(scenario).run(), path, "compiled")
        except RunStopped as stop:
            write_recording(stop.recording, path, "compiled")
            raise
        return open_run(path, self._trust)[2]
