"""The memory of a run between two ticks, as bytes that every engine takes up: what is saved, continued, stepped back to.

A checkpoint of tick k holds what ticks before k have written and ticks from k on may read: parameters, states, records of
outputs, what readers see of them, and what faults remember. Inputs that are held, and all else, follow from these at the
next firing. A checkpoint says of which graph it is: components, rates, connections, and the layout of each record.
"""

import hashlib
import json
from dataclasses import dataclass

import numpy as np
import zstandard

from flight_graph.errors import FlightError
from flight_graph.text_files import parse_json, size_text

KEPT = ("P_", "X_", "O_", "E_", "V_", "F_", "A_", "B_", "N_")  # kinds of arrays, see `schedule` and `fault_schedule`
FOLDER, MEDIA_TYPE = "checkpoint/", "application/zstd"  # of attachments
LARGEST = 1 << 30  # [bytes] of one
_HEAD = 8  # [bytes] that say how long the description is
_WORDS = {"P_": "the parameters of", "X_": "the state of", "O_": "the output", "E_": "the output (behind its faults)",
          "V_": "what is seen of the output", "F_": "what is seen of the input", "N_": "the parameters of",
          "A_": "the memory of the fault", "B_": "what is kept by the fault"}


def is_kept(name: str) -> bool:
    """Whether an array of a run belongs to its checkpoints."""
    return name.startswith(KEPT)


def shape(graph, arrays: dict[str, np.ndarray], epoch_ns: int) -> dict:
    """What must be the same where a checkpoint is taken up: the graph, and the layout of its arrays by name."""
    components = {}
    for name, node in graph.nodes.items():
        inputs = {port: f"{edge.node}.{edge.port}, delay {edge.delay}" for port, edge in node.inputs.items()}
        use = node.use if not node.use.rpartition(":")[0].endswith(".py") else f"file:{node.use.rpartition(':')[2]}"
        components[name] = {"use": use, "period_ns": node.period_ns, "inputs": inputs}
    return {"base_ns": graph.base_ns, "epoch_ns": epoch_ns, "components": components,
            "records": {name: _layout(array) for name, array in sorted(arrays.items()) if is_kept(name)}}


def _layout(array: np.ndarray) -> dict[str, str]:
    if array.dtype.names is None:
        return {"": f"{len(array)} of {array.dtype.str}"}
    return {name: f"{_format(array.dtype.fields[name][0])} at byte {array.dtype.fields[name][1]}"
            for name in array.dtype.names}


def _format(dtype) -> str:
    base = str(dtype.base).replace("'", "") if dtype.base.names else dtype.base.str
    return f"{' x '.join(map(str, dtype.shape))} of {base}" if dtype.shape else base


@dataclass(frozen=True)
class Checkpoint:
    """The memory before a tick. shape: see `shape`; arrays: name -> bytes, in the order of the names."""

    tick: int
    shape: dict
    arrays: dict[str, bytes]

    @classmethod
    def of(cls, tick: int, shape_: dict, arrays: dict[str, np.ndarray]) -> "Checkpoint":
        """The memory of a run as it is now."""
        return cls(tick, shape_, {name: arrays[name].tobytes() for name in sorted(arrays) if is_kept(name)})

    @property
    def t_ns(self) -> int:
        """Time of its tick [ns] since the start of the run."""
        return self.tick * self.shape["base_ns"]

    @property
    def name(self) -> str:
        """Of its attachment: the tick."""
        return f"{FOLDER}{self.tick:012d}"

    @property
    def digest(self) -> str:
        """SHA-256 of all that it says."""
        return _digest({"tick": self.tick, "shape": self.shape}, b"".join(self.arrays.values()))

    @property
    def size(self) -> int:
        """Bytes of its arrays."""
        return sum(map(len, self.arrays.values()))

    def encode(self) -> bytes:
        """As an attachment of a bag."""
        body, sizes = b"".join(self.arrays.values()), list(map(len, self.arrays.values()))
        said = {"tick": self.tick, "shape": self.shape, "sizes": sizes, "digest": self.digest}
        head = json.dumps(said).encode()
        return zstandard.ZstdCompressor(level=1).compress(len(head).to_bytes(_HEAD, "little") + head + body)

    @classmethod
    def decode(cls, content: bytes, where: str) -> "Checkpoint":
        """A checkpoint as `encode` wrote it. Raises FlightError, which begins with ``where``, where it is damaged."""
        content = _unpacked(content, where)
        length = int.from_bytes(content[:_HEAD], "little")
        said, body = parse_json(content[_HEAD:_HEAD + length], where, LARGEST), content[_HEAD + length:]
        try:
            tick, shape_, sizes, digest = said["tick"], said["shape"], said["sizes"], said["digest"]
            ends = np.cumsum([0, *sizes]).tolist()
            names = sorted(shape_["records"])
            sound = (type(tick) is int and tick >= 0 and all(type(size) is int and size >= 0 for size in sizes)
                     and len(names) == len(sizes) and ends[-1] == len(body))
        except (KeyError, TypeError, ValueError, OverflowError):
            sound = False
        if not sound:
            raise FlightError(f"{where}: this is no checkpoint")
        if _digest({"tick": tick, "shape": shape_}, body) != digest:
            raise FlightError(f"{where}: it is damaged: its content does not have the digest that it names")
        return cls(tick, shape_, {name: body[a:b] for name, a, b in zip(names, ends, ends[1:])})

    def restore(self, arrays: dict[str, np.ndarray], shape_: dict, where: str) -> None:
        """Put the memory into the arrays of a run. Raises FlightError where they are of another graph."""
        if found := differences(self.shape, shape_):
            raise FlightError(f"{where}: the checkpoint is of another graph: " + "; ".join(found[:3])
                              + (f"; and {len(found) - 3} more differences" if len(found) > 3 else ""))
        for name, content in self.arrays.items():
            memory = arrays[name].view("u1").reshape(-1)
            if len(memory) != len(content):
                raise FlightError(f"{where}: the checkpoint is of another graph: {_words(name)} has {len(content)} bytes "
                                  f"there, {len(memory)} here")
            memory[:] = np.frombuffer(content, "u1")


    def difference(self, other: "Checkpoint") -> str:
        """The first entry that differs from another checkpoint of the same graph, in words; empty: they are equal."""
        for name, content in self.arrays.items():
            wrong = np.flatnonzero(np.frombuffer(content, "u1") != np.frombuffer(other.arrays[name], "u1"))
            if len(wrong):
                return _entry(name, self.shape["records"][name], int(wrong[0]))
        return ""


