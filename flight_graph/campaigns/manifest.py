"""campaign.json: all that decides the rows of a campaign, and how many there are to be.

``scenario`` (the file's data with what was set by hand; ``resolved`` is the same with every parameter written out),
``vary`` (what is varied, the seed and the plan of the draws), ``code`` (fingerprints, `flight_graph.campaigns.code`) and
``chunk`` are the campaign's identity: a part belongs to the campaign whose identity it carries. ``runs``, ``ended`` and
``vary.until`` (a stopping rule; ``runs`` is then the most) say how far it goes, and may change while it lives.
"""

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from flight_graph.campaigns import code
from flight_graph.campaigns.chunk import MOST_ROWS, write_durably
from flight_graph.components.foreign import Consent
from flight_graph.errors import FlightError, sentence_of
from flight_graph.graphs.named_code import foreign_code
from flight_graph.graphs.scenario import Scenario
from flight_graph.graphs.vary import MOST_RUNS
from flight_graph.text_files import parse_json, read_bytes

FILE = "campaign.json"
FORMAT = 1
LARGEST = 64 << 20  # [bytes] of the file
CHUNKS = 32  # that a campaign has at least, where its runs allow it
LARGEST_CHUNK = 1000  # [runs] by itself


@dataclass(frozen=True)
class Manifest:
    """What campaign.json holds. folder: of the scenario's file, where relative names start."""

    name: str
    scenario: dict
    vary: dict
    resolved: dict
    code: dict
    chunk: int  # [runs]
    runs: int
    combinations: int = 1  # fixed parts of the cases: case K is combination K mod combinations
    origin: str = ""
    folder: str = ""
    set_by_hand: dict | None = None
    ended: dict | None = None  # {"runs": n, "sentence": ...} once the rule has ended it
    made_with: dict | None = None  # versions, for people

    @classmethod
    def of(cls, scenario: Scenario, runs: int | None = None, chunk: int | None = None,
           set_by_hand: dict | None = None) -> "Manifest":
        """The campaign of a scenario with a ``vary`` block. Raises FlightError.

        runs: default, as the block says; chunk: runs in one part, by default so many that there are some dozens of parts.
        """
        if scenario.vary is None:
            raise FlightError(f"{scenario.origin}: there is nothing to sweep; a 'vary' block says what is varied, or "
                              "--vary component.parameter=VALUES")
        clash = sorted(set(scenario.vary.keys()) & set(set_by_hand or {}))
        if clash:
            raise FlightError(f"{scenario.origin}: '{clash[0]}' is varied by the sweep; it cannot be set as well")
        runs = checked_runs(scenario, runs)
        if chunk is not None and not 1 <= chunk <= MOST_ROWS:
            raise FlightError(f"--chunk-size {chunk}: allowed: 1 to {MOST_ROWS} runs")
        plain = json.loads(json.dumps({
            "scenario": scenario.file.model_dump(by_alias=True, exclude_none=True, exclude={"vary"}),
            "vary": scenario.file.vary, "resolved": scenario.resolved(), "set_by_hand": set_by_hand or {}}, default=str))
        return cls(scenario.name, code=code.fingerprints(scenario), chunk=chunk or chunk_of(runs), runs=runs,
                   combinations=len(scenario.vary.combinations), origin=scenario.origin,
                   folder=str(scenario.folder.resolve()) if scenario.folder else "", made_with=_versions(), **plain)

    @cached_property
    def identity(self) -> str:
        """SHA-256 of what decides the rows."""
        vary = {key: value for key, value in self.vary.items() if key not in ("runs", "until")}
        decides = {"format": FORMAT, "resolved": self.resolved, "scenario": self.scenario, "vary": vary, "code": self.code,
                   "chunk": self.chunk}
        return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()

    @property
    def rows(self) -> int:
        """How many rows the campaign has when it is whole."""
        return self.runs if self.ended is None else self.ended["runs"]

    @property
    def chunks(self) -> range:
        """The numbers of the chunks up to ``runs``."""
        return range(-(-self.runs // self.chunk))

    def cases(self, chunk: int) -> range:
        """The case numbers of a chunk. Raises FlightError when there is no such chunk."""
        if chunk not in self.chunks:
            raise FlightError(f"--chunk {chunk}: this campaign has the chunks 0 to {len(self.chunks) - 1} ({self.runs} "
                              f"runs, {self.chunk} in each)")
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.runs))

    def load(self, consent: Consent) -> Scenario:
        """The scenario with its vary block, checked to be that of the campaign. Raises FlightError.

        consent: is asked before code runs that does not come with the packages.
        """
        folder = Path(self.folder) if self.folder else None
        data = {**self.scenario, "vary": self.vary}
        if found := foreign_code(data, folder):
            consent(f"the campaign of {self.name}", found)
        scenario = Scenario(data, self.origin or self.name, folder)
        wrong = code.differences(self.code, code.fingerprints(scenario))
        if wrong:
            raise FlightError(f"the campaign of {self.name} was begun with other code: {', '.join(wrong)} differ"
                              f"{'s' if len(wrong) == 1 else ''} here; its rows would not be of one kind. Go back to that "
                              f"code{self._where_code()}, or begin a new campaign")
        return scenario

    def _where_code(self):
        commit = (self.made_with or {}).get("commit")
        return f" (commit {commit})" if commit and commit != "unknown" else ""

    def differences(self, other: "Manifest") -> list[str]:
        """What another campaign has otherwise, in words; runs, stopping rule and size of the chunks are not looked at."""
        found = [f"the scenario is {other.name} there and {self.name} here"] if self.name != other.name else []
        found += _unlike("", {**other.resolved, "name": ""}, {**self.resolved, "name": ""})
        mine, theirs = ({key: value for key, value in one.vary.items() if key not in ("runs", "until")}
                        for one in (self, other))
        found += _unlike("vary.", theirs, mine)
        return found + [f"the code of {name}" for name in code.differences(self.code, other.code)]

    def extended(self, runs: int, scenario: Scenario) -> "Manifest":
        """The same campaign with more runs. Raises FlightError."""
        if runs < self.runs:
            raise FlightError(f"--runs {runs}: this campaign has {self.runs} runs already; it can be extended, not cut")
        return replace(self, runs=checked_runs(scenario, runs), ended=self.ended if runs == self.runs else None)

    def save(self, folder: Path) -> None:
        """Write campaign.json, whole. Raises FlightError."""
        data = {"format": FORMAT, **asdict(self)}
        text = json.dumps({**data, "sha256": _digest(data)}, indent=1)
        write_durably(folder / FILE, text.encode() + b"\n")

    @classmethod
    def read(cls, folder: Path) -> "Manifest":
        """The manifest of a campaign's folder. Raises FlightError."""
        where = f"{folder / FILE}"
        if not (folder / FILE).is_file():
            raise FlightError(f"{folder} holds no campaign ({FILE} is missing)")
        data = parse_json(read_bytes(folder / FILE, where, LARGEST), where, LARGEST)
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise FlightError(f"{where}: this is no campaign of this program (format {FORMAT})")
        said = data.pop("sha256", None)
        if said != _digest(data):
            raise FlightError(f"{where} is damaged: it is not what was written (its sha256 differs)")
        data.pop("format")
        try:
            _Stored.model_validate(data)
        except ValidationError as error:
            wrong = error.errors()[0]
            raise FlightError(f"{where}: this is no campaign of this program: {'.'.join(map(str, wrong['loc']))}: "
                              f"{sentence_of(wrong)}") from None
        return cls(**data)


