"""`flight list SCENARIO --topics`: each number stands where the messages of a bag have its name."""

import json
import re
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from flight_graph.cli.topic_tables import show_topics, topic_rows
from flight_graph.components.foreign import refuse
from flight_graph.graphs.scenario import load

BAGS = Path(__file__).resolve().parents[2] / "bags"


@pytest.mark.parametrize("name", ["cubli_asteroid", "lander_estimated", "spacerobot_harmonic"])
def test_the_table_says_what_the_messages_say(name):
    rows = {row["topic"]: row for row in topic_rows(load(name))}
    with AnyReader([BAGS / name]) as reader:
        seen, counts = {}, {}
        for connection, _, raw in reader.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            if connection.topic not in seen:
                seen[connection.topic] = reader.deserialize(raw, connection.msgtype)
                assert rows[connection.topic]["type"] == connection.msgtype
    assert rows.keys() == seen.keys()
    for topic, row in rows.items():
        assert row["rate_hz"] is not None or counts[topic] == 1
        assert row["frame"] in ("", getattr(getattr(seen[topic], "header", None), "frame_id", ""))
        for number in row["numbers"]:
            path, index = re.fullmatch(r"(\w+)\[(\d+)\]", number["path"]).groups()
            assert path == "position" and number["unit"]
            assert number["label"].endswith(seen[topic].name[int(index)])
    assert any(row["numbers"] for row in rows.values())


def test_programs_read_it(capsys):
    show_topics("cubli_asteroid", refuse, True)
    rows = {row["topic"]: row for row in json.loads(capsys.readouterr().out)}
    funnel = rows["/cubli/funnel"]["numbers"]
    assert funnel[6] == {"path": "position[6]", "label": "attitude_xi[0]", "unit": "1", "meaning": "xi_a = e_a / rho_a"}
    assert rows["/tf_static"]["rate_hz"] is None and rows["/tf"]["rate_hz"] == 10.0
