"""What a sweep varies: the ``vary:`` block of a scenario, and the values that case number K has.

    vary:
      cases:                                   # variants that change several values together
        - {name: slow, controller.lambda_a: 0.029, controller.lambda_u: 0.029}
        - {name: fast, controller.lambda_a: 0.046, controller.lambda_u: 0.046}
      grid:                                    # every combination of these values
        controller.rate_hz: [20, 50, 100]
        plant.gravity: {geometric: [8.0e-5, 2.0e-3, 5]}
      random:                                  # drawn anew for every run
        plant.initial_angles: {uniform: [-0.3, 0.3], size: 3}
        plant.mass: {normal: [2.0, 0.04]}
        seed: {count: 20201}
      correlated:                              # drawn together, by a covariance
        - {keys: [plant.length, plant.width], mean: [0.3, 0.2], covariance: [[1.0e-4, 5.0e-5], [5.0e-5, 1.0e-4]]}
      runs: 200                                # draws for each combination of cases and grid
      seed: 7                                  # of the draws
      sampling: independent                    # where they lie, see `flight_graph.sampling.plan`
      until: {metric: landed, half_width: 0.01}   # enough runs, see `flight_graph.statistics.stopping`

Besides ``grid`` there are ``fraction`` (some of its points) and ``one_at_a_time``: `flight_graph.sampling.combinations`.
A key is ``component.parameter``, ``component.rate_hz``, ``component.use``, ``faults.ID.key``, ``seed`` or ``duration_s``.
The combinations (cases outermost, one value at a time innermost) are numbered first: case K is combination K mod C with
draw K div C. A draw is a pure function of (plan, seed, key, draw number), so case K has the same values whatever ran
before it and however many runs there are, and all combinations meet the same draws.
"""

from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError, field_validator

from flight_graph.components import functions
from flight_graph.errors import FlightError, sentence_of, unknown
from flight_graph.faults import fault_file
from flight_graph.faults.report import REPORT
from flight_graph.sampling.combinations import combinations, levels
from flight_graph.sampling.correlated import Correlated
from flight_graph.sampling.distributions import Cone, Distribution, Spaced, Strict
from flight_graph.sampling.plan import Sampling, SamplingKey
from flight_graph.sampling.sampler import Sampler
from flight_graph.statistics.stopping import Until
from flight_graph.text_files import short

TOP_LEVEL = ("seed", "duration_s")
MOST_RUNS = 1_000_000  # of a sweep
_ALTERNATIVES = ("Spaced",)
_MODELS = {"random": Distribution, "correlated": Correlated, "sampling": Sampling, "until": Until}


class VaryFile(Strict):
    """The keys of the block.

    function: ``module:name`` or ``file.py:name`` of f(draw number, seed) -> {key: value}, for joint draws.
    """

    cases: list[dict[str, Any]] = Field(default_factory=list)
    grid: dict[str, list[Any] | Spaced] = Field(default_factory=dict)
    fraction: dict[str, list[str]] = Field(default_factory=dict)
    one_at_a_time: dict[str, list[Any] | Spaced] = Field(default_factory=dict)
    random: dict[str, Distribution] = Field(default_factory=dict)
    correlated: list[Correlated] = Field(default_factory=list)
    function: str | None = None
    runs: int = Field(1, ge=1, le=MOST_RUNS)
    seed: int = Field(0, ge=-2**63, lt=2**63)
    sampling: SamplingKey = Field(default_factory=Sampling)
    until: Until | None = None

    @field_validator("grid", "one_at_a_time")
    @classmethod
    def _some(cls, grid):
        for key, values in grid.items():
            if values == []:
                raise ValueError(f"'{key}' has no values")
        return grid


