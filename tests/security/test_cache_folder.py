"""The cache folder: the user's own, no link, writable by nobody else; what lies in it is looked at before it is loaded."""

import hashlib
import os
from pathlib import Path

import pytest

from flight_graph.engines import cache
from flight_graph.errors import FlightError
from tests.security.attacks import Trap, bag, scenario

pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="no users and rights here")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    made = tmp_path / "the cache"
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(made))
    return made


@pytest.mark.parametrize("below", ["", "objects", "components"])
def test_links_strangers_and_open_folders_are_refused(folder, tmp_path, monkeypatch, below):
    place = folder / below
    place.parent.mkdir(mode=0o700, exist_ok=True)
    (tmp_path / "real").mkdir()
    place.symlink_to(tmp_path / "real")
    with pytest.raises(FlightError, match="is a link"):
        cache.cache_folder(*([below] if below else []))
    place.unlink()
    for mode in (0o777, 0o707, 0o1777):
        place.mkdir(exist_ok=True)
        place.chmod(mode)
        with pytest.raises(FlightError, match="can be written by other users") as caught:
            cache.cache_folder(*([below] if below else []))
        assert f"chmod go-w '{place}'" in str(caught.value)
    place.chmod(0o770)
    cache.cache_folder(*([below] if below else []))  # the user's own group
    monkeypatch.setattr(os, "getgid", lambda: place.stat().st_gid + 1)
    with pytest.raises(FlightError, match="can be written by other users"):
        cache.cache_folder(*([below] if below else []))


def test_new_folders_are_closed(folder):
    cache.cache_folder("objects")
    assert [path.stat().st_mode & 0o777 for path in (folder, folder / "objects")] == [0o700, 0o700]


@pytest.mark.parametrize("place", ["/proc/nowhere/cache", "/dev/null/cache", "a\0b", "x" * 300, "/dev/null"])
def test_a_folder_that_cannot_be_made_is_a_sentence(monkeypatch, tmp_path, place):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os.environ, "get", lambda name, default=None: place if name == "FLIGHT_CACHE_DIR" else default)
    with pytest.raises(FlightError, match="cannot be made .*FLIGHT_CACHE_DIR"):
        cache.cache_folder()


def test_a_user_without_a_home(monkeypatch):
    for name in ("FLIGHT_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def home():
        raise RuntimeError("Could not determine home directory.")
    monkeypatch.setattr(Path, "home", home)
    with pytest.raises(FlightError, match="no home; name one with FLIGHT_CACHE_DIR"):
        cache.cache_folder()


def test_a_planted_file_is_not_read(folder, tmp_path, monkeypatch):
    cache.write("key", b"code", {})
    path = folder / "objects" / "key.o"
    assert cache.read("key")[0] == b"code"
    good = path.read_bytes()
    for content in (b"", b"{}\ncode", b"[]\ncode", good + b"x", good.replace(b"code", b"evil"), b"\xff\n"):
        path.write_bytes(content)
        assert cache.read("key") is None, content
    path.write_bytes(good)
    path.chmod(0o666)
    assert cache.read("key") is None  # anybody could have written it, digest and all
    path.chmod(0o600)
    assert cache.read("key")[0] == b"code"
    path.rename(tmp_path / "elsewhere.o")
    path.symlink_to(tmp_path / "elsewhere.o")
    assert cache.read("key") is None
    path.unlink()
    os.mkfifo(path)
    assert cache.read("key") is None
    path.unlink()
    (tmp_path / "elsewhere.o").rename(path)
    monkeypatch.setattr(os, "getuid", lambda: path.stat().st_uid + 1)
    with pytest.raises(FlightError, match="belongs to another user"):
        cache.read("key")


def test_code_of_a_bag_replaces_what_was_planted_in_its_place(folder, tmp_path, flight):
    """A link, another content, another name's file: what runs with --trust is what the bag carries."""
    trap, other = Trap(tmp_path), Trap(tmp_path / "other")
    (tmp_path / "other").mkdir()
    data = scenario(components={"plant": {"use": "evil_law_of_a_bag.py:Law"}})
    carried = bag(tmp_path / "bag", data, {"component/plant.py": trap.text.encode()})
    place = cache.cache_folder("components") / f"evil_law_of_a_bag_{hashlib.sha256(trap.text.encode()).hexdigest()[:16]}.py"
    victim = tmp_path / "victim.txt"
    victim.write_text(other.text)
    place.symlink_to(victim)
    flight("verify", carried, "--trust")
    assert trap.ran and not other.ran and victim.read_text() == other.text
    assert not place.is_symlink() and place.read_text() == trap.text and place.stat().st_mode & 0o777 == 0o600


def test_names_of_files_in_bags_stay_in_the_folder(folder, tmp_path, flight):
    for number, use in enumerate(("../../../up.py:Law", "/etc/cron.d/x.py:Law", "..\\..\\up.py:Law", "a\nb.py:Law", "\x1b[2J.py:Law",
                                  "x" * 900 + ".py:Law", ".py:Law", "ü.py:Law")):
        trap = Trap(tmp_path)
        carried = bag(tmp_path / f"bag{number}", scenario(components={"plant": {"use": use}}),
                      {"component/plant.py": f"# {number}\n{trap.text}".encode()})
        done = flight("verify", carried, "--trust")
        assert done.status == 2 and "\x1b" not in done.err
    found = [path for path in folder.rglob("*.py")]
    assert len(found) == 8 and all(path.parent == folder / "components" for path in found)
    assert all(path.name.isascii() and len(path.name) < 100 for path in found)
