"""The end of a node's process: at once, when the middleware has left.

Taking down an interpreter with a compiler in it costs about a second of the processor. Seven nodes that are interrupted
together on a busy machine would need longer than `ros2 launch` waits before it gets rough.
"""

import gc
import os
import sys
from pathlib import Path

_SEGMENT = "/dev/shm/fastrtps_"  # mapped as long as the middleware's participant is there


def keep_imports() -> None:
    """Leave what is there now out of the last search for garbage: call before a node is made."""
    gc.collect()
    gc.freeze()


def leave(status: int) -> int:
    """End this process, with nothing left behind; only where the middleware is still there, return for an ordinary end."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    gc.collect()  # the node and its ends, which hold the participant, refer to each other
    try:
        maps = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return status
    if _SEGMENT not in maps:
        os._exit(status)
    return status
