"""The recorder on Windows, played here: no fcntl, locks of byte ranges, no removing of files that are open.

The stand-in for msvcrt takes locks of an open file description (F_OFD_SETLK), which exclude each other as those do.
"""

import os
import struct
import sys
import types
from pathlib import Path

import pytest

from flight_graph.bags import disk
from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter
from msg_schemas.cubli import IMU

fcntl = pytest.importorskip("fcntl", reason="the stand-in for Windows' locks is made of Linux's")
if not hasattr(fcntl, "F_OFD_SETLK"):
    pytest.skip("the stand-in for Windows' locks is made of Linux's", allow_module_level=True)


def locking(file, mode, count):
    kind = fcntl.F_RDLCK if fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY else fcntl.F_WRLCK
    start = os.lseek(file, 0, os.SEEK_CUR)
    fcntl.fcntl(file, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", kind, os.SEEK_SET, start, count, 0))


@pytest.fixture
def windows(monkeypatch):
    unlink = Path.unlink

    def refuse_open(path, missing_ok=False):
        for file in os.listdir("/proc/self/fd"):
            try:
                if os.path.samefile(f"/proc/self/fd/{file}", path):
                    raise PermissionError(13, "The process cannot access the file", str(path))
            except FileNotFoundError:
                continue
        unlink(path, missing_ok)

    monkeypatch.setattr(disk, "fcntl", None)
    monkeypatch.setattr(disk, "ON_WINDOWS", True)
    monkeypatch.setitem(sys.modules, "msvcrt", types.SimpleNamespace(locking=locking, LK_NBLCK=2))
    monkeypatch.setattr(Path, "unlink", refuse_open)


def test_a_bag_is_recorded_and_its_mark_goes(tmp_path, windows):
    with BagWriter(tmp_path / "hop") as writer:
        topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
        for stamp in range(500):
            writer.write(topic, stamp, IMU.template)
        writer.flush()
        assert disk.is_locked(tmp_path / "hop" / "RECORDING")
        with pytest.raises(BagError, match="still being recorded"):
            read_bag(tmp_path / "hop")
    assert not (tmp_path / "hop" / "RECORDING").exists()
    assert len(read_bag(tmp_path / "hop")["/cubli/imu"]) == 500


def test_an_abandoned_bag_is_free_again(tmp_path, windows):
    writer = BagWriter(tmp_path / "hop")
    writer.abandon()
    assert (tmp_path / "hop" / "RECORDING").exists()
    assert not disk.is_locked(tmp_path / "hop" / "RECORDING")
    assert not disk.is_locked(tmp_path / "nowhere")
