"""YAML with lines: the core schema, and refusal of everything odd."""

from __future__ import annotations

import math
import pickle

import pytest

from rampe_guard.errors import SettingsError
from rampe_guard.settings.problems import did_you_mean, dotted, show
from rampe_guard.settings.source import MAX_BYTES, MAX_DEPTH, parse, scalar


def refusal(content: bytes | str) -> str:
    with pytest.raises(SettingsError) as caught:
        parse(content, "f.yaml")
    return str(caught.value)


def test_values_and_lines() -> None:
    document = parse("a: 1\nb:\n  - {c: x}\n  - [2,\n     3.5]\n'd': \"5\"\n", "f.yaml")
    assert document.data == {"a": 1, "b": ({"c": "x"}, (2, 3.5)), "d": "5"}
    assert document.line(("a",)) == 1
    assert document.line(("b", 0, "c")) == 3
    assert document.line(("b", 1, 1)) == 5
    assert document.line(("d",)) == 6
    assert document.line(("b", 1, "missing")) == 4
    assert document.line(("missing",)) == 1


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("~", None),
        ("null", None),
        ("true", True),
        ("False", False),
        ("yes", "yes"),
        ("on", "on"),
        ("12", 12),
        ("-012", -12),
        ("0x1F", 31),
        ("0o17", 15),
        ("1e-9", 1e-9),
        (".5", 0.5),
        ("3.", 3.0),
        ("-.inf", -math.inf),
        ("12:30", "12:30"),
        ("1_000", "1_000"),
        ("2020-01-01", "2020-01-01"),
        ("9" * 5000, math.inf),
    ],
)
def test_scalars_follow_the_core_schema(text: str, value: object) -> None:
    assert scalar(text) == value
    assert type(scalar(text)) is type(value)


def test_nan_is_read_as_nan() -> None:
    value = scalar(".nan")
    assert isinstance(value, float)
    assert math.isnan(value)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("a: 1\nb: 2\na: 3\n", "f.yaml:3: a is given twice (first in line 1)"),
        ("a: &x 1\n", "f.yaml:1: anchor 'x'"),
        ("a: 1\nb: *x\n", "f.yaml:2: alias 'x'"),
        ("a: !!python/object:os.system 1\n", "f.yaml:1: tag"),
        ("a: 1\n---\nb: 1\n", "f.yaml:2: a second document starts here"),
        ("a: 1\n? [b]\n: 2\n", "f.yaml:2: a list or mapping as a key"),
        ("a: 1\nb: [1, 2\nc: 3\n", "f.yaml:3: is not valid YAML: while parsing a flow sequence"),
        ("a: 1\n\tb: 2\n", "f.yaml:2: is not valid YAML"),
        ("a: 'x\n", "is not valid YAML"),
        ("a: \x00\n", "f.yaml:1: is not valid YAML"),
        (b"a: 1\nb: \xff\n", "f.yaml:2: byte 0xff is not UTF-8"),
        ("a: \ud800", "is not UTF-8"),
        ("a: " + "[" * (MAX_DEPTH + 1), "nested deeper than 24 levels"),
        ("[" * 9_000, "nested deeper than 24 levels"),
        (b"#" * (MAX_BYTES + 1), "is larger than 1 MB"),
        ("a: 1\n" + "!" * 10_001, "f.yaml:2: the line has more than 10000 characters"),
    ],
)
def test_odd_yaml_is_refused_with_its_line(content: bytes | str, expected: str) -> None:
    assert expected in refusal(content)


def test_number_of_values_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rampe_guard.settings.source.MAX_VALUES", 50)
    assert "more than 50 values" in refusal("[" + "1," * 60 + "]")


def test_byte_order_mark_is_no_part_of_the_first_key() -> None:
    assert parse("\ufeffa: 1\n".encode(), "f.yaml").data == {"a": 1}


def test_paths_and_values_are_shown_on_one_line() -> None:
    assert dotted(("arm", "actuators", 1, "max_velocity")) == "arm.actuators[1].max_velocity"
    assert dotted(("log", "a b\n")) == "log.'a b\\n'"
    assert show("x" * 500).endswith("…")
    assert len(show("x" * 500)) == 48
    assert did_you_mean("zzz", ["a", "b"]) == "known here: 'a', 'b'"
    assert did_you_mean("a", []) == "none is known here"


def test_several_problems_stay_several_on_their_way_to_another_process() -> None:
    error = pickle.loads(pickle.dumps(SettingsError("a\nb: wrong", "c: wrong")))  # noqa: S301
    assert error.lines == ("a\nb: wrong", "c: wrong")
    assert str(error) == "a\nb: wrong\nc: wrong"
