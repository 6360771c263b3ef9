"""The digests of tests/portable on several machines: this one, an older and a plain x86, and an emulated 64-bit Arm.

    python -m tests.portable.machines [SCENARIO ...] [--short] [--machines NAME,...] [--root FOLDER]

`make portable` runs it. Each machine runs the tests of this folder and flies every scenario, whole unless --short is
given; a table at the end says where the digests are those of the source. docs/portable.md tells how to make the Arm root.
Exit status: 0 equal on all machines, 1 not, 2 a wrong argument, 3 equal, but the emulated Arm is not there.
"""

import argparse
import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from tests.portable.scenario_digests import scenarios

ROOT = Path(__file__).resolve().parents[2]
CACHES = ROOT / "build" / "portable"  # machine code, a folder a machine
ARM_ROOT = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "flight_graph" / "arm_root"
NO_ARM = 3  # exit status
HOW = """\
The emulated Arm is not there ({what}). On Debian or Ubuntu:
    sudo apt install qemu-user-static debootstrap
    tests/portable/make_arm_root.sh {root}
and `make portable ARM_ROOT={root}` again (docs/portable.md)."""


@dataclass
class Machine:
    """Where the digests are computed. environment: changed variables; None takes one away."""

    name: str
    title: str
    command: list[str] = field(default_factory=lambda: [sys.executable])
    environment: dict[str, str | None] = field(default_factory=dict)

    def start(self, *arguments: str) -> subprocess.Popen:
        """A Python process of this machine in the root of the source."""
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", **self.environment}
        return subprocess.Popen([*self.command, *arguments], cwd=ROOT, stdout=subprocess.PIPE, encoding="utf-8",
                                env={key: value for key, value in environment.items() if value is not None})


def own_cache(name: str) -> str:
    return str(CACHES / name)


def older_x86() -> Machine:
    """The paths that the C library, NumPy and OpenBLAS take on a processor without AVX2 and FMA."""
    import numpy._core._multiarray_umath as umath
    found = [name for name in umath.__cpu_dispatch__ if umath.__cpu_features__[name]]
    return Machine("older", "x86 without AVX2 and FMA in the C library, NumPy and OpenBLAS", environment={
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",  # as glibc from 2.33 on spells them
        "NPY_DISABLE_CPU_FEATURES": " ".join(found), "OPENBLAS_CORETYPE": "Nehalem"})


def emulated_arm(root: Path) -> Machine | str:
    """The machine, or what is missing of it."""
    python = root / "usr" / "bin" / "arm_python"
    if not python.exists():
        return f"no root in {root}"
    if not any(map(shutil.which, ("qemu-aarch64-static", "qemu-aarch64"))):
        return "no qemu-aarch64-static"
    return Machine("arm", "64-bit Arm, emulated", [str(python)], {
        "FLIGHT_CACHE_DIR": own_cache("arm"), "NUMBA_CPU_NAME": None, "OPENBLAS_CORETYPE": None, "PYTHONPATH": None})


def machines(root: Path) -> tuple[list[Machine], str | None]:
    """What there is on this one, and why the Arm is missing, if it is."""
    found = [Machine("this", f"this machine ({platform.machine()}, {' '.join(platform.libc_ver())})")]
    if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
        found.append(older_x86())
    found.append(Machine("generic", "code for any processor of this kind", environment={
        "NUMBA_CPU_NAME": "generic", "FLIGHT_CACHE_DIR": own_cache("generic")}))
    if platform.machine() in ("aarch64", "arm64"):
        return found, None
    arm = emulated_arm(root)
    return (found, arm) if isinstance(arm, str) else ([*found, arm], None)


def run_tests(machine: Machine) -> bool:
    """The tests of this folder there."""
    process = machine.start("-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--timeout", "0",
                            "tests/portable")
    lines = process.communicate()[0].splitlines()
    print(*(lines[-1:] if process.returncode == 0 else lines), sep="\n", flush=True)
    return process.returncode == 0


def fly(machine: Machine, names: list[str], length: str) -> dict[str, str]:
    """Scenario -> equal or differs; what is missing did not come to its end."""
    options = ["--whole"] if length == "whole" else []
    process = machine.start("-m", "tests.portable.scenario_digests", *names, *options)
    found = {}
    for line in process.stdout:
        print(line, end="", flush=True)
        name, verdict, *_ = line.split()
        found[name] = verdict
    process.wait()
    return found


def table(wanted: list[Machine], names: list[str], found: dict[str, dict[str, str]]) -> str:
    """Scenarios by machines."""
    width = max(map(len, names))
    lines = [" " * width + "".join(f"  {machine.name:8}" for machine in wanted)]
    lines += [f"{name:{width}}" + "".join(f"  {found[machine.name].get(name, 'no end'):8}" for machine in wanted)
              for name in names]
    return "\n".join(lines)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenarios", nargs="*")
    options.add_argument("--short", action="store_true", help="the short runs of the scenarios alone")
    options.add_argument("--machines", help="this, older, generic, arm; default: all that are there")
    options.add_argument("--root", type=Path, default=Path(os.environ.get("ARM_ROOT") or ARM_ROOT), help="the Arm root")
    given = options.parse_args()
    there, missing = machines(given.root.resolve())
    chosen = given.machines.split(",") if given.machines else [machine.name for machine in there]
    wanted = [machine for machine in there if machine.name in chosen]
    names = given.scenarios or scenarios()
    if unknown := (set(chosen) - {machine.name for machine in there} - {"arm"}) | (set(names) - set(scenarios())):
        print(f"there is no {', no '.join(sorted(unknown))}", file=sys.stderr)
        return 2
    passed, found = True, {}
    for machine in wanted:
        print(f"\n{machine.title}", flush=True)
        passed &= run_tests(machine)
        found[machine.name] = fly(machine, names, "short" if given.short else "whole")
    print("\n" + table(wanted, names, found))
    equal = all(found[machine.name].get(name) == "equal" for machine in wanted for name in names)
    if missing and (not given.machines or "arm" in chosen):
        print("\n" + HOW.format(what=missing, root=given.root), file=sys.stderr)
    return 1 if not (passed and equal) else NO_ARM if missing and (not given.machines or "arm" in chosen) else 0


if __name__ == "__main__":
    sys.exit(main())
