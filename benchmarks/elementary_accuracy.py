"""The elementary functions: largest and mean error in units of the last place, and nanoseconds beside the C library's.

    python benchmarks/elementary_accuracy.py [--count 1000000] [--processes N] [--only sin log ...] [--no-speed]

Errors are against mpmath (120 bits). "chain": each argument waits for the result before it, as in a control law; "loop":
the arguments are independent, as in a table. Times are medians of interleaved rounds of thread time.
"""

import argparse
import math
import multiprocessing
import os
import sys
import time
from pathlib import Path

import numba
import numpy as np
from rich.progress import Progress

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_math import elementary
from tests.flight_math import elementary_cases as cases

PIECE = 20_000  # arguments of one task
STEPS, ROUNDS = 20_000, 21
SCALE = {"log": (0.1, 1.3), "exp": (-0.3, -0.1), "power": (0.3, 0.4)}  # next argument = a * result + b
OTHERS = (0.3, 0.2)


def worst(task):
    """(name, range, arguments, largest error, sum of errors, how many above 0.5) of one piece."""
    name, label, columns = task
    function = getattr(elementary, name)
    errors = np.array([cases.error(name, function(*row), row) for row in zip(*(column.tolist() for column in columns))])
    return name, label, len(errors), errors.max(), errors.sum(), int((errors > 0.5).sum())


def pieces(names, count):
    for name in names:
        for label, columns in cases.ranges(name, count):
            for start in range(0, len(columns[0]), PIECE):
                yield name, label, tuple(column[start:start + PIECE] for column in columns)


def accuracy(names, count, processes):
    found = {}
    total = sum(-(-len(columns[0]) // PIECE) for name in names for _, columns in cases.ranges(name, count))
    with multiprocessing.Pool(processes) as pool, Progress(transient=True) as progress:
        bar = progress.add_task("errors", total=total)
        for name, label, number, largest, summed, above in pool.imap(worst, pieces(names, count)):
            entry = found.setdefault((name, label), [0, 0.0, 0.0, 0])
            entry[0] += number
            entry[1] = max(entry[1], largest)
            entry[2] += summed
            entry[3] += above
            progress.update(bar, advance=1, description=f"{name:6s} {label}")
    print(f"{'function':9s} {'range':24s} {'arguments':>9s} {'largest':>8s} {'mean':>6s} {'> 0.5':>6s}   [ulp]")
    for (name, label), (number, largest, summed, above) in found.items():
        print(f"{name:9s} {label:24s} {number:9d} {largest:8.3f} {summed / number:6.3f} {above / number:6.1%}")


def library(name):
    """The C library's function, compiled by numba."""
    namespace = {"math": math, "np": np}
    call = {"sincos": "math.sin(x), math.cos(x)", "atan2": "math.atan2(x, y)", "hypot": "math.hypot(x, y)",
            "power": "math.pow(x, y)", "cbrt": "np.cbrt(x)"}.get(name, f"math.{name}(x)")
    exec(f"def function(x{', y' if 'y' in call.replace('hypot', '') else ''}): return {call}", namespace)
    return numba.njit(error_model="numpy")(namespace["function"])


def loops(name, function):
    """(chain, loop) over a function."""
    compiled = numba.njit(error_model="numpy", nogil=True)
    if name == "sincos":
        one = compiled(lambda x: function(x)[0] + function(x)[1])
    elif name in cases.PAIRS:
        one = compiled(lambda x: function(x, 0.7))
    else:
        one = function

    @compiled
    def chain(steps, a, b, x):
        for _ in range(steps):
            x = one(x) * a + b
        return x

    @compiled
    def loop(arguments, found):
        for i in range(len(arguments)):
            found[i] = one(arguments[i])

    return chain, loop


def speed(names):
    jobs = {}
    with Progress(transient=True) as progress:
        for name in progress.track(names, description="compiling"):
            a, b = SCALE.get(name, OTHERS)
            arguments = b + a * np.random.default_rng(0).uniform(-1.0, 1.0, STEPS)
            found = np.empty(STEPS)
            for origin, function in (("library", library(name)), ("own", getattr(elementary, name))):
                chain, loop = loops(name, function)
                chain(1, a, b, 0.1)
                loop(np.abs(arguments) + 0.01, found)
                jobs[name, "chain", origin] = lambda chain=chain, a=a, b=b: chain(STEPS, a, b, 0.1)
                jobs[name, "loop", origin] = lambda loop=loop, x=np.abs(arguments) + 0.01, found=found: loop(x, found)
        times = {key: [] for key in jobs}
        for _ in progress.track(range(ROUNDS), description="timing"):
            for key, job in jobs.items():
                start = time.thread_time_ns()
                job()
                times[key].append((time.thread_time_ns() - start) / STEPS)
    middle = {key: float(np.median(values)) for key, values in times.items()}
    titles = "".join(f" {kind + ': library':>15s} {'own':>6s} {'ratio':>6s}" for kind in ("chain", "loop"))
    print(f"\n{'ns a call':9s}{titles}   (load {os.getloadavg()[0]:.1f})")
    for name in names:
        row = f"{name:9s}"
        for kind in ("chain", "loop"):
            theirs, own = middle[name, kind, "library"], middle[name, kind, "own"]
            row += f" {theirs:15.1f} {own:6.1f} {own / theirs:6.2f}"
        print(row)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1_000_000, help="arguments of each function")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--only", nargs="*", default=elementary.__all__, choices=elementary.__all__)
    parser.add_argument("--no-speed", action="store_true")
    options = parser.parse_args()
    accuracy([name for name in options.only if name in cases.NAMES], options.count, options.processes)
    if not options.no_speed:
        speed(options.only)


if __name__ == "__main__":
    main()
