"""The end of a node's process: at once, whenever it is asked to.

Taking down an interpreter with a compiler in it costs about a second of the processor, and longer on a busy machine than
`ros2 launch` waits before it gets rough. So a process that has no node yet just ends, and one that had one ends as soon as
the middleware has left.
"""

import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from flight_graph.ros import shared_memory

SIGNALS = (signal.SIGINT, signal.SIGTERM)
AGAIN = ".segment.yaml"  # files of parameters that a process has begun again with
_again = []
_SEGMENT = "/dev/shm/fastrtps_"  # mapped as long as the middleware's participant is there
_LONGEST_S = 0.5  # [s] of waiting for the middleware: a thread of its own may still hold the node


def at_once() -> None:
    """From now on SIGINT and SIGTERM end this process: nothing has begun yet that would need an end of its own."""
    for number in SIGNALS:
        signal.signal(number, lambda *_: os._exit(0))


def keep_imports() -> None:
    """Leave what is there now out of the last search for garbage: call before a node is made."""
    gc.collect()
    gc.freeze()


def begin_again(parameters: str) -> None:
    """Let this process run its command again when it leaves, with one more parameter file (named *`AGAIN`)."""
    _again.append(parameters)


def leave(status: int) -> None:
    """End this process, or begin again in it. Where the middleware does not leave in time, another process removes its
    shared memory.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    deadline = time.monotonic() + _LONGEST_S
    gc.collect()  # the node and its ends, which hold the participant, refer to each other
    while is_here := _has_middleware():
        if time.monotonic() > deadline:
            break
        time.sleep(0.02)
        gc.collect()
    if is_here:
        subprocess.Popen([sys.executable, "-P", "-E", "-S", shared_memory.__file__, str(os.getpid())],
                         start_new_session=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                         stderr=subprocess.DEVNULL)
    if _again and not status:
        _execute(_again[-1])
    os._exit(status)


def _execute(parameters):
    arguments = [text for number, text in enumerate(sys.orig_argv) if not (
        text.endswith(AGAIN) or sys.orig_argv[number:][1:2] and sys.orig_argv[number + 1].endswith(AGAIN))]
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    os.execv(sys.executable, [*arguments, "--params-file", parameters])


def _has_middleware() -> bool:
    try:
        return _SEGMENT in Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
