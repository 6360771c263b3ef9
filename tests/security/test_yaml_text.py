"""YAML from outside: numbers as people write them, and texts that unfold to more than can be meant."""

import math

import pytest

from flight_graph import yaml_text
from flight_graph.errors import FlightError

# Section 10.3.2 of the specification of YAML 1.2.2 (core schema), and the forms that people write besides.
NUMBERS = {"1e-3": 0.001, "1.0e-3": 0.001, "-1E5": -1e5, "+12e03": 12000.0, ".5": 0.5, "5.": 5.0, "685.230_15": 685.23015,
           "0": 0, "-0": 0, "010": 10, "0o7": 7, "0x3A": 58, "-19": -19, "1_000": 1000, "-.inf": -math.inf, ".Inf": math.inf}
TEXTS = ["1:30", "2001-01-01", "1e", "e5", "1.5.2", "_1", "1__0", "0x", "1e5x", "12 kg"]


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers(text):
    found = yaml_text.parse(text, "t")
    assert found == NUMBERS[text] and type(found) is type(NUMBERS[text])
    assert yaml_text.parse(f"[{text}]", "t") == [NUMBERS[text]] and yaml_text.parse(f"'{text}'", "t") == text


@pytest.mark.parametrize("text", TEXTS)
def test_texts(text):
    assert yaml_text.parse(text, "t") == text


def test_booleans_and_null_as_ros_knows_them():
    assert yaml_text.parse("[true, False, yes, off, null, ~, .nan]", "t")[:-1] == [True, False, True, False, None, None]
    assert math.isnan(yaml_text.parse(".nan", "t"))


def unfolding(first, one):
    """Nine values, nine times nine, ...: 9^9 in all."""
    return first + "".join(f"{name}: &{name} {one.format(','.join([f'*{before}'] * 9))}\n"
                           for before, name in zip("abcdefgh", "bcdefghi"))


REFUSED = {
    "lists": (unfolding("a: &a [x,x,x,x,x,x,x,x,x]\n", "[{}]"), "unfolds to more than 100000 values"),
    "merged mappings": (unfolding("a: &a {x: 1}\n", "{{<<: [{}]}}"), "unfolds to more than 100000 values"),
    "values": ("[" + "x," * 150_000 + "]", "unfolds to more than 100000 values"),
    "deep lists": ("[" * 100_000, "nested more than 50 deep"),
    "deep mappings": ("{a: " * 100_000, "nested more than 50 deep"),
    "deep keys": ("? " * 100_000, "nested more than 50 deep"),
    "deep blocks": ("- " * 100_000, "nested more than 50 deep"),
    "long": ("#" * (1 << 20) + "#", "longer than 1 MiB"),
    "in itself": ("&a [*a]", "'*a' stands for nothing, or for a value that it is in"),
    "digits": ("9" * 10_000, "a whole number of 10000 digits"),
    "python": ("!!python/object/apply:os.system [ls]", "this is no YAML: could not determine a constructor"),
    "binary": ("!!binary aGVsbG8=", "could not determine a constructor"),
    "date": ("!!timestamp 2001-99-99", "could not determine a constructor"),
    "two documents": ("a: 1\n---\nb: 2\n", "expected a single document"),
    "zero": (b"a\0b", "this is no text in UTF-8 (byte 1 is zero)"),
    "latin": ("a: é".encode("latin-1"), "this is no text in UTF-8 (byte 3)"),
    "half a mark": (b"\xff\xfea", "this is no text in UTF-8"),
    "list as key": ("{[1]: 2}", "this is no YAML"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name):
    text, sentence = REFUSED[name]
    with pytest.raises(FlightError) as caught:
        yaml_text.parse(text, "some.yaml")
    assert str(caught.value).startswith("some.yaml: ") and sentence in str(caught.value) and len(str(caught.value)) < 600


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_with_their_mark(tmp_path, encoding):
    (tmp_path / "a.yaml").write_text("title: Schwerkraft 9,8 m/s² größer\n", encoding=encoding)
    assert yaml_text.read(tmp_path / "a.yaml") == {"title": "Schwerkraft 9,8 m/s² größer"}


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "folder", "nowhere", "pipe"])
def test_what_is_no_ordinary_file(tmp_path, path):
    import os
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FlightError, match="no ordinary file|cannot be read"):
        yaml_text.read(tmp_path / path)