class _Ended(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")
    runs: int = Field(ge=1, le=MOST_RUNS)
    sentence: str


class _Stored(BaseModel):
    """What a file may hold that somebody else has written."""

    model_config = ConfigDict(strict=True, extra="forbid")
    name: str
    scenario: dict
    vary: dict
    resolved: dict
    code: dict[str, str]
    chunk: int = Field(ge=1, le=MOST_ROWS)
    runs: int = Field(ge=1, le=MOST_RUNS)
    combinations: int = Field(ge=1, le=MOST_RUNS)
    origin: str
    folder: str
    set_by_hand: dict | None
    ended: _Ended | None
    made_with: dict | None


def checked_runs(scenario: Scenario, runs: int | None) -> int:
    """How many runs a campaign has. Raises FlightError."""
    vary = scenario.vary
    if runs is None:
        return vary.count
    if not 1 <= runs <= MOST_RUNS:
        raise FlightError(f"--runs {runs}: allowed: 1 to {MOST_RUNS} in one sweep")
    if runs > vary.count and not vary.is_random:
        raise FlightError(f"--runs {runs}: allowed: 1 to {vary.count}, the number of cases; nothing is random here")
    return runs


def chunk_of(runs: int) -> int:
    """Runs in a chunk: a round number, so that there are some dozens of chunks, and none is long."""
    steps = [digit * 10**power for power in range(3) for digit in (1, 2, 5)] + [LARGEST_CHUNK]
    return max([step for step in steps if step * CHUNKS <= runs], default=1)


def _digest(data) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _unlike(prefix, there, here) -> list[str]:
    """The keys below which two trees of data differ, with both values."""
    found = []
    for key in dict.fromkeys([*there, *here]):
        one, other = there.get(key), here.get(key)
        if isinstance(one, dict) and isinstance(other, dict):
            found += _unlike(f"{prefix}{key}.", one, other)
        elif one != other:
            found.append(f"{prefix}{key} is {json.dumps(one)} there and {json.dumps(other)} here")
    return found


def _versions() -> dict:
    from flight_graph.recordings.recording import versions
    return versions()
