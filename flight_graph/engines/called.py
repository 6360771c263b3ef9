"""Functions of the engines that are called by address, with whole numbers: their machine code in the cache.

All of one `Called` have one fingerprint, that of the sources which decide their code.
"""

import ctypes
import hashlib
from functools import cached_property
from pathlib import Path

from flight_graph.engines import cache as store
from flight_graph.engines import parts
from flight_math.kernel import library


class Called:
    """what: one word for the fingerprint; functions: name -> (function, its numba signature of int64); sources: files.

    below: the functions of which these call some.
    """

    def __init__(self, what: str, functions: dict, sources: list[Path], below: "Called | None" = None):
        self.sources, self._what, self._functions, self._below = tuple(sources), what, functions, below
        self._codes = {}

    @cached_property
    def key(self) -> str:
        """Fingerprint of the machine code."""
        texts = hashlib.sha256(b"".join(path.read_bytes() for path in self.sources)).hexdigest()
        return parts.digest(self._what, *([self._below.key] if self._below else []), texts, library())

    def name(self, function: str) -> str:
        """The key of a function's machine code in the cache."""
        return f"{self.key}_{function}"

    def is_ready(self) -> bool:
        """Whether the machine code lies in the cache."""
        return all(store.has(self.name(function)) for function in self._functions)

    def is_loadable(self) -> bool:
        """Whether the machine code can be read from the cache."""
        return all(parts.load_code(self.name(function)) is not None for function in self._functions)

    def forget_spoiled(self) -> None:
        """Take spoiled machine code out of the cache."""
        for function in self._functions:
            if parts.load_code(self.name(function)) is None:
                store.remove(self.name(function))

    def compile(self) -> None:
        """Compile the functions into the cache: in a process that compiles."""
        from flight_graph.engines import object_code
        for function, (compiled, signature) in self._functions.items():
            symbol = parts.symbol(self.name(function))
            store.write(self.name(function), object_code.function_code(compiled, signature, symbol),
                        {"what": f"{function} of {self._what}", "symbol": symbol, "errors": {}})

    def address(self, function: str) -> int:
        """Where the machine code of a function lies."""
        return parts.load_code(self.name(function)).address

    def function(self, name: str):
        """A function that is called with integers; it releases the GIL."""
        if name not in self._codes:
            arguments = [ctypes.c_int64] * len(self._functions[name][1].args)
            self._codes[name] = ctypes.CFUNCTYPE(ctypes.c_int64, *arguments)(self.address(name))
        return self._codes[name]
