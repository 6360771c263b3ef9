"""Commands and nodes as processes of their own: started, looked at, and ended by their own process id."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from flight_graph.ros.patience import at_least

ROOT = Path(__file__).resolve().parents[2]
FLIGHT = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())"]


def environment(**changes) -> dict:
    return {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", "COLUMNS": "200", **changes}


def flight(*arguments, cwd, timeout=300, **changes) -> subprocess.CompletedProcess:
    """Run a command to its end, within a time that grows with FLIGHT_TIMEOUT_S."""
    return subprocess.run([*FLIGHT, *map(str, arguments)], cwd=cwd, env=environment(**changes), capture_output=True,
                          text=True, timeout=at_least(timeout))


def start(*arguments, cwd, stderr=subprocess.PIPE, process_group=0, **changes) -> subprocess.Popen:
    """Start a command in a process group of its own, or in a given one."""
    return subprocess.Popen([*FLIGHT, *map(str, arguments)], cwd=cwd, env=environment(**changes), text=True,
                            stdout=subprocess.PIPE, stderr=stderr, process_group=process_group, preexec_fn=_hear_interrupts)


def _hear_interrupts():
    """A test run that was started in the background ignores SIGINT, and so would all that it starts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def running(*arguments, cwd, **changes):
    """A command that runs during the block, and is ended at its end if it still does."""
    process = start(*arguments, cwd=cwd, **changes)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        try:
            process.communicate(timeout=at_least(20.0))
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def finish(process, number=signal.SIGINT, timeout=60) -> tuple[int, str, str]:
    """Ask a process to end; return its status, standard output and standard error."""
    process.send_signal(number)
    out, err = process.communicate(timeout=at_least(timeout))
    return process.returncode, out, err


def until(condition, timeout=60.0, what="it"):
    """Wait until ``condition()`` is true and return its value; fail after ``timeout`` seconds, or more by FLIGHT_TIMEOUT_S."""
    timeout = at_least(timeout)
    deadline = time.monotonic() + timeout
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited {timeout} s for {what}"
        time.sleep(0.02)
    return value


def children(pid: int) -> dict[str, int]:
    """Processes that descend from ``pid``: name -> process id."""
    parents, names = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (folder / "stat").read_text().partition("(")[2].rpartition(")")
        except OSError:
            continue
        if not rest.startswith(" Z"):
            parents[int(folder.name)], names[int(folder.name)] = int(rest.split()[1]), name
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return {names[child]: child for child in found - {pid}}


def alive(pid: int) -> bool:
    """Whether a process still runs (a zombie does not)."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
