"""What a recorder asks of the disk, where Linux, macOS and Windows differ: new files, locks, folders made durable."""

import os
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

ON_WINDOWS = os.name == "nt"
_LOCKED_BYTE = 2**31 - 2  # Windows locks ranges of bytes, and others cannot read them: this one lies behind every end


def new_file(path: Path) -> int:
    """Make a file that is not there yet, for bytes as they are; return its descriptor. Raises OSError."""
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o644)


def write_at(file: int, data: bytes, position: int) -> None:
    """Write all of ``data`` from ``position`` on. Raises OSError."""
    os.lseek(file, position, os.SEEK_SET)
    view = memoryview(data)
    while view:
        view = view[os.write(file, view):]


def lock(file: int) -> None:
    """Take the lock of an open file; it ends when the file is closed or its process dies."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX)
    else:
        _lock_byte(file)


def is_locked(path: Path) -> bool:
    """Whether an open file of this or another process holds the lock of ``path``; False where there is no such file."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        else:
            _lock_byte(file)
    except OSError:
        return True
    finally:
        os.close(file)
    return False


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk. Windows opens no folders, and keeps their names by itself."""
    if ON_WINDOWS:
        return
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _lock_byte(file):
    """The lock of Windows; it takes effect from the position of the file on. Raises OSError where it is taken."""
    import msvcrt
    position = os.lseek(file, 0, os.SEEK_CUR)
    os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    finally:
        os.lseek(file, position, os.SEEK_SET)
