"""The machine code of parts that work on eight runs at once: compiled when a campaign asks for it, kept in the cache."""

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from flight_graph.components.component import Component
from flight_graph.engines import cache as store
from flight_graph.engines import compilation, parts, part_calls
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


def load(components: dict[str, tuple[str, type[Component], Ranges]], progress=None) -> dict[str, Wide]:
    """node -> its wide parts, compiled where they are not in the cache. components: node -> (use, class, what differs).

    Raises FlightError.
    """
    for again in (False, True):
        _compile({} if not again else _spoiled(components), components, progress)
    return {node: _load(component, differs) for node, (_, component, differs) in components.items()}


def _parts(component):
    return [part for part in part_calls.parts(component) if part != "start"]


def _compile(spoiled, components, progress):
    jobs = {}
    for use, component, differs in components.values():
        for part in _parts(component):
            name = key(component, part, differs)
            if name in spoiled:
                store.remove(name)
            if not store.has(name):
                job = {"wide": use, "part": part, "key": name, "differs": differs}
                if job not in jobs.setdefault(use, []):
                    jobs[use].append(job)
    if not lane_driver.is_ready():
        jobs["the driver of lanes"] = [{"lane_driver": lane_driver.key()}]
    if jobs:
        compilation.compile_jobs(jobs, progress)


def _spoiled(components):
    return {name for _, component, differs in components.values() for part in _parts(component)
            if store.read(name := key(component, part, differs)) is None}


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
