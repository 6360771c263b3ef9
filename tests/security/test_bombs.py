"""Small files that would become large: each ends in a sentence within a second of processor time and 200 MB."""

import json
import sys

import lz4.frame
import numpy as np
import pytest
import yaml
import zstandard

from flight_graph.bags.writer import BagWriter
from tests.security.attacks import bag, scenario
from tests.security.measured import measured

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of a process are measured on Linux")
SECONDS, MEGABYTES = 1.0, 200.0


def unfolding(first="a: &a [x,x,x,x,x,x,x,x,x]\n"):
    return first + "".join(f"{name}: &{name} [{','.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefgh", "bcdefghi"))


YAML = {"unfolding": unfolding(), "deep": "[" * 300_000, "deep mappings": "{a: " * 100_000, "many": "[" + "x," * 300_000 + "]",
        "long": "a: " + "x" * (2 << 20), "keys": "".join(f"k{i}: 1\n" for i in range(90_000)), "number": "a: " + "9" * 900_000,
        "merge": "a: &a {x: 1}\n" + "".join(f"{n}: &{n} {{<<: [{','.join([f'*{b}'] * 9)}]}}\n" for b, n in zip("abcdefgh", "bcdefghi"))}
READERS = {
    "scenario": ("from flight_graph.graphs.scenario import load", "load(sys.argv[1])", ".yaml"),
    "parameters": ("from pathlib import Path\nfrom flight_graph.components import parameter_file",
                   "parameter_file.overrides(Path(sys.argv[1]), {'plant': ('sim_nodes/cubli_plant', None)})", ".yaml"),
    "robot": ("from spacerobot_ros.robot_files import find_model", "find_model(sys.argv[1])", ".yaml"),
}


def is_small(found, words=""):
    assert found.sentence and words in found.sentence and len(found.sentence) < 2000, found.sentence[:2000]
    assert found.cpu_s < SECONDS and found.grown < MEGABYTES, (found.cpu_s, found.grown)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", YAML)
def test_yaml(tmp_path, reader, kind):
    imports, call, ending = READERS[reader]
    (tmp_path / f"bomb{ending}").write_text(YAML[kind])
    is_small(measured(imports, call, tmp_path / f"bomb{ending}"), "bomb")


@pytest.mark.parametrize("kind", YAML)
def test_yaml_in_a_bag(tmp_path, kind):
    """metadata.yaml, and the quality of service of a topic: the bag is read, or a sentence says why not."""
    folder = bag(tmp_path / "bag", scenario())
    (folder / "metadata.yaml").write_text(YAML[kind])
    is_small(measured("from flight_graph.bags.reader import read_bag", "read_bag(sys.argv[1])", folder), "metadata.yaml")
    imports = "from flight_graph.bags.description import qos_profiles\nfrom pathlib import Path"
    found = measured(imports, "assert qos_profiles(Path(sys.argv[1]).read_text()) == []", folder / "metadata.yaml")
    assert found.cpu_s < SECONDS and found.grown < MEGABYTES


ENTITIES = "<!DOCTYPE r [<!ENTITY a 'aaaaaaaaaa'>" + "".join(
    f"<!ENTITY {n} '{f'&{b};' * 10}'>" for b, n in zip("abcdefghi", "bcdefghij")) + "]>"
