"""Runs that are kept as bags: made once, read from their bags ever after, as long as nothing that can change a bit has."""

import hashlib
import shutil
from pathlib import Path

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import open_run, versions, write_recording


class KeptRuns:
    """``kept(scenario)`` gives the signals of a run from its bag in ``folder``, where it is recorded first if need be.

    A bag of other versions, or of a working tree with changes of its own, is made again.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._versions = versions()

    def __call__(self, scenario: Scenario):
        from flight_graph.claims.claim_runs import identity
        key = hashlib.sha256(identity(scenario).encode()).hexdigest()[:16]
        path = self.folder / f"{scenario.name}-{key}"
        if path.exists():
            bag, _, signals = open_run(path)
            made = bag.metadata["flight_graph"]
            if {name: made[name] for name in self._versions} == self._versions and "-dirty" not in made["commit"]:
                return signals
            shutil.rmtree(path)
        write_recording(CompiledRun(scenario).run(), path, "compiled")
        return open_run(path)[2]
