"""The machine code of parts that work on eight runs at once: compiled when a campaign asks for it, kept in the cache."""

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from flight_graph.components.component import Component
from flight_graph.engines import cache as store
from flight_graph.engines import compilation, part_calls, parts
from flight_graph.lanes import lane_driver

Ranges = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Wide:
    """The wide form of a component's parts. codes: part -> machine code; refused: why there is none, in words."""

    codes: dict[str, parts.Code]
    refused: str = ""


@cache
def key(component: type[Component], part: str, differs: Ranges) -> str:
    """Fingerprint of the machine code of a wide part. differs: (begin, end) of the parameters that lanes have of their own.
    """
    layouts = [repr(dtype) for dtype, _ in part_calls.records(component, part)]
    return parts.digest("wide part", parts.key(component, part), *layouts, repr(differs), _sources())


@cache
def _sources():
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if path.stem not in ("batch", "lane_driver", "wide_parts"):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def differing(records: list[np.ndarray]) -> Ranges:
    """(begin, end) of the fields that are not the same in all of these (1,) records."""
    dtype, rows = records[0].dtype, np.stack([record.view(np.uint8).reshape(-1) for record in records])
    unlike = (rows != rows[0]).any(0)
    fields = [(dtype.fields[name][1], dtype.fields[name][1] + dtype.fields[name][0].itemsize) for name in dtype.names]
    return tuple((begin, end) for begin, end in sorted(fields) if unlike[begin:end].any())


Asked = dict[str, tuple[str, type[Component], Ranges]]  # node -> use, class, parameters that differ


def missing(asked: Asked) -> list[dict]:
    """What the compiler is to do before the parts that are asked for are in the cache: jobs of its."""
    jobs = {}
    for use, component, differs in asked.values():
        for part in _parts(component):
            name = key(component, part, differs)
            if not store.has(name):
                jobs[name] = {"maker": "flight_graph.lanes.lane_code:compile_part",
                              "arguments": {"use": use, "part": part, "key": name, "differs": differs}}
    return list(jobs.values())


def load(asked: Asked, progress=None) -> dict[str, Wide]:
    """node -> its wide parts, compiled where they are not in the cache. Raises FlightError."""
    _compile(asked, progress)
    for _, component, differs in asked.values():
        for part in _parts(component):
            if store.read(name := key(component, part, differs)) is None:  # a spoiled file: made anew
                store.remove(name)
    _compile(asked, progress)
    return {node: _load(component, differs) for node, (_, component, differs) in asked.items()}


def _parts(component):
    return part_calls.fired(component)


def _compile(asked, progress):
    jobs = {}
    for job in missing(asked):
        jobs.setdefault(job["arguments"]["use"], []).append(job)
    if not lane_driver.CODE.is_ready():
        jobs["the driver of lanes"] = [{"maker": "flight_graph.lanes.lane_code:compile_driver", "arguments": {}}]
    if jobs:
        compilation.compile_jobs(jobs, progress)


_LOADED = {}


def _load(component, differs) -> Wide:
    codes = {}
    for part in _parts(component):
        name = key(component, part, differs)
        if name not in _LOADED:
            _, about = store.read(name)
            _LOADED[name] = about["refused"] or parts.load_code(name)
        if isinstance(_LOADED[name], str):
            return Wide({}, f"{part}: {_LOADED[name]}")
        codes[part] = _LOADED[name]
    return Wide(codes)
