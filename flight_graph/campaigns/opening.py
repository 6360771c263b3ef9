"""Making and opening a campaign for work: a new one of a scenario, the one in a folder, some of its chunks."""

import contextlib
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numba

from flight_graph.campaigns import coordinator
from flight_graph.campaigns.cases import Batch
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.manifest import FILE, Manifest, checked_runs
from flight_graph.campaigns.run import ChunkRunner
from flight_graph.campaigns.workers import Threads, compile_first
from flight_graph.components.foreign import Consent
from flight_graph.engines.choice import check_engine
from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs.scenario import Scenario
from flight_graph.sampling.specifications import Besides
from flight_graph.text_files import short

_CHUNKS = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")


def is_folder(text: str) -> bool:
    """Whether a word of the command line means a campaign's folder."""
    return os.path.isdir(text) or os.path.isfile(os.path.join(text, FILE))


def refuse_what_is_fixed(given: dict) -> None:
    """Refuse options that decide what a campaign is: of a folder they are decided. Raises FlightError."""
    for option, value in given.items():
        if value is not None and value != []:
            raise FlightError(f"{option}: the campaign in the folder has this fixed; a new one begins with flight sweep "
                              "SCENARIO")


def existing(folder: Path, runs: int | None, consent: Consent) -> tuple[Campaign, Scenario]:
    """The campaign in a folder, checked to be of the code that is here; extended to ``runs``. Raises FlightError."""
    campaign = Campaign.at(folder)
    scenario = campaign.manifest.load(consent)
    return _extended(campaign, scenario, runs), scenario


def of_scenario(name: str, given: dict, besides: Besides, runs: int | None, chunk: int | None,
                folder: Callable[[Scenario], Path], resume: bool, consent: Consent) -> tuple[Campaign, Scenario]:
    """The campaign of a scenario: a new folder, or with ``resume`` the one that is there, which must be of this scenario.

    given: what was set by hand, by key; besides: what the command line varies; chunk: runs in one; folder: says where, of a
    scenario that is valid. Raises FlightError.
    """
    scenario = varied(name, given, besides, consent)
    check_engine(scenario, "compiled")
    metrics.of(scenario)  # a name that is wrong is found before the flight
    if resume:
        out = folder(scenario)
        campaign = Campaign.at(out)
        asked = Manifest.of(scenario, runs or campaign.manifest.runs, campaign.manifest.chunk, given)
        if found := asked.differences(campaign.manifest):
            raise FlightError(f"--resume: the campaign in {out} is another one: {short('; '.join(found[:8]), 2000)}")
        if chunk not in (None, campaign.manifest.chunk):
            raise FlightError(f"--chunk-size {chunk}: the campaign in {out} has chunks of {campaign.manifest.chunk} runs")
        if asked.vary.get("until") != campaign.manifest.vary.get("until"):
            vary = {**campaign.manifest.vary, "until": asked.vary.get("until")}
            campaign = _saved(campaign, replace(campaign.manifest, vary=vary, ended=None))
        return _extended(campaign, scenario, runs), scenario
    manifest = Manifest.of(scenario, runs, chunk, given)
    return _begun(folder(scenario), manifest), scenario


def varied(name: str, given: dict, besides: Besides, consent: Consent) -> Scenario:
    """A scenario with what the command line varies besides. Raises FlightError."""
    data, origin, folder = scenarios.read(name, given, consent)
    return Scenario({**data, "vary": besides.of(data.get("vary"))}, origin, folder)


def _extended(campaign, scenario, runs):
    if runs is None or runs == campaign.manifest.runs:
        return campaign
    checked_runs(scenario, runs)
    return _saved(campaign, campaign.manifest.extended(runs, scenario))


def _begun(folder, manifest):
    """A new campaign. Where its manifest cannot be written, no folder is left that holds none."""
    is_new = not folder.exists()
    campaign = Campaign(coordinator.folder_of(folder), manifest)
    try:
        return _saved(campaign, manifest)
    except FlightError:
        if is_new:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


def _saved(campaign, manifest):
    manifest.save(campaign.path)
    return replace(campaign, manifest=manifest)


def fill(campaign: Campaign, scenario: Scenario, make_pool, progress=None, tell=lambda sentence: None) -> Campaign:
    """Run what is missing of a campaign. make_pool(manifest, scenario): who runs it. Raises FlightError."""
    if numba.config.DISABLE_JIT:
        raise FlightError("a sweep runs on the compiled engine; unset NUMBA_DISABLE_JIT")

    def pool():
        compile_first(scenario, campaign.manifest.runs)
        return make_pool(campaign.manifest, scenario)

    return coordinator.complete(campaign, pool, progress, tell)


def run_here(scenario: Scenario, folder: Path, runs: int | None = None, workers: int | None = None,
             chunk: int | None = None, progress=None) -> Campaign:
    """A new campaign of a scenario in a folder, run by threads of this process. Raises FlightError."""
    manifest = Manifest.of(scenario, runs, chunk)
    campaign = _begun(Path(folder), manifest)
    return fill(campaign, scenario, lambda *given: Threads(*given, workers or os.cpu_count() or 1), progress)


def chunk_numbers(text: str, manifest: Manifest) -> list[int]:
    """The chunks that ``N`` or ``N-M`` means. Raises FlightError."""
    found = _CHUNKS.fullmatch(text)
    if not found:
        raise FlightError(f"--chunk {short(text)}: write a number, N, or several, N-M")
    first, last = int(found[1]), int(found[2] or found[1])
    for number in (first, last):
        manifest.cases(number)
    if last < first:
        raise FlightError(f"--chunk {text}: the last chunk comes before the first")
    return list(range(first, last + 1))


def run_chunks(campaign: Campaign, scenario: Scenario, numbers: list[int], resume: bool, tell,
               batch: Batch | None = None) -> list[dict]:
    """Run chunks in this process, for a job array: one that is there is run again and must be equal, or, with ``resume``,
    left as it is. Returns of each its number, its part and what came of it. batch: as of `ChunkRunner`. Raises FlightError.
    """
    runner, done = None, []
    for number in numbers:
        path, cases = campaign.part(number), campaign.manifest.cases(number)
        outcome, earlier = "done", None
        try:
            known = campaign.read_part(number)
            if known.rows == len(cases) and resume:
                done.append({"chunk": number, "part": str(path), "outcome": "there already"})
                continue
            earlier = known.table if known.rows < len(cases) else None
            outcome = "done again, equal" if earlier is None else "completed"
        except FileNotFoundError:
            pass
        except coordinator.Damaged as error:
            coordinator.put_aside(campaign, number)
            tell(f"{error}; its cases are run again")
        runner = runner or ChunkRunner(campaign.manifest, scenario, batch=batch)
        coordinator.publish(campaign, number, runner.part(number, earlier=earlier), tell)
        done.append({"chunk": number, "part": str(path), "outcome": outcome})
    return done
