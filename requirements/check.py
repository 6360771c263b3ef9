"""Shows for each platform and Python whether every package of its lock has a wheel with a hash of the lock.

    python requirements/check.py [PLATFORM ...]

Asks the package index through pip (it downloads some hundred megabytes a platform, into a folder that goes away), so it
stands in no test. Exit status: 0 every package of every platform is there, 1 some are not, 2 a name is no platform.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from packaging.requirements import Requirement

FOLDER = Path(__file__).resolve().parent
PYTHONS = ("3.11", "3.12")
KINDS = ("", "-test", "-pinocchio", "-view", "-docs")  # of locks that have the same versions
GLIBC = (5, 12, 17, 24, 26, 27, 28, 31, 34, 35)  # minor versions of the wheels that a Linux of 2022 takes


def _linux(machine):
    tags = [f"manylinux_2_{minor}_{machine}" for minor in reversed(GLIBC)] + [f"manylinux2014_{machine}"]
    return tags, {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix", "platform_machine": machine}


def _macos(machine, newest):
    return [f"macosx_{newest}_0_{machine}"], {
        "sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix", "platform_machine": machine}


def _windows(machine, tag):
    return [tag], {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": machine}


PLATFORMS = {  # name -> (tags of wheels, markers)
    "linux-x86_64": _linux("x86_64"),
    "linux-aarch64": _linux("aarch64"),
    "macos-arm64": _macos("arm64", 14),
    "macos-x86_64": _macos("x86_64", 14),
    "windows-x86_64": _windows("AMD64", "win_amd64"),
}


def needed(lock: Path, python: str, markers: dict[str, str]) -> list[str]:
    """The entries of a lock that a platform installs, each with its hashes and without its marker."""
    environment = {**markers, "python_version": python, "python_full_version": f"{python}.9",
                   "implementation_name": "cpython", "platform_python_implementation": "CPython"}
    entries = re.sub(r" *\\\n *", " ", lock.read_text(encoding="utf-8")).splitlines()
    found = []
    for entry in entries:
        if not entry.strip() or entry.startswith("#"):
            continue
        text, *hashes = re.split(r" (?=--hash=)", entry)
        requirement = Requirement(text.strip())
        if requirement.marker is None or requirement.marker.evaluate(environment):
            requirement.marker = None
            found.append(" ".join([str(requirement), *(piece.strip() for piece in hashes)]))
    return found


def resolve(entries: list[str], python: str, tags: list[str]) -> bool:
    """Whether pip finds a wheel with a locked hash for each entry."""
    with tempfile.TemporaryDirectory() as folder:
        wanted = Path(folder, "wanted.txt")
        wanted.write_text("\n".join(entries) + "\n", encoding="utf-8", newline="\n")
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "download", "--no-deps",
                   "--require-hashes", "--only-binary", ":all:", "--python-version", python, "--implementation", "cp",
                   "--dest", folder, *(word for tag in tags for word in ("--platform", tag)), "-r", str(wanted)]
        return subprocess.run(command, capture_output=True).returncode == 0


def missing(entries: list[str], python: str, tags: list[str]) -> list[str]:
    """Names of the packages without such a wheel."""
    if resolve(entries, python, tags):
        return []
    with ThreadPoolExecutor(4) as pool:
        found = pool.map(lambda entry: resolve([entry], python, tags), entries)
    return [entry.split()[0] for entry, there in zip(entries, found) if not there]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("platforms", nargs="*", metavar="PLATFORM", help=", ".join(PLATFORMS))
    given = options.parse_args()
    for name in given.platforms:
        if name not in PLATFORMS:
            print(f"'{name}' is no platform; allowed: {', '.join(PLATFORMS)}", file=sys.stderr)
            return 2
    holes = 0
    for name in given.platforms or PLATFORMS:
        tags, markers = PLATFORMS[name]
        for python in PYTHONS:
            locks = [FOLDER / f"python{python}{kind}.txt" for kind in KINDS]
            entries = list(dict.fromkeys(entry for lock in locks for entry in needed(lock, python, markers)))
            without = missing(entries, python, tags)
            holes += len(without)
            print(f"{name:15} Python {python}: {len(entries):3} packages, "
                  f"{'all there' if not without else 'no wheel of ' + ', '.join(without)}", flush=True)
    return 1 if holes else 0


if __name__ == "__main__":
    sys.exit(main())
