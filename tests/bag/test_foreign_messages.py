"""Messages of any recorder: definitions of every kind, bodies of every middleware, and the tables made of them."""

import json
import struct

import numpy as np
import pytest
from mcap import records
from pyarrow import parquet

from flight_graph.bags.errors import BagError
from flight_graph.bags.export import export, table
from msg_schemas.definitions import TYPESTORE
from tests.bag.foreign_files import (
    INT32,
    bag_of,
    file,
    int32,
    message,
    record,
)


# -- definitions and bodies --------------------------------------------------------------------------------------------
def topic_bag(tmp_path, name, text, *payloads, encoding="ros2msg"):
    schema = records.Schema(1, text.encode(), encoding, name)
    data = record(schema) + record(records.Channel(1, "/x", "cdr", {}, 1)) + b"".join(
        message(1, i, payload) for i, payload in enumerate(payloads))
    return bag_of(tmp_path, file(data))


def test_idl_with_its_head(tmp_path):
    text = "=" * 80 + ("\nIDL: my_msgs/msg/Wheel\nmodule my_msgs {\n  module msg {\n    struct Wheel {\n      double speed;\n"
                       "      int32 count;\n    };\n  };\n};\n")
    bag = topic_bag(tmp_path, "my_msgs/msg/Wheel", text, b"\0\1\0\0" + struct.pack("<di", 1.5, 3), encoding="ros2idl")
    assert (bag["/x"]["speed"][0], bag["/x"]["count"][0]) == (1.5, 3)


def test_idl_of_other_generators(tmp_path):
    """Lines for a preprocessor, annotations, constants of wide text and enumerations."""
    text = ("=" * 80 + "\nIDL: my_msgs/msg/Wheel\n// generated\n#include \"std_msgs/msg/Header.idl\"\n#include <x.idl>\n"
            "#ifndef WHEEL\n#define WHEEL\nmodule my_msgs { module msg {\n  module Wheel_Constants {\n"
            "    const wstring NAME = L\"a \\\" b\";\n    const octet MOST = 3;\n  };\n"
            "  enum State { IDLE, /* not */ MOVING };\n  typedef double double__2[2];\n"
            "  @verbatim (language=\"comment\", text=\n    \"a text\" \"\\n\" \"of { two }\")\n"
            "  struct Wheel {\n    @unit (value=\"m/s\") double__2 speed; // of both\n    my_msgs::msg::State state;\n"
            "    sequence<State, 3> before;\n  };\n}; };\n#endif\n")
    payload = b"\0\1\0\0" + struct.pack("<ddIIII", 1.5, 2.5, 1, 2, 0, 1)
    for written in (text, text.replace("\n", "\r\n")):
        row = topic_bag(tmp_path, "my_msgs/msg/Wheel", written, payload, encoding="ros2idl")["/x"][0]
        assert (row["speed"].tolist(), row["state"], row["before"].tolist()) == ([1.5, 2.5], 1, [0, 1])


def test_carriage_returns_and_old_names(tmp_path):
    bag = topic_bag(tmp_path, "my_msgs/Pair", "int32 a\r\n# a word\r\nint32 b\r\n", b"\0\1\0\0" + struct.pack("<ii", 1, 2))
    assert bag.topics["/x"].type_name == "my_msgs/msg/Pair" and bag["/x"]["b"].tolist() == [2]


@pytest.mark.parametrize(("text", "sentence"), [
    ("my_msgs/Part part\n", "definition of my_msgs/msg/Part, which my_msgs/msg/Thing contains, is missing"),
    ("int32\n", "cannot be parsed"), ("Thing inner\n", "contains itself"), ("#" * (1 << 21), "has 2097152 characters")])
def test_definitions_that_cannot_be_used(tmp_path, text, sentence):
    bag = topic_bag(tmp_path, "my_msgs/msg/Thing", text, int32(1))
    with pytest.raises(BagError, match=sentence):
        bag["/x"]


def test_service_events_and_action_feedback(tmp_path):
    info = struct.pack("<BxxxiI16sxxxxq", 1, 5, 6, bytes(16), 9)
    request = struct.pack("<Ixxxxqq", 1, 3, 4)
    bag = topic_bag(tmp_path, "my_srvs/srv/Add_Event", "int64 a\nint64 b\n---\nint64 sum\n",
                    b"\0\1\0\0" + info + b"\0" * (-len(info) % 4) + request + struct.pack("<I", 0))
    event = bag["/x"][0]
    assert event["info"]["sequence_number"] == 9 and event["request"][0]["b"] == 4
    assert {"response", "info.event_type"} <= set(table(bag, "/x"))
    bag = topic_bag(tmp_path, "my/action/Count_FeedbackMessage", "int32 to\n---\nint32 all\n---\nint32 done\n",
                    b"\0\1\0\0" + bytes(range(16)) + struct.pack("<i", 8))
    assert bag["/x"]["feedback"]["done"].tolist() == [8]