LINK = "<link name='l{}'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>"
XML = {
    "entities": (ENTITIES + "<robot name='&j;'/>", "document type"),
    "one long entity": ("<!DOCTYPE r [<!ENTITY a '" + "a" * 100_000 + "'>]><robot>" + "&a;" * 10_000 + "</robot>", "document type"),
    "outside entity": ("<!DOCTYPE r [<!ENTITY a SYSTEM 'file:///etc/passwd'>]><robot name='&a;'/>", "document type"),
    "parameter entity": ("<!DOCTYPE r [<!ENTITY % a SYSTEM 'file:///etc/passwd'> %a;]><robot/>", "document type"),
    "outside document type": ("<!DOCTYPE r SYSTEM 'http://localhost/x.dtd'><robot/>", "document type"),
    "deep": ("<robot>" + "<a>" * 200_000, "in each other"), "many": ("<robot>" + "<a/>" * 200_000 + "</robot>", "more than 20000"),
    "long": ("<robot name='" + "a" * (5 << 20) + "'/>", "longer than 4 MiB"),
    "links": ("<robot>" + "".join(LINK.format(i) for i in range(3000)) + "</robot>", "more than 256 elements <link>"),
    "joints": ("<robot>" + LINK.format(0) + LINK.format(1) + "<joint name='j' type='fixed'><parent link='l0'/><child link='l1'/></joint>"
               * 3000 + "</robot>", "more than 256 elements <joint>"),
    "attributes": ("<robot " + " ".join(f"a{i}='1'" for i in range(100_000)) + "/>", "URDF"),
    "digits": ("<robot>" + LINK.format(0).replace("value='1'", "value='" + "9" * 100_000 + "'") + "</robot>", "URDF"),
    "not a number": ("<robot>" + LINK.format(0).replace("value='1'", "value='nan'") + "</robot>", "URDF"),
    "cut": ("<robot><link", "is not XML"), "no XML": ("\0\1\2", "is not XML"), "empty": ("", "is not XML"),
    "name": ("<robot>" + LINK.format("a" * 5000) + "</robot>", "more than 200 letters"),
    "encoding": ("<?xml version='1.0' encoding='utf-99'?><robot/>", "is not XML"),
}


@pytest.mark.parametrize("kind", XML)
def test_xml(tmp_path, kind):
    text, words = XML[kind]
    (tmp_path / "bomb.urdf").write_text(text)
    is_small(measured("from spacerobot_ros.robot_files import find_model", "find_model(sys.argv[1])", tmp_path / "bomb.urdf"), words)


def test_a_urdf_of_other_bytes(tmp_path):
    for content in (b"\xff\xfe<\0r\0", b"<robot name='\xff'/>", b"\x80"):
        (tmp_path / "r.urdf").write_bytes(content)
        is_small(measured("from spacerobot_ros.robot_files import find_model", "find_model(sys.argv[1])", tmp_path / "r.urdf"), "is not XML")


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
MESHES = {  # with 400 MiB of free memory
    "vertices": ("v 1 2 3\n" * 500_000, "holds a mesh of 104857 triangles on as many vertices"),
    "faces": ("v 1 2 3\nv 1 2 4\nv 1 3 3\n" + "f 1 2 3\n" * 500_000, "400 MiB of memory are free"),
    "lines": ("#\n" * 3_000_000, "in 524285 lines"), "long": ("#" * (40 << 20), "longer than 25 MiB"),
    "a long line": ("v " + "1 " * 10_000_000, "line 1: "), "corners": ("v 1 2 3\n" * 10 + "f " + "1 2 3 " * 5000 + "\n", "line 11: "),
    "not a number": ("v nan 0 0\n" + TETRAHEDRON, "vertex 1 is not finite"), "infinite": ("v 1e999 0 0\n" + TETRAHEDRON, "is not finite"),
    "far": (TETRAHEDRON.replace("v 1 0 0", "v 1e300 0 0"), "more than 1e+09 m from"), "behind": (TETRAHEDRON + "f 1 2 9\n", "a vertex that is not there"),
    "before": (TETRAHEDRON + "f -9 1 2\n", "a vertex that is not there"), "huge index": (TETRAHEDRON + "f 1 2 " + "9" * 30 + "\n", "line 9: "),
    "digits": (TETRAHEDRON + "f 1 2 " + "9" * 10_000 + "\n", "line 9: "), "zero": (TETRAHEDRON + "f 0 1 2\n", "line 9: "),
    "two numbers": ("v 1 2\n", "line 1: "), "binary": ("\0\1v\2f" * 1000, "has no faces"), "empty": ("", "has no faces"),
    "old lines": ("v 1 2\r" * 10, "line 1: "),
}


@pytest.mark.parametrize("kind", MESHES)
def test_meshes(tmp_path, kind):
    text, words = MESHES[kind]
    (tmp_path / "bomb.obj").write_text(text)
    imports = "from flight_graph.engines import memory\nfrom sim_nodes.gravity.mesh import load_obj\nmemory.free_bytes = lambda: 400 << 20"
    is_small(measured(imports, "load_obj(sys.argv[1])", tmp_path / "bomb.obj"), words)


