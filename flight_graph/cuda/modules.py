"""The code of a graph for a device: made when a campaign asks for it, kept in the cache with the other machine code."""

import ctypes
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from flight_graph.engines import cache as store
from flight_graph.engines import compilation, driver, parts
from flight_graph.engines.part_calls import parts as parts_of
from flight_graph.errors import FlightError

ENTRY = "flight"  # of the PTX
THREADS = 64  # of a block
_SOURCES = ("device_code.py", "thread.py", "../engines/part_calls.py")


@dataclass(frozen=True)
class DeviceCode:
    """ptx: for a device; twin: a function of this processor that does what a thread does; numbers: of parts, by the address
    of their machine code here.
    """

    ptx: str
    twin: object
    numbers: dict[int, int]


def load(components: dict, codes: dict, progress=None) -> DeviceCode:
    """The code of a graph's components. components: node -> (use, class); codes: node -> part -> machine code here.

    Raises FlightError.
    """
    order, numbers = {}, {}
    for node, (use, component) in components.items():
        for part in parts_of(component):
            found = order.setdefault(parts.key(component, part), (len(order) + 1, use, part))
            numbers[codes[node][part].address] = found[0]
    key = parts.digest("parts of a device", *order, driver.CODE.key, _sources())
    twin = parts.digest("their twin", key)
    for name in (key, twin):
        if store.has(name) and store.read(name) is None:  # a spoiled file: made anew
            store.remove(name)
    if not (store.has(key) and store.has(twin)):
        job = {"maker": "flight_graph.cuda.device_code:compile_graph",
               "arguments": {"key": key, "twin": twin, "parts": [(use, part) for _, use, part in order.values()]}}
        compilation.compile_jobs({"the code of the device": [job]}, progress)
    stored, code = store.read(key), parts.load_code(twin)
    if stored is None or code is None:
        raise FlightError("the code of the device cannot be read back from the cache")
    return DeviceCode(stored[0].decode(), ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 5)(code.address), numbers)


@cache
def _sources() -> str:
    here = Path(__file__).parent
    return hashlib.sha256(b"".join((here / name).read_bytes() for name in _SOURCES)).hexdigest()