def _entry(name, layout, offset) -> str:
    begins = {int(text.rpartition(" ")[2]): entry for entry, text in layout.items() if entry}
    entry = begins[max(begin for begin in begins if begin <= offset)] if begins else f"byte {offset}"
    return f"{_words(name)}: {entry}"


def _digest(said: dict, body: bytes) -> str:
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode() + body).hexdigest()


def _unpacked(content: bytes, where: str) -> bytes:
    try:
        size = zstandard.get_frame_parameters(content).content_size
        if size > LARGEST:
            raise FlightError(f"{where}: it is larger than {size_text(LARGEST)}, more than is read of a checkpoint")
        return zstandard.ZstdDecompressor().decompress(content, max_output_size=LARGEST)
    except zstandard.ZstdError:
        raise FlightError(f"{where}: it is damaged: it cannot be unpacked") from None


def _words(name: str) -> str:
    return f"{_WORDS[name[:2]]} {name[2:]}"


def differences(there: dict, here: dict) -> list[str]:
    """What differs between the shapes of two graphs, as sentences."""
    found = [f"{words} is {there.get(key)} ns there, {here.get(key)} ns here" for key, words in (
        ("base_ns", "the base tick"), ("epoch_ns", "the stamp of t = 0")) if there.get(key) != here.get(key)]
    one, other = (_mapping(side, "components") for side in (there, here))
    found += _missing("component", one, other)
    for name in one.keys() & other.keys():
        for key, words in (("use", "is"), ("period_ns", "has a period [ns] of"), ("inputs", "has the inputs")):
            a, b = one[name].get(key), other[name].get(key)
            if a != b:
                found.append(f"{name} {words} {_text(a)} there, {_text(b)} here")
    if found:
        return found
    one, other = (_mapping(side, "records") for side in (there, here))
    found += [sentence for name in sorted(one.keys() ^ other.keys())
              for sentence in [f"{_words(name)} is only {'there' if name in one else 'here'}"]]
    for name in sorted(one.keys() & other.keys()):
        for entry in dict.fromkeys([*one[name], *other[name]]):
            a, b = one[name].get(entry), other[name].get(entry)
            if a != b:
                found.append(f"{_words(name)}: {entry or 'its size'} is {a or 'not'} there, {b or 'not'} here")
    return found


def _mapping(side, key) -> dict:
    found = side.get(key)
    return found if isinstance(found, dict) and all(isinstance(one, dict) for one in found.values()) else {}


def _missing(kind, one, other):
    return [f"{kind} {name} is only {'there' if name in one else 'here'}" for name in sorted(one.keys() ^ other.keys())]


def _text(value) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} from {one}" for key, one in value.items()) or "none"
    return str(value)
