"""A component as C flies the inputs of a golden bag and gives its bytes; for other processors there is code of theirs."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flight_graph.bags.reader import read_bag
from flight_graph.c_export import machine_code
from flight_graph.c_export.archive import archive
from flight_graph.c_export.export import export as write
from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.recordings.recorded_run import open_recorded
from tests.c_export import emulated

pytestmark = pytest.mark.xdist_group("c export")  # code for another processor is made once

ROOT = Path(__file__).resolve().parents[2]


def export(*arguments, cwd=ROOT):
    return subprocess.run([sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())", "export-c",
                           *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=600,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")
def test_the_golden_bag_flies_in_c(tmp_path):
    """Built without a warning, every byte of every answer; a flipped bit in an input is found."""
    folder = tmp_path / "law"
    done = export("cubli_ros/appc_controller", "--out", folder, "--bag", ROOT / "bags/cubli_asteroid", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["needs"] == [] and said["sizes"].keys() == {"start", "kernel"}
    subprocess.run(["cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "main.c", "appc_controller_data.c", "-L.",
                    "-lappc_controller", "-o", "fly"], cwd=folder, check=True)
    flown = subprocess.run([folder / "fly", folder / "firings.bin"], capture_output=True, text=True)
    count = read_bag(ROOT / "bags/cubli_asteroid").topics["/cubli/wheel_command"].count
    assert flown.returncode == 0 and f"{count} firings, equal byte for byte" in flown.stdout, flown.stdout + flown.stderr
    content = bytearray((folder / "firings.bin").read_bytes())
    size = len(content) // count
    attitude = registry.component("cubli_ros/appc_controller").inputs["attitude"]
    content[20 * size + 16 + attitude.dtype.fields["orientation"][1] + 5] ^= 1  # in firing 20, behind the two times
    (folder / "firings.bin").write_bytes(content)
    flown = subprocess.run([folder / "fly", folder / "firings.bin"], capture_output=True, text=True)
    assert flown.returncode == 1 and "differs at 200000000 ns" in flown.stderr, flown.stdout + flown.stderr


@pytest.fixture(scope="module")
def made_for_armv7(tmp_path_factory):
    """The inertial unit of the rover for a processor of 32 bits, with its firings in a golden bag."""
    folder = tmp_path_factory.mktemp("armv7") / "c"
    done = export("sim_nodes/imu", "--out", folder, "--target", "armv7", "--bag", ROOT / "bags/cubli_asteroid", "--json")
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)["needs"]


def test_code_for_another_processor(made_for_armv7):
    """Of 32 bits, in the hard-float convention; what it calls is memory and the conversions of the processor's run time."""
    folder, needs = made_for_armv7
    content = (folder / "libimu.a").read_bytes()
    begin = content.index(b"\x7fELF")
    assert int.from_bytes(content[begin + 18:begin + 20], "little") == 40 and content[begin + 4] == 1  # EM_ARM, 32 bits
    assert needs and set(needs) <= {"memset", "memcpy", "__aeabi_d2lz", "__aeabi_l2d", "__aeabi_ul2d"}
    assert "processors of 32 bits" in (folder / "imu.h").read_text()


MATHEMATICS = """
declare double @llvm.sqrt.f64(double)
define void @law(ptr noalias %a) {
  %x = load double, ptr %a, align 1
  %at = getelementptr i8, ptr %a, i64 8
  %y = load double, ptr %at, align 1
  %product = fmul double %x, %y
  %sum = fadd double %product, %x
  %difference = fsub double %product, %sum
  %ratio = fdiv double %difference, %y
  %root = call double @llvm.sqrt.f64(double %ratio)
  store double %root, ptr %at, align 1
  ret void
}"""


@pytest.mark.parametrize("target", ["aarch64", "riscv64", "armv7"])
def test_no_processor_contracts_a_product_and_a_sum(target):
    """Each rounds twice, in hardware: no fused instruction, no call. (The vmla of VFPv3 rounds its product.)"""
    module, machine = machine_code.for_target(MATHEMATICS, machine_code.TARGETS[target])
    text = machine.emit_assembly(module)
    assert not re.search(r"\b(vfn?m[as]|fn?m(add|sub)|fml[as])\b", text), text
    assert not re.search(r"^\s+(bl|blx|call|jal)\s", text, re.MULTILINE), text
    assert re.search(r"\b(vsqrt\.f64|fsqrt(\.d)?)\b", text), text


@pytest.mark.skipif(emulated.tools("armv7") is None, reason="no arm-linux-gnueabihf-gcc or no qemu-arm here")
def test_the_golden_bag_flies_on_an_emulated_processor_of_32_bits(made_for_armv7):
    flown = emulated.fly(made_for_armv7[0], "armv7")
    assert flown.returncode == 0 and "50 firings, equal byte for byte" in flown.stdout, flown.stdout + flown.stderr


@pytest.mark.parametrize("target", ["aarch64"])  # and riscv64: python -m tests.c_export.emulated flies all
def test_the_golden_bag_flies_on_an_emulated_processor(target, tmp_path):
    if emulated.tools(target) is None:
        pytest.skip(f"no {' or no '.join(emulated.TOOLS[target])} here")
    done = export("sim_nodes/star_tracker", "--out", tmp_path / "c", "--target", target, "--bag", ROOT / "bags/cubli_asteroid")
    assert done.returncode == 0, done.stderr
    flown = emulated.fly(tmp_path / "c", target)
    assert flown.returncode == 0 and "2 firings, equal byte for byte" in flown.stdout, flown.stdout + flown.stderr


def test_an_archive_is_what_the_linker_reads(tmp_path):
    path = tmp_path / "libtwo.a"
    path.write_bytes(archive({"one.o": (b"abc", ["first"]), "two.o": (b"defg", ["second", "third"])}))
    if shutil.which("ar") is None:
        pytest.skip("there is no ar here")
    assert subprocess.run(["ar", "t", path], capture_output=True, text=True, check=True).stdout.split() == ["one.o", "two.o"]
    assert subprocess.run(["ar", "p", path, "two.o"], capture_output=True, check=True).stdout == b"defg"


@pytest.mark.parametrize("use, folder, options, sentence", [
    ("cubli_ros/nothing", "c", {}, "nothing"),
    ("cubli_ros/appc_controller", "c", {"target": "z80"}, "no target called 'z80'"),
    ("cubli_ros/pd_controller", "c", {"run": "cubli_asteroid"}, "no component is cubli_ros/pd_controller"),
    ("cubli_ros/appc_controller", ".", {}, "it exists already")])
def test_bad_input(use, folder, options, sentence, tmp_path):
    if "run" in options:
        options = {"run": open_recorded(ROOT / "bags" / options["run"])}
    with pytest.raises(FlightError, match=sentence):
        write(use, tmp_path / folder, **options)
