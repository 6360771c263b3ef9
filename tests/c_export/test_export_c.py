"""A component as C flies the inputs of a golden bag and gives its bytes; for other processors there is code of theirs."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flight_graph.bags.reader import read_bag
from flight_graph.c_export.archive import archive
from flight_graph.c_export.export import export as write
from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.recordings.recorded_run import open_recorded

ROOT = Path(__file__).resolve().parents[2]
MACHINES = {"aarch64": 183, "riscv64": 243}  # e_machine of ELF


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


@pytest.mark.parametrize("target", ["aarch64"])
def test_code_for_another_processor(target, tmp_path):
    done = export("sim_nodes/star_tracker", "--out", tmp_path / "c", "--target", target)
    assert done.returncode == 0, done.stderr
    content = (tmp_path / "c/libstar_tracker.a").read_bytes()
    begin = content.index(b"\x7fELF")
    assert int.from_bytes(content[begin + 18:begin + 20], "little") == MACHINES[target] and content[begin + 4] == 2


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
