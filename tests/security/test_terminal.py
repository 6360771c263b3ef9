"""What a stranger's file says reaches the terminal as text: nothing in it moves the cursor or turns the writing."""

import json

import pytest

from flight_graph.bags.writer import BagWriter
from flight_graph.text_files import printable
from tests.bag.sample_bags import IMU, recorded

EVIL = "a\x1b[2J\x1b]0;owned\x07b\u202ec\x9b31m\rd"


def test_printable():
    assert printable(EVIL) == "a\\x1b[2J\\x1b]0;owned\\x07b\\x202ec\\x9b31m\\x0dd"
    assert printable("Größe [rad]\n\tα² 漢") == "Größe [rad]\n\tα² 漢"


@pytest.fixture
def evil_bag(tmp_path):
    stamps, imu, _ = recorded(1, 4)
    with BagWriter(tmp_path / "evil") as writer:
        topic = writer.add_topic(f"/{EVIL}", IMU.type_name, IMU.role.qos)
        writer.add_channel("/other", "cdr", {}, (f"evil_msgs/msg/{EVIL}", EVIL, EVIL.encode()))
        writer.add_channel("/json", EVIL, {EVIL: EVIL, "offered_qos_profiles": EVIL}, None)
        writer.attach(EVIL, "text/plain", EVIL.encode())
        writer.attach("scenario.json", "application/json", json.dumps({"name": EVIL, "title": EVIL, "components": {
            EVIL: {"use": EVIL}, "b": {"use": f"{EVIL}.py:X"}}}).encode())
        writer.metadata(EVIL, {EVIL: EVIL})
        for stamp, payload in zip(stamps.tolist(), IMU.payloads(imu)):
            writer.write(topic, stamp, payload)
    return tmp_path / "evil"


COMMANDS = (("info", "BAG"), ("info", "BAG", "--json"), ("export", "BAG", "--out", "tables"), ("diff", "BAG", "BAG"),
            ("recover", "BAG", "--out", "saved"), ("verify", "BAG"), ("plot", "BAG"), ("replay", "BAG", "--component", EVIL),
            ("verify", "BAG", "--trust"), ("info", "BAG", "--attachment", EVIL + "x"), ("play", "BAG"), ("export", "BAG", "--topics", EVIL))


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:1] + command[2:])[:20].encode("ascii", "replace").hex())
def test_no_command_hands_control_characters_on(flight, evil_bag, command):
    done = flight(*[evil_bag if part == "BAG" else part for part in command])
    said = done.out + done.err
    assert not [letter for letter in said if letter not in "\n\t" and printable(letter) != letter], repr(said)
    assert done.status in (0, 1, 2)


def test_files_that_are_written_have_plain_names(flight, evil_bag, tmp_path):
    flight("export", evil_bag, "--out", tmp_path / "tables")
    names = [path.name for path in (tmp_path / "tables").iterdir()]
    assert names and all(name.isascii() and name.isprintable() and "/" not in name for name in names)


def test_an_attachment_is_shown_as_it_is_to_a_pipe_and_as_text_to_a_terminal(flight, evil_bag, monkeypatch):
    assert flight("info", evil_bag, "--attachment", EVIL).out.replace("\r", "") == EVIL.replace("\r", "")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert "\x1b" not in flight("info", evil_bag, "--attachment", EVIL).out
