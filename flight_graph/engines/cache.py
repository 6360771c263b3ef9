"""The cache folder: object code in files, each with a digest that is checked before the code is loaded."""

import contextlib
import errno
import hashlib
import json
import os
import shlex
import stat
import tempfile
from pathlib import Path

from flight_graph.errors import FlightError


def cache_folder(*parts: str) -> Path:
    """Where machine code is kept (a folder in it): $FLIGHT_CACHE_DIR or the user's cache folder. Raises FlightError.

    Code from there is run, so it must be a folder of this user.
    """
    folder = _root()
    _make(folder)
    for part in parts:
        folder = folder / part
        _make(folder)
    return folder


def _root() -> Path:
    root = os.environ.get("FLIGHT_CACHE_DIR")
    if root:
        return Path(root)
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flight_graph"
    except RuntimeError:
        raise FlightError("the cache folder cannot be made, for this user has no home; name one with "
                          "FLIGHT_CACHE_DIR") from None


def _make(folder: Path):
    """Make a folder, or see that the one that is there is the user's own. Raises FlightError."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except (OSError, ValueError) as error:
        what = getattr(error, "strerror", None) or str(error)
        raise FlightError(f"the cache folder '{folder}' cannot be made ({what.lower()}); name another one with "
                          "FLIGHT_CACHE_DIR") from None
    if stat.S_ISLNK(found.st_mode):
        raise FlightError(f"the cache folder '{folder}' is a link, and machine code from it is run; name the real folder "
                          "with FLIGHT_CACHE_DIR")
    if hasattr(os, "getuid") and found.st_uid != os.getuid():
        raise FlightError(f"the cache folder '{folder}' belongs to another user (number {found.st_uid}), and machine code "
                          "from it is run; name a folder of your own with FLIGHT_CACHE_DIR")
    if hasattr(os, "getuid") and _others_write(found):
        raise FlightError(f"the cache folder '{folder}' can be written by other users, and machine code from it is run; "
                          f"take that right away (chmod go-w {shlex.quote(str(folder))}), or name another one with "
                          "FLIGHT_CACHE_DIR")


def _others_write(found: os.stat_result) -> bool:
    """Whether somebody else may write: everybody, or a group other than the user's own."""
    other_group = hasattr(os, "getgid") and found.st_gid != os.getgid()
    return bool(found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and other_group))


def _owned(path: Path) -> bytes:
    """The content of an ordinary file of this user, no link. Raises OSError."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
                     | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode) or (hasattr(os, "getuid") and (
                found.st_uid != os.getuid() or _others_write(found))):
            raise PermissionError(errno.EPERM, "the file is not the user's own", str(path))
        return file.read()


def keep(folder: Path, name: str, content: bytes) -> Path:
    """A file of this content in a folder of the cache; what is there under its name is taken only if it is the same.

    Raises FlightError.
    """
    path = folder / name
    try:
        if _owned(path) == content:
            return path
    except OSError:
        pass
    try:
        _put(path, content)
    except OSError as error:
        raise _unwritten(path, error) from None
    return path


def _unwritten(path: Path, error: OSError) -> FlightError:
    return FlightError(f"'{path}' cannot be written: {(error.strerror or str(error)).lower()}; another folder is named by "
                       "FLIGHT_CACHE_DIR")


def _put(path: Path, content: bytes) -> None:
    """Put a file in the place of whatever is there, a link included. Raises OSError."""
    handle, draft = tempfile.mkstemp(".tmp", path.stem[:8], path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(draft, path)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(draft)
        raise


def _path(key: str) -> Path:
    return cache_folder("objects") / f"{key}.o"


def has(key: str) -> bool:
    """Whether object code is there under a key."""
    return _path(key).is_file()


def write(key: str, code: bytes, about: dict) -> None:
    """Keep object code under a key, with what is to be known about it, in one step."""
    head = json.dumps({**about, "sha256": hashlib.sha256(code).hexdigest()}).encode()
    path = _path(key)
    try:
        _put(path, head + b"\n" + code)
    except PermissionError as error:  # on Windows, while another process reads what is there: it has the same key
        if read(key) is None:
            raise _unwritten(path, error) from None
    except OSError as error:
        raise _unwritten(path, error) from None


def read(key: str) -> tuple[bytes, dict] | None:
    """Object code and what is known about it; None where there is none of this user, or where its digest is wrong."""
    path = _path(key)
    try:
        data = _owned(path)
        head, _, code = data.partition(b"\n")
        about = json.loads(head)
        digest = about["sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (code, about) if hashlib.sha256(code).hexdigest() == digest else None


def remove(key: str) -> None:
    """Take what is under a key out of the cache."""
    _path(key).unlink(missing_ok=True)
