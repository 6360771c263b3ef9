"""Files that leave a mark when any of their code runs, and bags and scenarios that name them."""

import importlib.util
import json
from pathlib import Path

from flight_graph.bags.writer import BagWriter
from tests.bag.sample_bags import IMU, recorded

EVIL = """from pathlib import Path
Path({mark!r}).write_text("it ran")
from sim_nodes.sensors import *
from sim_nodes.nodes import *
def draw(*arguments): return {{}}
class Law: pass
"""


class Trap:
    """A file of code, and whether it ran."""

    def __init__(self, folder: Path, name: str = "evil_law"):
        self.mark = folder / "it_ran"
        self.text = EVIL.format(mark=str(self.mark))
        self.name = name

    @property
    def ran(self) -> bool:
        return self.mark.exists()

    def write(self, folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{self.name}.py"
        path.write_text(self.text)
        return path


def scenario(**keys) -> dict:
    """The data of a small scenario of installed components."""
    return {"name": "small", "title": "small", "duration_s": 0.1, "seed": 1,
            "components": {"plant": {"use": "sim_nodes/cubli_plant"}, "controller": {"use": "cubli_ros/pd_controller"}},
            "connect": {"controller.attitude": "plant.attitude"}, **keys}


def bag(folder: Path, data, attachments=None) -> Path:
    """A bag with some messages that carries a scenario and other attachments."""
    stamps, imu, _ = recorded(1, 10)
    with BagWriter(folder) as writer:
        topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
        writer.attach("scenario.json", "application/json", data if isinstance(data, bytes) else json.dumps(data).encode())
        for name, content in (attachments or {}).items():
            writer.attach(name, "text/x-python", content)
        writer.metadata("flight_graph", {"engine": "compiled", "pace": "none"})
        writer.metadata("flight_graph.outcome", {"complete": "true"})
        for stamp, payload in zip(stamps.tolist(), IMU.payloads(imu)):
            writer.write(topic, stamp, payload)
    return folder


def plant_compiled(source: Path, evil: str) -> None:
    """Put a compiled form of other content beside a source file, which Python would take without looking at the source."""
    import importlib._bootstrap_external as external
    cached = Path(importlib.util.cache_from_source(str(source)))
    cached.parent.mkdir(exist_ok=True)
    code = compile(evil, str(source), "exec")
    cached.write_bytes(external._code_to_hash_pyc(code, b"12345678", False))
