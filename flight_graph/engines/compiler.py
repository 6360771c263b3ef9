"""The process that compiles: jobs come in on standard input, object code goes into the cache folder.

    python -P -m flight_graph.engines.compiler [PROCESS ID OF WHO ASKS]

One JSON object a line. A job: {"use": a component's name, "part":, "key":, "check_bounds":}, {"driver": its key},
{"kept": a kernel over arrays, "key":}, or {"maker": ``module:function``, which does it, "arguments":}. An answer to
each, in order: {"seconds":} or {"refused": a sentence} or {"error": a text}.
"""

import importlib
import json
import os
import signal
import sys
import time
import traceback

import numba

from flight_graph.components import registry
from flight_graph.engines import cache, driver, object_code, part_calls, parts
from flight_graph.engines.child_process import die_with_parent
from flight_graph.engines.compile_errors import translated
from flight_graph.errors import FlightError


def compile_part(component, part: str, key: str, about: str) -> None:
    """Compile a part into the cache."""
    symbol = parts.symbol(key)
    fault = component.state.dtype.fields["fault"][1]
    count = len(part_calls.records(component, part)) - 2
    kernel = getattr(component, part)
    with translated(component, part):
        arguments = part_calls.compiled_arguments(component, part)
        code, errors = object_code.part_code(kernel, arguments, count, symbol, fault)
    cache.write(key, code, {"what": about, "symbol": symbol, "errors": errors})


def compile_kept(name: str, key: str) -> None:
    """Compile a kernel over arrays (`flight_graph.engines.kept`) into the cache. name: ``module:attribute``."""
    symbol, (module, _, attribute) = parts.symbol(key), name.partition(":")
    found = getattr(importlib.import_module(module), attribute)
    code = object_code.function_code(found.entry(), found.signature, symbol)
    cache.write(key, code, {"what": name, "symbol": symbol, "errors": {}})


def work(job: dict) -> None:
    """Do one job. Raises what goes wrong."""
    numba.config.BOUNDSCHECK = int(job.get("check_bounds", False))
    if "driver" in job:
        driver.CODE.compile()
        return
    if "kept" in job:
        compile_kept(job["kept"], job["key"])
        return
    if "maker" in job:
        module, _, name = job["maker"].partition(":")
        getattr(importlib.import_module(module), name)(**job["arguments"])
        return
    component = registry.component(job["use"])
    if parts.key(component, job["part"], job["check_bounds"]) != job["key"]:
        raise FlightError(f"{job['use']}: its file has changed since this run began; run it again")
    compile_part(component, job["part"], job["key"], f"{job['use']} {job['part']}")


def answer(job: dict) -> dict:
    """Do one job; the answer to it."""
    began, usual = time.perf_counter(), numba.config.BOUNDSCHECK
    try:
        work(job)
    except FlightError as error:
        return {"refused": str(error)}
    except Exception:
        return {"error": traceback.format_exc()}
    finally:
        numba.config.BOUNDSCHECK = usual
    return {"seconds": time.perf_counter() - began}


def main() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that asked ends this one
    die_with_parent(int(sys.argv[1]) if len(sys.argv) > 1 else None,
                    getattr(signal, "SIGKILL", signal.SIGTERM))
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what components print does not go among the answers
    object_code.install()
    for line in sys.stdin:
        answers.write(json.dumps(answer(json.loads(line))) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
