"""Filling a campaign's folder: what is missing is run, chunk by chunk, by whatever pool of workers there is.

A part is written when it is whole, by this process alone, in whatever order chunks come back. A chunk that is there already
must be the same; `Disagreement` says which machines made two of it. Nothing else is remembered: whoever opens the folder
again, after any end, goes on from what lies there.
"""

import os
import platform
import re
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, wait
from pathlib import Path

from flight_graph.campaigns.chunk import Damaged, Part, decode, digest, write_durably
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.rows import cast, unified
from flight_graph.campaigns.stopping import Looks
from flight_graph.campaigns.workers import MOST_LOST, Lost
from flight_graph.errors import FlightError

AHEAD = 2  # chunks in hand, for each that a pool runs at once
_DRAFT = re.compile(r"\..+\.(?P<host>.+)\.(?P<process>\d+)\.[0-9a-f]{8}\.tmp")


class Disagreement(FlightError):
    """Two results of one chunk that are not equal."""


def tidy(campaign: Campaign, tell: Callable[[str], None]) -> int:
    """Take away what killed processes of this machine left half written; put damaged parts aside, and say so.

    Returns how many rows there are.
    """
    for path in campaign.path.glob(".*.tmp"):
        found = _DRAFT.fullmatch(path.name)
        if found and found["host"] == platform.node() and not _lives(int(found["process"])):
            path.unlink(missing_ok=True)
    rows = 0
    for number in campaign.manifest.chunks:
        try:
            rows += campaign.read_part(number).rows
        except FileNotFoundError:
            continue
        except Damaged as error:
            put_aside(campaign, number)
            tell(f"{error}; its cases are run again")
    return rows


def put_aside(campaign: Campaign, number: int) -> None:
    """Rename a damaged part, so that it is looked at by nobody but a person."""
    os.replace(campaign.part(number), campaign.path / f"damaged-{number:06d}.parquet")


def complete(campaign: Campaign, make_pool: Callable, progress: Callable[[int, int], None] | None = None,
             tell: Callable[[str], None] = lambda sentence: None) -> Campaign:
    """Run what is missing; return the campaign as it is then. make_pool(): who runs it, see
    `flight_graph.campaigns.workers`; it is asked for where something is missing.

    progress(rows done, rows in all) is called now and then; tell(sentence) of what a person should know. Raises
    FlightError; after it, as after KeyboardInterrupt, all parts that were written are whole.
    """
    rows, looks = tidy(campaign, tell), Looks(campaign)
    if looks.verdict() is None and (missing := campaign.missing()):
        pool = make_pool()
        try:
            _fill(campaign, pool, missing, rows, looks, progress, tell)
        finally:
            pool.close()
        if note := pool.note():
            tell(note)
    return looks.close(tell)


def _fill(campaign, pool, missing, rows, looks, progress, tell):
    todo, running, lost = iter(missing), {}, {}
    while looks.verdict() is None:
        room = AHEAD * pool.width
        while len(running) < room and (number := next(todo, None)) is not None:
            running[_submit(campaign, pool, number)] = number
        if progress:
            progress(min(rows, campaign.manifest.rows), campaign.manifest.rows)
        if not running:
            break
        done, _ = wait(running, 0.2, FIRST_COMPLETED)
        for future in done:
            number = running.pop(future)
            try:
                rows += publish(campaign, number, future.result(), tell)
            except Lost as error:
                lost[number] = lost.get(number, 0) + 1
                if lost[number] >= MOST_LOST:
                    raise FlightError(f"chunk {number}: {lost[number]} workers died over it ({error}); flight sweep "
                                      f"{campaign.path} --chunk {number} runs it here, where one sees why") from None
                tell(f"chunk {number}: {error}; it is given to another one")
                running[_submit(campaign, pool, number)] = number


def _submit(campaign, pool, number):
    path = campaign.part(number)
    return pool.submit(number, path.read_bytes() if path.is_file() else None)


def publish(campaign: Campaign, number: int, content: bytes, tell: Callable[[str], None]) -> int:
    """Put a part into the folder; return by how many rows it grew. Raises Disagreement, and FlightError (disk full)."""
    path = campaign.part(number)
    if _written(path, content, replace=False):
        return len(campaign.manifest.cases(number))
    new = decode(content, f"chunk {number}")
    try:
        known = campaign.read_part(number)
    except Damaged as error:
        put_aside(campaign, number)
        tell(f"{error}; its cases were run again")
        _written(path, content)
        return new.rows
    if not _are_equal(known, new):
        other = campaign.path / f"disagreement-{number:06d}-{new.digest[:12]}.parquet"
        _written(other, content)
        raise Disagreement(f"chunk {number} came out differently a second time: {path.name} was made by {known.host} "
                           f"({known.cpu}), {other.name} by {new.host} ({new.cpu}); {_first_difference(known, new)}. One "
                           "of the machines does not compute what the other does: no row of theirs is to be trusted")
    if new.rows > known.rows:
        _written(path, content)
    return max(0, new.rows - known.rows)


def _written(path, content, replace=True) -> bool:
    return write_durably(path, content, replace, hint=": the campaign goes on with --resume")


def _are_equal(known: Part, new: Part) -> bool:
    """Whether two results of a chunk are equal, as far as both go."""
    if known.rows == new.rows:
        return known.digest == new.digest
    schema, common = unified([known.table.schema, new.table.schema]), min(known.rows, new.rows)
    one, other = (digest(cast(part.table.slice(0, common), schema)) for part in (known, new))
    return one == other


def _first_difference(known, new) -> str:
    for name in known.table.schema.names:
        if name not in new.table.schema.names:
            return f"column {name} is missing in the second"
        pairs = zip(known.table.column(name).to_pylist(), new.table.column(name).to_pylist())
        for row, (one, other) in enumerate(pairs):
            if one != other and not (one != one and other != other):
                return f"the first difference is {name} of case {known.table.column('case')[row]}: {one!r} and {other!r}"
    return "columns differ"


def _lives(process: int) -> bool:
    if os.name != "posix" or not hasattr(os, "kill"):
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OSError):
        return True
    return True


def folder_of(path: Path) -> Path:
    """A campaign's folder, made when it is not there. Raises FlightError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FlightError(f"{path} cannot be made: {(error.strerror or str(error)).lower()}") from None
    return path