JSON = {"deep": b"[" * 1_000_000, "many": b"[" + b"[]," * 1_500_000 + b"[]]", "digits": b'{"seed": ' + b"9" * 100_000 + b"}",
        "component names": json.dumps({"components": {f"c{i}": {"use": "sim_nodes/imu"} for i in range(50_000)}}).encode(),
        "long name": json.dumps(scenario(name="a" * 3_000_000)).encode(),
        "long key": json.dumps({**scenario(), "b" * 3_000_000: 1}).encode(),
        "long use": json.dumps(scenario(components={"plant": {"use": "sim_nodes/" + "a" * 3_000_000}})).encode(),
        "long parameter": json.dumps(scenario(components={"plant": {"use": "sim_nodes/cubli_plant", "parameters": {"c" * 3_000_000: 1}}})).encode(),
        "many numbers": json.dumps(scenario(components={"plant": {"use": "sim_nodes/cubli_plant", "parameters": {
            "initial_angles": [1.0] * 500_000}}})).encode(),
        "expression": json.dumps(scenario(components={"plant": {"use": "sim_nodes/cubli_plant", "parameters": {
            "gravity": "= 9 ** 9 ** 9 ** 9"}}})).encode(),
        "grid": json.dumps(scenario(vary={"grid": {key: list(range(1000)) for key in ("plant.gravity", "plant.mass", "seed", "duration_s")}})).encode()}


@pytest.mark.parametrize("kind", JSON)
def test_json_of_a_bag(tmp_path, kind):
    folder = bag(tmp_path / "bag", JSON[kind])
    is_small(measured("from flight_graph.recordings.recorded_run import open_recorded\n"
                      "from flight_graph.components import registry\nregistry.components()", "open_recorded(sys.argv[1])", folder))


VARY = {
    "grid": {"grid": {"plant.gravity": {"linear": [0, 1, 100_000]}, "plant.mass": {"linear": [1, 2, 100_000]}}},
    "10^12 cases": {"grid": {key: {"linear": [1, 2, 1000]} for key in ("plant.gravity", "plant.mass", "controller.kp", "controller.kd")}},
    "spaced": {"grid": {"plant.gravity": {"linear": [0, 1, 10**12]}}}, "geometric": {"grid": {"plant.gravity": {"geometric": [1, 2, 10**15]}}},
    "runs": {"random": {"plant.gravity": {"uniform": [0, 1]}}, "runs": 10**15}, "runs of many": {
        "random": {"plant.gravity": {"uniform": [0, 1]}}, "grid": {"plant.mass": {"linear": [1, 2, 1000]}}, "runs": 10_000},
    "size": {"random": {"plant.gravity": {"uniform": [0, 1], "size": 10**12}}}, "seed": {"grid": {"seed": [1]}, "seed": 2**80},
}


@pytest.mark.parametrize("kind", VARY)
def test_sweeps(tmp_path, kind):
    (tmp_path / "s.yaml").write_text(yaml.safe_dump(scenario(vary=VARY[kind])))
    is_small(measured("from flight_graph.graphs.scenario import load\nfrom flight_graph.components import registry\nregistry.components()",
                      "load(sys.argv[1])", tmp_path / "s.yaml"), "vary")


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_a_run_that_does_not_fit_into_memory(tmp_path, engine):
    """The sentence comes before the memory is taken, and before anything is compiled."""
    (tmp_path / "s.yaml").write_text(yaml.safe_dump(scenario(duration_s=1e8)))
    imports = ("import os\n" + ("os.environ['NUMBA_DISABLE_JIT'] = '1'\n" if engine == "python" else "")
               + "from pathlib import Path\nfrom flight_graph import runs\nfrom flight_graph.graphs.scenario import load\n"
               "import flight_graph.engines.compiled, flight_graph.recordings.recording\n"
               "from flight_graph.components import registry\nregistry.components()")
    found = measured(imports, f"runs.execute(load(sys.argv[1]), {engine!r}, out=Path(sys.argv[2]))", tmp_path / "s.yaml", tmp_path / "out")
    is_small(found, "of memory are free; run it for a shorter time, or record less")
    assert not (tmp_path / "out").exists()


