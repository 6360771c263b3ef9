"""Shared memory of Fast DDS that killed processes left behind.

A living owner holds a lock (flock) on ``fastrtps_<name>_el`` in /dev/shm. A segment whose lock file is free or gone, and
which no process maps, is a leftover: it leaks space, and with the years a full /dev/shm stops the middleware.
"""

import os
import sys
import time
from pathlib import Path

FOLDER = Path("/dev/shm")
_SETTLED_S = 1.0  # [s] a younger file may belong to a process that is just starting


def leftovers(youngest_s: float = _SETTLED_S) -> list[str]:
    """Names of this user's segments that nobody uses."""
    names = {path.name.removesuffix("_el") for path in FOLDER.glob("fastrtps_*")}
    names |= {path.name.removeprefix("sem.").removesuffix("_mutex") for path in FOLDER.glob("sem.fastrtps_*_mutex")}
    names = {name for name in names if not _is_locked(FOLDER / f"{name}_el") and _is_settled(name, youngest_s)}
    return sorted(names - _mapped()) if names else []


def clean() -> list[str]:
    """Remove them; return their names."""
    names = leftovers()
    for name in names:
        for path in _files(name):
            path.unlink(missing_ok=True)
    return names


def clean_up() -> None:
    """Remove what processes left that have just been killed: their youngest segments have to settle first."""
    deadline = time.monotonic() + 3.0 * _SETTLED_S
    clean()
    while leftovers(0.0) and time.monotonic() < deadline:
        time.sleep(0.1)
        clean()


def _files(name):
    return FOLDER / name, FOLDER / f"{name}_el", FOLDER / f"sem.{name}_mutex"


def _is_settled(name, youngest_s) -> bool:
    now, user = time.time(), os.getuid()
    for path in _files(name):
        try:
            status = path.stat()
        except FileNotFoundError:
            continue
        if status.st_uid != user or now - status.st_ctime < youngest_s:
            return False
    return True


def _is_locked(path) -> bool:
    import fcntl  # not on Windows, where this module is imported but finds nothing

    try:
        with path.open(encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


def _mapped() -> set[str]:
    """Names of the segments that any process of this machine, as far as it lets us look, has mapped."""
    found = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        try:
            text = maps.read_text(encoding="utf-8")
        except OSError:
            continue
        if "/dev/shm/" in text:
            names = (line.rpartition("/dev/shm/")[2].split(" ")[0] for line in text.splitlines() if "/dev/shm/" in line)
            found |= {name.removeprefix("sem.").removesuffix("_mutex").removesuffix("_el") for name in names}
    return found


def clean_after(pid: int) -> None:
    """Wait until a process has ended, and remove what it left."""
    deadline = time.monotonic() + 10.0
    while Path("/proc", str(pid)).exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    clean_up()


if __name__ == "__main__":
    clean_after(int(sys.argv[1]))
