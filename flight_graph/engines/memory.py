"""Whether the log of a run fits into memory, asked before it is made."""

import os
from pathlib import Path

from flight_graph.errors import FlightError
from flight_graph.text_files import size_text

COPIES = 2  # the log itself, and its wire form when the bag is written
_UNKNOWN = 4 << 30  # [bytes] taken to be free where it cannot be asked
_GROUPS = (("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
           ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"))


def refuse_too_long(log_bytes: int, what: str) -> None:
    """Refuse a log of so many bytes where it will not fit. Raises FlightError."""
    free = free_bytes()
    if COPIES * log_bytes > free:
        kept = f"{size_text(log_bytes)} of messages, and {size_text(free)} of memory are free"
        raise FlightError(f"{what} would keep {kept}; run it for a shorter time, or record less "
                          "(record: {topics: [...], max_rate_hz: ..., checkpoint_period_s: ...})")


def free_bytes() -> int:
    """Memory that this process may still take."""
    limits = [_free_of_machine(), *_free_of_group(), *_free_of_process()]
    return max(0, min(limits))


def _free_of_machine():
    try:
        lines = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) << 10 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, StopIteration):
        pass
    if not hasattr(os, "sysconf"):
        return _UNKNOWN
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError):
        return _UNKNOWN


def _free_of_group():
    """What the container leaves."""
    for limit, used in _GROUPS:
        try:
            yield int(Path(limit).read_text(encoding="utf-8")) - int(Path(used).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue


def _free_of_process():
    """What the limits of the process leave (ulimit -v)."""
    try:
        import resource
    except ImportError:
        return
    try:
        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
            yield limit - pages * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return
