"""The requirements of a vehicle: what it has to do, in numbers, and by which runs that is shown.

``scenarios/requirements/<vehicle>.yaml``, or a file of one's own:

    title: Requirements of the asteroid lander
    source: ours
    requirements:
      - id: LAND-010
        text: The lander touches down within 0.5 m of its site.
        because: The site is a mark of 1 m.
        metric: lateral_m
        limit: {at_most: 0.5}              # or another of `flight_graph.claims.relation`
        unit: m                            # of the limit; it has to be the metric's
        shown_by:
          - run: {scenario: lander_nominal}                    # also set, case, cases, as in the claims tables
          - campaign: {scenario: lander_monte_carlo, runs: 300, share: 0.99, confidence: 0.9}
        waived: One sentence.              # it is known not to be met; left out when there is nothing to waive

A run shows a requirement when its metric keeps the limit, in each of its cases. A campaign shows it when, with the
confidence that is given, at least that share of all runs keeps the limit (`flight_graph.requirements.evidence`). Several
entries under ``shown_by`` have to hold together.
"""

from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flight_graph import yaml_text
from flight_graph.claims.claim_runs import RunEntry
from flight_graph.claims.relation import Relation
from flight_graph.errors import FlightError, sentence_of, unknown
from flight_graph.text_files import short

SUFFIXES = (".yaml", ".yml")
LARGEST_CAMPAIGN = 1_000_000  # [runs]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class CampaignEntry(_Strict):
    """Many runs: at least ``share`` of all that could be drawn keeps the limit, with this confidence (one-sided).

    vary: what is drawn, in place of the scenario's own block.
    """

    scenario: str
    set: dict[str, Any] = Field(default_factory=dict)
    vary: dict[str, Any] | None = None
    runs: int = Field(ge=1, le=LARGEST_CAMPAIGN)
    share: float = Field(gt=0.0, lt=1.0)
    confidence: float = Field(gt=0.5, lt=1.0)


class Showing(_Strict):
    """How a requirement is shown: by a run, or by a campaign."""

    run: RunEntry | None = None
    campaign: CampaignEntry | None = None

    @model_validator(mode="after")
    def _one(self):
        if (self.run is None) == (self.campaign is None):
            raise ValueError("a requirement is shown by a run or by a campaign: give one of the two")
        return self

    @property
    def scenario(self) -> str:
        """The scenario of the run or of the campaign."""
        return (self.run or self.campaign).scenario


class Requirement(_Strict):
    """One requirement."""

    id: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60)
    text: str = Field(min_length=1, max_length=1000)
    because: str = Field("", max_length=1000)
    metric: str = Field(min_length=1, max_length=200)
    limit: Relation
    unit: str | None = None
    shown_by: list[Showing] = Field(min_length=1, max_length=100)
    waived: str | None = Field(None, min_length=1, max_length=1000)


class RequirementsFile(_Strict):
    """The file's keys. folder, name: where it stands, and what it is called."""

    title: str
    source: str = ""
    requirements: list[Requirement] = Field(min_length=1, max_length=10_000)

    @model_validator(mode="after")
    def _unique(self):
        identifiers = [one.id for one in self.requirements]
        twice = sorted({name for name in identifiers if identifiers.count(name) > 1})
        if twice:
            raise ValueError(f"the id {twice[0]} stands twice")
        return self


def available() -> dict[str, Path]:
    """Names of the requirements that come with the packages, and their files."""
    folder = Path(str(resources.files("scenarios"))) / "requirements"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def is_requirements(target: str) -> bool:
    """Whether a word of the command line names requirements: a YAML file, or a vehicle that has some."""
    return Path(target).suffix in SUFFIXES or target in available()


def read(name_or_path: str) -> tuple[RequirementsFile, Path]:
    """Read and check requirements; scenarios that are files stand beside theirs. Raises FlightError."""
    path = Path(name_or_path)
    if path.suffix not in SUFFIXES:
        known = available()
        if name_or_path not in known:
            raise unknown("requirements", name_or_path, known)
        path = known[name_or_path]
    data = yaml_text.read(path)
    if not isinstance(data, dict):
        raise FlightError(f"{path}: requirements are a mapping of keys: {', '.join(RequirementsFile.model_fields)}")
    if "components" in data:
        raise FlightError(f"{path}: this is a scenario, not requirements; flight list {path} shows it")
    try:
        found = RequirementsFile.model_validate(data)
    except ValidationError as error:
        raise FlightError(f"{path}: {_sentence(error, data)}") from None
    for requirement in found.requirements:
        for showing in requirement.shown_by:
            entry = showing.run or showing.campaign
            if Path(entry.scenario).suffix in SUFFIXES:
                entry.scenario = str(path.parent / entry.scenario)
    return found, path


def chosen(content: RequirementsFile, only: list[str] | None, where: str) -> list[Requirement]:
    """The requirements with these ids, all when there are none. Raises FlightError."""
    known = [one.id for one in content.requirements]
    for name in only or []:
        if name not in known:
            raise unknown("requirement", name, known, where)
    return [one for one in content.requirements if not only or one.id in only]


def _sentence(error: ValidationError, data) -> str:
    """The first thing that is wrong, with the requirement's id where there is one."""
    first = error.errors()[0]
    where = ".".join(map(str, first["loc"]))
    entries = data.get("requirements")
    if len(first["loc"]) > 1 and isinstance(first["loc"][1], int) and isinstance(entries, list):
        entry = entries[first["loc"][1]]
        where += f" ({short(str(entry['id']), 60)})" if isinstance(entry, dict) and "id" in entry else ""
    if first["type"] == "extra_forbidden":
        return f"{where}: there is no such key; allowed: {', '.join(_keys_at(first['loc'][:-1]))}"
    got = "" if isinstance(first["input"], dict | list) else f" (got {short(repr(first['input']))})"
    return f"{where}{': ' if where else ''}{sentence_of(first)}{got}"


def _keys_at(location) -> list[str]:
    last = [part for part in location if isinstance(part, str)]
    model = {"requirements": Requirement, "limit": Relation, "shown_by": Showing, "run": RunEntry,
             "campaign": CampaignEntry}.get(last[-1] if last else "", RequirementsFile)
    return [info.alias or name for name, info in model.model_fields.items()]
