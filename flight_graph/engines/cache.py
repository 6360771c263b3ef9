"""The cache folder: object code in files, each with a digest that is checked before the code is loaded."""

import hashlib
import json
import os
import stat
import tempfile
from pathlib import Path

from flight_graph.errors import FlightError


def cache_folder(*parts: str) -> Path:
    """Where machine code is kept (a folder in it): $FLIGHT_CACHE_DIR or the user's cache folder. Raises FlightError.

    Code from there is run, so it must be a folder of this user.
    """
    root = os.environ.get("FLIGHT_CACHE_DIR")
    if root is None:
        root = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "flight_graph"
    folder = Path(root)
    _make(folder)
    for part in parts:
        folder = folder / part
        _make(folder)
    return folder


def _make(folder: Path):
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise FlightError(f"the cache folder '{folder}' cannot be made ({(error.strerror or str(error)).lower()}); name "
                          "another one with FLIGHT_CACHE_DIR") from None
    if stat.S_ISLNK(found.st_mode):
        raise FlightError(f"the cache folder '{folder}' is a link, and machine code from it is run; name the real folder "
                          "with FLIGHT_CACHE_DIR")
    if hasattr(os, "getuid") and found.st_uid != os.getuid():
        raise FlightError(f"the cache folder '{folder}' belongs to another user (number {found.st_uid}), and machine code "
                          "from it is run; name a folder of your own with FLIGHT_CACHE_DIR")


def _path(key: str) -> Path:
    return cache_folder("objects") / f"{key}.o"


def has(key: str) -> bool:
    """Whether object code is there under a key."""
    return _path(key).is_file()


def write(key: str, code: bytes, about: dict) -> None:
    """Keep object code under a key, with what is to be known about it, in one step."""
    head = json.dumps({**about, "sha256": hashlib.sha256(code).hexdigest()}).encode()
    path = _path(key)
    handle, draft = tempfile.mkstemp(".tmp", key[:8], path.parent)
    with os.fdopen(handle, "wb") as file:
        file.write(head + b"\n" + code)
    try:
        os.replace(draft, path)
    except PermissionError:  # on Windows, while another process reads what is there: it has the same key
        os.unlink(draft)
        if read(key) is None:
            raise


def read(key: str) -> tuple[bytes, dict] | None:
    """Object code and what is known about it; None where there is none, or where its digest is wrong."""
    try:
        data = _path(key).read_bytes()
        head, _, code = data.partition(b"\n")
        about = json.loads(head)
        digest = about["sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (code, about) if hashlib.sha256(code).hexdigest() == digest else None


def remove(key: str) -> None:
    """Take what is under a key out of the cache."""
    _path(key).unlink(missing_ok=True)
