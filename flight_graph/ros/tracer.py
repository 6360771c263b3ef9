"""LTTng's tracer, which the libraries of ROS 2 load, across a fork.

It runs two threads of its own and cancels them when the process exits. A forked child has no such threads, but the first
two that it starts get their handles: an exit would cancel threads of the middleware, which can then wait for them for
ever. LTTng offers functions to be called around a fork; they start the child's own threads.
"""

import ctypes
import os
from pathlib import Path

_NAMES = (("lttng_ust_before_fork", "lttng_ust_after_fork_parent", "lttng_ust_after_fork_child"),  # since 2.13
          ("ust_before_fork", "ust_after_fork_parent", "ust_after_fork_child"))
_SIGNAL_SET = 128  # [bytes] of a sigset_t


def follow_forks() -> bool:
    """Tell the tracer of this process of every os.fork from now on; return whether there is one."""
    library = _loaded()
    if library is None:
        return False
    names = next((names for names in _NAMES if hasattr(library, names[0])), None)
    if names is None:
        return False
    signals = ctypes.create_string_buffer(_SIGNAL_SET)
    before, in_parent, in_child = (getattr(library, name) for name in names)
    os.register_at_fork(before=lambda: before(signals), after_in_parent=lambda: in_parent(signals),
                        after_in_child=lambda: in_child(signals))
    return True


def _loaded():
    """The tracer's library, if this process has it mapped."""
    for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
        path = line.split(maxsplit=5)[-1]
        if Path(path).name.startswith(("liblttng-ust.", "liblttng-ust-")) and "tracepoint" not in path:
            return ctypes.CDLL(path)
    return None