def test_verify_and_replay_of_a_bag_that_claims_a_long_run(tmp_path):
    folder = bag(tmp_path / "bag", scenario(duration_s=1e8))
    found = measured("from flight_graph.runs import verify\nimport flight_graph.replays.verify", "verify(sys.argv[1])", folder)
    assert "of memory are free" in found.sentence and found.grown < MEGABYTES


def test_compressed_bytes(tmp_path):
    """A chunk that unpacks to a thousand times its size is refused by what it declares, and by what it unpacks to."""
    zeros = np.zeros(1 << 28, "u1").tobytes()
    for name, packed in (("zstd", zstandard.ZstdCompressor(level=19).compress(zeros)), ("lz4", lz4.frame.compress(zeros))):
        (tmp_path / name).write_bytes(packed)
        for size in (1 << 28, 1 << 20, 2**63):
            call = f"_decompress({name!r}, Path(sys.argv[1]).read_bytes(), {size}, 'it')"
            found = measured("from pathlib import Path\nfrom flight_graph.bags import mcap_records\n"
                             "from flight_graph.bags.mcap_records import Damage\n"
                             "def _decompress(*given):\n    try:\n        mcap_records._decompress(*given)\n"
                             "    except Damage as damage:\n        raise FlightError(str(damage))\n", call, tmp_path / name)
            assert found.grown < MEGABYTES and found.sentence, (name, size, found)


OUTER = f"evil_msgs/T0 x\n{'=' * 80}\nMSG: evil_msgs/T0\n"


def holding(number, times, array=""):
    """Fields of the type of a number."""
    return "".join(f"evil_msgs/T{number}{array} x{j}\n" for j in range(times))


DEFINITIONS = {
    "a huge array": ("ros2msg", "float64[1000000000] x\n"), "a huge array of texts": ("ros2msg", "string[1000000000] x\n"),
    "arrays of arrays": ("ros2msg", OUTER.replace("T0 x", "T0[10] x") + "".join(
        f"{holding(i + 1, 1, '[10]')}{'=' * 80}\nMSG: evil_msgs/T{i + 1}\n" for i in range(12)) + "float64[10] x\n"),
    "fields of fields": ("ros2msg", OUTER + "".join(
        f"{holding(i + 1, 10)}{'=' * 80}\nMSG: evil_msgs/T{i + 1}\n" for i in range(9)) + "float64 x\n"),
    "deep": ("ros2msg", OUTER + "".join(
        f"{holding(i + 1, 1)}{'=' * 80}\nMSG: evil_msgs/T{i + 1}\n" for i in range(3000)) + "float64 x\n"),
    "in itself": ("ros2msg", "evil_msgs/Bomb x\n"), "an array of nothing": ("ros2msg", OUTER.replace("T0 x", "T0[1000000000] x")),
    "long": ("ros2msg", "float64 x\n" * 150_000), "idl": ("ros2idl", "module evil_msgs { module msg { struct Bomb { double x[1000000000]; }; }; };"),
    "deep idl": ("ros2idl", "module a {" * 20_000), "parentheses": ("ros2idl", "(" * 100_000), "unknown": ("ros3", "x"),
}


@pytest.mark.parametrize("kind", DEFINITIONS)
def test_message_definitions(tmp_path, kind):
    encoding, text = DEFINITIONS[kind]
    with BagWriter(tmp_path / "bag") as writer:
        topic = writer.add_channel("/x", "cdr", {}, ("evil_msgs/msg/Bomb", encoding, text.encode()))
        for number, body in enumerate((bytes(64), b"\xff" * 64, b"", b"\xff\xff\xff\x7f" * 100)):
            writer.write(topic, number, b"\0\1\0\0" + body)
    found = measured("from flight_graph.bags.export import export\nfrom flight_graph.bags.reader import read_bag",
                     "for sentence in export(read_bag(sys.argv[1]), sys.argv[2]).problems.values(): raise FlightError(sentence)",
                     tmp_path / "bag", tmp_path / "out")
    is_small(found, "topic '/x'")
