"""Exported components on emulated processors: golden bags flown by their C programs, every byte compared.

    apt-get install qemu-user-static gcc-aarch64-linux-gnu gcc-riscv64-linux-gnu gcc-arm-linux-gnueabihf
    python -m tests.c_export.emulated                                  # one golden bag for each component, all targets
    python -m tests.c_export.emulated cubli_asteroid armv7             # one bag, one target

Exit status: 0 all equal, 1 not, 3 tools are missing.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOOLS = {"aarch64": ("aarch64-linux-gnu-gcc", "qemu-aarch64"), "riscv64": ("riscv64-linux-gnu-gcc", "qemu-riscv64"),
         "armv7": ("arm-linux-gnueabihf-gcc", "qemu-arm")}


def tools(target: str) -> tuple[str, str] | None:
    """(cross compiler, emulator) of a target; None where one is missing."""
    compiler, emulator = TOOLS[target]
    found = shutil.which(f"{emulator}-static") or shutil.which(emulator)
    return (compiler, found) if shutil.which(compiler) and found else None


def fly(folder: Path, target: str) -> subprocess.CompletedProcess:
    """Build an exported component's program and fly its bag, emulated."""
    compiler, emulator = tools(target)
    name = next(folder.glob("lib*.a")).stem.removeprefix("lib")
    subprocess.run([compiler, "-static", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "main.c", f"{name}_data.c", "-L.",
                    f"-l{name}", "-lm", "-o", "fly"], cwd=folder, check=True)
    return subprocess.run([emulator, folder / "fly", folder / "firings.bin"], capture_output=True, text=True, timeout=600)


def _cases(chosen):
    """(bag, node) of each component that is not flown already."""
    from flight_graph.recordings.recorded_run import open_recorded
    seen = set()
    for path in sorted(path.parent for path in (ROOT / "bags").glob("*/metadata.yaml")):
        if chosen and path.name not in chosen:
            continue
        run = open_recorded(path)
        for node in run.scenario.graph.nodes.values():
            if "/" in node.use and node.use not in seen and not run.scenario.faults.concerns(node.name):
                seen.add(node.use)
                yield run, node


def main(words: list[str]) -> int:
    from flight_graph.c_export.export import export
    from flight_graph.errors import FlightError
    targets = [target for target in TOOLS if target in words] or list(TOOLS)
    if missing := [target for target in targets if tools(target) is None]:
        print(f"no cross compiler or no qemu-user for {', '.join(missing)}")
        return 3
    wrong = 0
    with tempfile.TemporaryDirectory() as work:
        for number, (run, node) in enumerate(_cases({word for word in words if word not in TOOLS})):
            for target in targets:
                folder = Path(work) / f"{number}_{target}"
                try:
                    made = export(node.use, folder, target, run, node.name)
                    done = fly(folder, target)
                    said, good = (done.stdout or done.stderr).strip(), done.returncode == 0
                    said += f"; needs {', '.join(made.needs) or 'nothing'}"
                except FlightError as error:
                    said, good = str(error), False
                wrong += not good
                print(f"{node.use} of {run.bag.path.name}, {target}: {said}", flush=True)
                shutil.rmtree(folder, ignore_errors=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    os.environ["NUMBA_CPU_NAME"] = "generic"  # as the command sets it, before numba is imported
    sys.exit(main(sys.argv[1:]))