class Vary:
    """A checked ``vary:`` block. combinations: the fixed part of the cases, as (name, {key: value}).

    Its function is loaded and called when values are asked for, not before.
    """

    def __init__(self, data: dict, origin: str, folder: Path | None = None):
        self.origin, self._folder = origin, folder
        try:
            self.file = VaryFile.model_validate(data)
        except ValidationError as error:
            raise FlightError(f"{origin}: {_sentence(error)}") from None
        file = self.file
        names = [entry.get("name") for entry in file.cases]
        for name in names:
            if names.count(name) > 1 and name is not None:
                raise FlightError(f"{origin}: vary.cases: two cases are called '{name}'")
        try:
            self.combinations = combinations(file.cases, file.grid, file.fraction, file.one_at_a_time)
        except ValueError as error:
            raise FlightError(f"{origin}: vary: {error}") from None
        if self.count > MOST_RUNS:
            raise FlightError(f"{origin}: vary: {len(self.combinations)} combinations, each run {file.runs} times; "
                              f"allowed: {MOST_RUNS} runs in one sweep")
        self._keys()
        try:
            self.sampler = Sampler(file.sampling, file.random, file.correlated, file.seed)
        except ValueError as error:
            raise FlightError(f"{origin}: vary.sampling: {error}") from None
        if file.function:
            functions.check_there(file.function, f"{origin}: vary.function")

    @property
    def is_random(self) -> bool:
        return bool(self.file.random or self.file.correlated or self.file.function)

    @property
    def count(self) -> int:
        """How many cases there are."""
        return len(self.combinations) * self.file.runs

    def declared_keys(self) -> list[str]:
        """What the file says is varied, in its order; what its function varies besides is not known here."""
        keys = dict.fromkeys(key for entry in self.file.cases for key in entry if key != "name")
        return list(keys | dict.fromkeys([*self.file.grid, *self.file.one_at_a_time])) + self.sampler.keys

    def keys(self) -> list[str]:
        """Everything that is varied, in the order of the file; what the function varies is seen in draw 0."""
        return self.declared_keys() + list(self._drawn_together(0))

    def name(self, case: int) -> str | None:
        """The variant's name, where the block has cases."""
        return self.combinations[case % len(self.combinations)][0]

    def draw_number(self, case: int) -> int:
        return case // len(self.combinations)

    def overrides(self, case: int) -> dict[str, Any]:
        """The values of case K by key. Raises FlightError when there is no such case."""
        if self.is_random and case >= MOST_RUNS * len(self.combinations):
            raise FlightError(f"{self.origin}: there is no case {case}; the cases are 0 to "
                              f"{MOST_RUNS * len(self.combinations) - 1}")
        if case < 0 or (case >= self.count and not self.is_random):
            raise FlightError(f"{self.origin}: there is no case {case}; the cases are 0 to {self.count - 1}")
        number, values = self.draw_number(case), dict(self.combinations[case % len(self.combinations)][1])
        values.update(self.sampler.draw(number))
        values.update(self._drawn_together(number))
        return values

    def check(self, scenario) -> None:
        """Refuse keys and fixed values that the components of the scenario do not have."""
        keys, first = self.declared_keys(), self.sampler.draw(0)
        uses = {key.removesuffix(".use") for key in keys if key.endswith(".use")}
        for key in keys:
            reached, path = scenario.reach(key)
            name, _, parameter = path.partition(".")
            whole, nodes = key.removesuffix(f".{parameter}"), reached.graph.nodes
            if not parameter:
                if path not in (TOP_LEVEL if reached is scenario else ("seed",)):
                    raise FlightError(f"{self.origin}: vary: '{key}' cannot be varied; allowed: component.parameter, "
                                      "component.rate_hz, component.use, faults.ID.key, seed, duration_s, and of a vehicle "
                                      "all but duration_s, with its name in front")
            elif name == REPORT:
                for value in self._values(key, first):
                    fault_file.override(reached.file.faults, parameter, value, f"{self.origin}: vary: {key}")
            elif name not in nodes:
                raise unknown("component", whole, scenario.graph.nodes, f"{self.origin}: vary: {key}")
            elif whole not in uses and parameter not in ("rate_hz", "use"):
                for value in self._values(key, first):
                    nodes[name].component.parameters.validate({parameter: value}, f"{self.origin}: vary: {whole}")

    def alike(self, scenario) -> dict[str, int]:
        """Vectors of parameters for which one number is drawn: key -> how many entries take it."""
        found, first = {}, self.sampler.draw(0)
        for key in self.file.random:
            reached, path = scenario.reach(key)
            name, _, parameter = path.partition(".")
            known = reached.graph.nodes[name].values.get(parameter) if name in reached.graph.nodes else None
            if isinstance(known, (list, tuple)) and len(known) > 1 and isinstance(first[key], (int, float)):
                found[key] = len(known)
        return found

    def _values(self, key, first):
        """The fixed values of a key, each once where it can be; of a drawn one the first draw."""
        if key in first:
            return [first[key]]
        return [*levels(self.file.grid.get(key, [])), *levels(self.file.one_at_a_time.get(key, [])),
                *(entry[key] for entry in self.file.cases if key in entry)]

    def _drawn_together(self, number) -> dict:
        """What the function gives for a draw. Raises FlightError."""
        if not self.file.function:
            return {}
        where = f"{self.origin}: vary.function"
        function = functions.load(self.file.function, where, self._folder)
        try:
            found = function(number, self.file.seed)
        except FlightError:
            raise
        except Exception as error:  # it is the user's own code
            what = f"{type(error).__name__}: {short(str(error))}"
            raise FlightError(f"{where}: '{self.file.function}' raises {what}") from error
        if not isinstance(found, dict) or not all(isinstance(key, str) for key in found):
            raise FlightError(f"{where}: '{self.file.function}' returns {short(repr(found))}; it returns {{key: value}}")
        return found

    def _keys(self):
        seen = {}
        parts = {"cases": {key: None for entry in self.file.cases for key in entry}, "grid": self.file.grid,
                 "one_at_a_time": self.file.one_at_a_time, "random": self.file.random}
        parts |= {f"correlated.{number}": dict.fromkeys(group.keys) for number, group in enumerate(self.file.correlated)}
        for part, keys in parts.items():
            for key in keys:
                if seen.setdefault(key, part) != part:
                    raise FlightError(f"{self.origin}: vary: '{key}' is varied twice, in {seen[key]} and in {part}")
        if self.file.runs > 1 and not self.is_random:
            raise FlightError(f"{self.origin}: vary.runs: {self.file.runs} equal runs of each case make no sense; "
                              "name what is drawn under vary.random (such as seed: {count: 1})")
        if not seen and not self.file.function:
            raise FlightError(f"{self.origin}: vary: nothing is varied; give cases, grid, one_at_a_time, random, "
                              "correlated or function")
        if self.file.sampling.plan != "independent" and not (self.file.random or self.file.correlated):
            raise FlightError(f"{self.origin}: vary.sampling: {self.file.sampling.plan} has nothing to place; it goes with "
                              "random or correlated")
        if self.file.until and not (self.is_random and self.file.sampling.plan == "independent"):
            raise FlightError(f"{self.origin}: vary.until: an interval of a rate needs independent draws (random, "
                              "correlated or function, with sampling: independent)")
        if self.file.sampling.plan == "saltelli" and self.file.function:
            raise FlightError(f"{self.origin}: vary.sampling: saltelli exchanges the values of each key; what a function "
                              "draws cannot be exchanged")


def _sentence(error: ValidationError) -> str:
    def depth(found):  # of two readings of one value (a list, or a Spaced), the one that it was meant to be
        return sum(any(name in str(part) for name in _ALTERNATIVES) for part in found["loc"]), -len(found["loc"])

    first = max(error.errors(), key=depth)
    where = ".".join(["vary", *(str(part) for part in first["loc"] if "[" not in str(part) and part not in _ALTERNATIVES
                                and part != "float")])
    if first["type"] == "extra_forbidden":
        model = VaryFile if len(first["loc"]) == 1 else Spaced if "Spaced" in str(first["loc"]) else (
            Cone if "cone" in first["loc"] else _MODELS[first["loc"][0]])
        return f"{where}: there is no such key; allowed here: {', '.join(model.model_fields)}"
    return f"{where}: {sentence_of(first)} (got {short(repr(first['input']))})"
