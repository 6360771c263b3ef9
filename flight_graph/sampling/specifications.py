"""What is varied, in one word of a command line, and how it joins a vary block.

    controller.lambda_a=0.01:0.046:19        19 evenly spaced values (a key of the grid)
    controller.lambda_a=geometric:1e-3,1,4   4 values in equal ratios
    controller.law=explicit,implicit         these values
    plant.mass=normal:2,0.04                 mean, standard deviation; drawn for every run
    plant.mass=normal:2,0.04,1.9,2.1         the same between two ends (leave one empty: open)
    plant.mass=uniform:1.9,2.1               from, to; also loguniform
    plant.angles=3xuniform:-0.3,0.3          a vector: each of its three numbers is drawn by itself
    plant.law=choice:pd,p   seed=count:1
"""

import re
from dataclasses import dataclass

from pydantic import ValidationError

from flight_graph import yaml_text
from flight_graph.errors import FlightError, sentence_of
from flight_graph.sampling.distributions import Distribution, Spaced
from flight_graph.sampling.plan import Sampling
from flight_graph.text_files import short

FORMS = "KEY=FROM:TO:COUNT, KEY=A,B,C, KEY=normal:MEAN,DEVIATION, KEY=uniform:FROM,TO, ..."
_NUMBERS = {"linear": 3, "geometric": 3, "uniform": 2, "loguniform": 2, "normal": (2, 4), "count": 1, "choice": None}
_SIZE = re.compile(r"(\d{1,5})x(.+)")  # of a drawn vector


def parse_vary(text: str) -> tuple[str, list | Spaced | Distribution]:
    """(key, how it is varied) of one word: values of a grid, or a distribution. Raises FlightError."""
    key, equals, given = text.partition("=")
    where = f"--vary {short(text)}"
    if not (key and equals and given):
        raise FlightError(f"{where}: it does not say what is varied and how; allowed: {FORMS}")
    if key.endswith(".use"):  # the names of components may have a colon
        return key, _values(given, where)
    word, colon, rest = given.partition(":")
    size, word = _sized(word, where) if colon else (None, word)
    if colon and word in _NUMBERS:
        return key, _named(word, _values(rest, where), where, size)
    if colon and given.count(":") == 2:
        return key, _checked(Spaced, {"linear": _values(given.replace(":", ","), where)}, where)
    if colon and word.isidentifier():
        raise FlightError(f"{where}: there is no distribution '{short(word)}'; allowed: {', '.join(_NUMBERS)}")
    if colon:
        raise FlightError(f"{where}: evenly spaced values are FROM:TO:COUNT; allowed: {FORMS}")
    return key, _values(given, where)


def with_varied(block: dict | None, texts: list[str]) -> dict:
    """A vary block (None: there is none) in which these words take the place of what it says of their keys.

    Raises FlightError.
    """
    block, seen = {**(block or {})}, set()
    for text in texts:
        key, how = parse_vary(text)
        if key in seen:
            raise FlightError(f"--vary {short(text)}: '{short(key)}' is varied twice")
        seen.add(key)
        if any(isinstance(entry, dict) and key in entry for entry in block.get("cases") or []):
            raise FlightError(f"--vary {short(text)}: the scenario's cases set '{key}' themselves")
        for group in block.get("correlated") or []:
            if isinstance(group, dict) and key in (group.get("keys") or []):
                raise FlightError(f"--vary {short(text)}: the scenario draws '{key}' together with others")
        for part in ("grid", "one_at_a_time", "random"):
            if isinstance(block.get(part), dict):
                block[part] = {name: value for name, value in block[part].items() if name != key}
        part = "random" if isinstance(how, Distribution) else "grid"
        plain = how if isinstance(how, list) else how.model_dump(exclude_none=True, mode="json")
        block[part] = {**(block.get(part) or {}), key: plain}
    return block


@dataclass(frozen=True)
class Besides:
    """What a command line says of the draws beside a scenario's block.

    words: of --vary; seed: of the draws; plan: a name of `flight_graph.sampling.plan`, or latin_hypercube:BLOCK.
    """

    words: tuple[str, ...] = ()
    seed: int | None = None
    plan: str | None = None

    def of(self, block):
        """The block with what is said here; None where there is none, and nothing is varied. Raises FlightError."""
        if self.words:
            block = with_varied(block, list(self.words))
        if not isinstance(block, dict):
            return block  # the scenario's own check says what is wrong
        said = {} if self.seed is None else {"seed": self.seed}
        if self.plan is not None:
            name, _, size = self.plan.partition(":")
            where = f"--sampling {short(self.plan)}"
            plan = {"plan": name} | ({"block": yaml_text.parse(size, where)} if size else {})
            said["sampling"] = _checked(Sampling, plan, where).model_dump(exclude_none=True)
        return {**block, **said}


def _sized(word, where) -> tuple[int | None, str]:
    """How many numbers a drawn vector has, and the distribution of each: ``3xuniform``."""
    found = _SIZE.fullmatch(word)
    if found and found[2] in ("linear", "geometric", "count"):
        raise FlightError(f"{where}: {found[2]} has no size; a vector is drawn: {found[1]}xuniform, {found[1]}xnormal, ...")
    return (int(found[1]), found[2]) if found else (None, word)


def _named(word, values, where, size=None):
    wanted = _NUMBERS[word]
    if wanted is not None and len(values) not in ((wanted,) if isinstance(wanted, int) else wanted):
        count = wanted if isinstance(wanted, int) else " or ".join(map(str, wanted))
        raise FlightError(f"{where}: {word} takes {count} numbers, separated by commas")
    if word in ("linear", "geometric"):
        return _checked(Spaced, {word: values}, where)
    if word == "count":
        return _checked(Distribution, {word: values[0]}, where)
    of = {} if size is None else {"size": size}
    if len(values) == 4 and word == "normal":
        return _checked(Distribution, {word: values[:2], "truncated": values[2:], **of}, where)
    return _checked(Distribution, {word: values, **of}, where)


def _checked(model, data, where):
    try:
        return model.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        raise FlightError(f"{where}: {sentence_of(first)} (got {short(repr(first['input']))})") from None


def _values(text, where):
    return [yaml_text.parse(part, where) if part.strip() else None for part in text.split(",")]
