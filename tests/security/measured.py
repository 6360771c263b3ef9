"""Code run in a process of its own with little memory to take: what it said, how long it took, how much memory it took."""

import atexit
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
# The imports happen once; each call runs in a fork of that process, whose largest memory is counted from the fork on.
_STARTER = """
import json, os, resource, sys, time
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
from flight_graph.errors import FlightError
{imports}
def answer(call, arguments):
    before, began, found, wrong = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time(), "", ""
    sys.argv = ["", *arguments]
    try:
        exec(call, globals())
    except FlightError as error:
        found = str(error)
    except BaseException as error:
        wrong = f"{{type(error).__name__}}: {{error}}"[:2000]
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(json.dumps([found, time.process_time() - began, grown, wrong]), flush=True)
for line in sys.stdin:
    pid = os.fork()
    if pid == 0:
        answer(*json.loads(line))
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if status:
        print(json.dumps(["", 0.0, 0.0, f"it ended with {{status}}"]), flush=True)
"""
_started = {}


@dataclass
class Measured:
    """sentence: of the FlightError; cpu_s: processor time; grown: memory [MB] beyond that of the imports."""

    sentence: str
    cpu_s: float
    grown: float


def measured(imports: str, call: str, *arguments) -> Measured:
    """Run ``call`` with ``sys.argv[1:]``. Any other exception than FlightError fails."""
    if imports not in _started:
        process = _started[imports] = subprocess.Popen(
            [sys.executable, "-c", _STARTER.format(imports=imports)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            cwd=ROOT)
        atexit.register(process.kill)
    process = _started[imports]
    print(json.dumps([call, [str(argument) for argument in arguments]]), file=process.stdin, flush=True)
    *found, wrong = json.loads(process.stdout.readline())
    assert not wrong, wrong
    return Measured(*found)
