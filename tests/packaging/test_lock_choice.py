"""requirements/install.sh takes the lock with ROS where its wheels run, and says what it does elsewhere."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

INSTALL = Path(__file__).resolve().parents[2] / "requirements" / "install.sh"
LOCK = f"requirements/python3.{sys.version_info[1]}"


@pytest.mark.skipif(shutil.which("bash") is None, reason="make setup needs bash")
@pytest.mark.parametrize("system, machine, libc, lock, sentence", [
    ("linux", "x86_64", ("glibc", "2.36"), "-ros.txt", "Jazzy from wheels"),
    ("linux", "x86_64", ("glibc", "2.27"), ".txt", "glibc 2.28 or newer"),
    ("linux", "x86_64", ("", ""), ".txt", "all but the ROS executor works"),
    ("linux", "aarch64", ("glibc", "2.36"), ".txt", "all but the ROS executor works"),
])
def test_lock(tmp_path, system, machine, libc, lock, sentence):
    """The Python that is asked believes to be on another machine, and makes no environment."""
    script = tmp_path / "requirements" / "install.sh"
    script.parent.mkdir()
    shutil.copy(INSTALL, script)
    (tmp_path / "sitecustomize.py").write_text(
        f"import platform, sys\nsys.platform = {system!r}\nplatform.machine = lambda: {machine!r}\n"
        f"platform.libc_ver = lambda: {libc!r}\n", encoding="utf-8")
    (tmp_path / "venv.py").write_text("if __name__ == '__main__':\n    raise SystemExit(7)\n", encoding="utf-8")
    environment = {key: value for key, value in os.environ.items() if key not in ("ROS_DISTRO", "ROS")}
    done = subprocess.run(["bash", script, sys.executable], encoding="utf-8", capture_output=True,
                          env={**environment, "PYTHONPATH": str(tmp_path)})
    assert done.returncode == 7, done.stderr
    assert done.stdout.rstrip().endswith(f"packages of {LOCK}{lock}") and sentence in done.stdout
