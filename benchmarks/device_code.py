"""The code of graphs for a graphics processor, without one: what is in it, and what NVIDIA's assembler makes of it.

    python benchmarks/device_code.py [SCENARIO ...] [--ptxas PATH] [--arch sm_90]

Of each scenario: parts, lines of PTX, operations on float64, how many of them may be contracted later (none are: each says
how it rounds), bytes of memory of a run on the device besides logs, seconds of CPU to make PTX and twin; with --ptxas (it
is in the package nvidia-cuda-nvcc) registers and stack of a thread. How fast it flies is not known: no device was at hand.
"""

import argparse
import re
import resource
import subprocess
import tempfile
import time
from pathlib import Path

SCENARIOS = ("cubli_asteroid_paper", "cubli_asteroid", "lander_nominal", "spacerobot_harmonic")
_OPERATION = re.compile(r"^\s+(?:@!?%p\d+ )?(add|sub|mul|div|fma|mad|sqrt)\.(?:(r[nzmp])\.)?f64", re.M)


def cpu_s() -> float:
    """CPU seconds of this process and of those that it waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def measured(name: str, ptxas: str | None, arch: str) -> str:
    """A line on one scenario."""
    from flight_graph.cuda import modules
    from flight_graph.cuda.packed import Packed
    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.graphs.scenario import load
    run = CompiledRun(load(name), plan={}, reducing=True)
    flight = run.start(0)
    began = cpu_s()
    code = modules.load({name: (node.use, node.component) for name, node in run.graph.nodes.items()}, flight.codes)
    spent = cpu_s() - began
    found = _OPERATION.findall(code.ptx)
    loose = sum(1 for operation, rounding in found if not rounding or operation in ("fma", "mad"))
    parts, lines = len(set(code.numbers.values())), len(code.ptx.splitlines())
    said = (f"{name}: {parts} parts, {lines} lines of PTX, {len(found)} operations on float64, {loose} that may be "
            f"contracted, {Packed(flight, code.numbers).size} bytes a run, {spent:.0f} s of CPU")
    return f"{said}; {assembled(code.ptx, ptxas, arch)}" if ptxas else said


def assembled(ptx: str, ptxas: str, arch: str) -> str:
    """What the assembler says."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "code.ptx"
        path.write_text(ptx, encoding="utf-8")
        began = time.monotonic()
        done = subprocess.run([ptxas, f"-arch={arch}", "-v", path, "-o", path.with_suffix(".cubin")], capture_output=True,
                              text=True)
        if done.returncode:
            raise SystemExit(done.stderr)
        used = re.search(r"Used (\d+) registers", done.stderr)
        stack = re.search(r"(\d+) bytes cumulative stack", done.stderr)
        return (f"{arch}: {used[1]} registers, {stack[1] if stack else 0} bytes of stack a thread, assembled in "
                f"{time.monotonic() - began:.0f} s")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenarios", nargs="*", default=SCENARIOS)
    options.add_argument("--ptxas")
    options.add_argument("--arch", default="sm_90")
    chosen = options.parse_args()
    for name in chosen.scenarios:
        print(measured(name, chosen.ptxas, chosen.arch), flush=True)


if __name__ == "__main__":
    main()