@pytest.mark.parametrize(("width", "encoding"), [(4, "utf-32-le"), (2, "utf-16-le"), (1, "utf-16-le")])
def test_wide_strings_of_every_writer(tmp_path, width, encoding):
    """The length counts four-byte characters, two-byte ones, or bytes."""
    payloads = []
    for text in ("h\u00e9", "\u20ac", "abcd"):
        raw = text.encode(encoding)
        body = struct.pack("<I", len(raw) // width) + raw
        body += bytes(-len(body) % 4) + struct.pack("<i", len(text))
        payloads.append(b"\0\1\0\0" + body)
    bag = topic_bag(tmp_path, "my_msgs/msg/Named", "wstring name\nint32 length\n", *payloads)
    assert bag["/x"]["name"].tolist() == ["h\u00e9", "\u20ac", "abcd"] and bag["/x"]["length"].tolist() == [2, 1, 4]


def test_bodies_of_other_middleware(tmp_path):
    """Big endian, and XCDR2, which aligns doubles to four bytes."""
    text = "int32 a\nfloat64 b\n"
    payloads = (b"\0\0\0\0" + struct.pack(">ixxxxd", 1, 2.0), b"\0\7\0\0" + struct.pack("<id", 1, 2.0),
                b"\0\6\0\0" + struct.pack(">id", 1, 2.0))
    for payload in payloads:
        bag = topic_bag(tmp_path, "my_msgs/msg/Two", text, payload)
        assert (bag["/x"]["a"][0], bag["/x"]["b"][0]) == (1, 2.0)
        export(bag, tmp_path / "t", "parquet")
        assert parquet.read_table(tmp_path / "t" / "x.parquet").to_pydict()["b"] == [2.0]
    with pytest.raises(BagError, match="no plain CDR: its encapsulation is a parameter list"):
        topic_bag(tmp_path, "my_msgs/msg/Two", text, b"\0\3\0\0" + bytes(16))["/x"]


def test_text_that_is_no_utf8_is_escaped(tmp_path):
    bag = topic_bag(tmp_path, "std_msgs/msg/String", "string data\n", b"\0\1\0\0" + struct.pack("<I", 4) + b"h\xe9j\0")
    assert table(bag, "/x")["data"].tolist() == ["h\\xe9j"]


# -- tables ------------------------------------------------------------------------------------------------------------
def test_images_are_one_column_of_bytes(tmp_path):
    types, kind = TYPESTORE.types, "sensor_msgs/msg/Image"
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](1, 2), "camera")
    rng = np.random.default_rng(3)
    pictures = [rng.integers(0, 256, 240 * 320, dtype=np.uint8) for _ in range(4)]
    payloads = [bytes(TYPESTORE.serialize_cdr(types[kind](header, 240, 320, "mono8", 0, 320, picture), kind))
                for picture in pictures]
    bag = topic_bag(tmp_path, kind, TYPESTORE.generate_msgdef(kind)[0], *payloads)
    assert len(table(bag, "/x")) < 15
    for to in ("parquet", "csv", "npz"):
        path, = export(bag, tmp_path / to, to).paths
        assert path.stat().st_size < 2 * sum(map(len, payloads))
    found = parquet.read_table(tmp_path / "parquet" / "x.parquet").to_pydict()
    assert [np.frombuffer(data, np.uint8).tolist() for data in found["data"]] == [p.tolist() for p in pictures]
    assert found["header.frame_id"] == ["camera"] * 4 and found["encoding"] == ["mono8"] * 4


def test_long_arrays_are_lists(tmp_path):
    values = np.arange(2000.0)
    payload = b"\0\1\0\0" + struct.pack("<Ixxxx", 2000) + values.tobytes()
    bag = topic_bag(tmp_path, "my_msgs/msg/Scan", "float64[] ranges\n", payload, payload)
    path, = export(bag, tmp_path / "t", "parquet").paths
    assert parquet.read_table(path).to_pydict()["ranges"] == [values.tolist()] * 2
    path, = export(bag, tmp_path / "t", "csv").paths
    assert json.loads(path.read_text().splitlines()[1].split(",", 2)[2].strip('"')) == values.tolist()


def test_a_column_called_file_and_names_of_topics_as_files(tmp_path):
    data = record(records.Schema(1, b"string file\nint32 line\n", "ros2msg", "my_msgs/msg/Log"))
    topics = ["/a/b", "/a.b", "../../etc/x", "", "/" + "long" * 90]
    data += b"".join(record(records.Channel(i, topic, "cdr", {}, 1)) for i, topic in enumerate(topics, 1))
    body = struct.pack("<I", 5) + b"a.py\0" + bytes(3) + struct.pack("<i", 12)
    data += b"".join(message(i, i, b"\0\1\0\0" + body) for i in range(1, len(topics) + 1))
    done = export(bag_of(tmp_path, file(data)), tmp_path / "t", "npz")
    assert len({path.name.lower() for path in done.paths}) == len(topics)
    assert all(path.parent == tmp_path / "t" and len(path.name) < 140 for path in done.paths)
    assert np.load(done.paths[0])["file"].tolist() == ["a.py"] and np.load(done.paths[0])["line"].tolist() == [12]


def test_topics_by_any_spelling(tmp_path):
    data = record(INT32) + record(records.Channel(1, "plain", "cdr", {}, 1)) + message(1, 0, int32(3))
    bag = bag_of(tmp_path, file(data))
    assert bag.spelled("/plain") == bag.spelled("plain") == "plain"
    with pytest.raises(ValueError, match="did you mean 'plain'"):
        bag.spelled("/plane")
