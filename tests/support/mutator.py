"""Spoils messages and files, seeded: bits, bytes, and JSON as JSON.

The same seed gives the same spoilt messages, whatever the machine.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from typing import Any

RAW = (
    *("NaN", "Infinity", "-Infinity", "1e400", "-1e400", "1e308", "-1e308", "5e-324", "-0.0"),
    *("1e-400", "9" * 400, "0." + "1" * 400, "18446744073709551616", "-9223372036854775809"),
    *("01", "+1", ".5", "1.", "0x10", "1_000", "true", "false", "null", "[]", "{}", '""'),
    *('"\\ud800"', '"\\udfff\\ud800"', '"\\u0000"', '"\x00"', '"\ufeff"', '"1"', '"NaN"'),
    *("[[]]", "[null]", '{"a":{}}', "nul", "'x'"),
)
"""What is put in place of a value, as it stands in the text."""
BYTES = (
    *(b"\x00", b"\xff", b"\xc0\x80", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xef\xbb\xbf"),
    *(b"{", b"}", b"[", b"]", b'"', b"\\", b",", b":", b"\n", b"\x1b[2J", b"\r\n2026 INFO ok"),
)
_LARGE = 0.004
"""Share of messages that are made very long or deep."""
_MARK = "@raw%d@"


class Mutator:
    """Makes bad messages out of good ones.

    Args:
        rng: of all choices.
        corpus: good messages, spliced into one another.
    """

    def __init__(self, rng: random.Random, corpus: Sequence[bytes]) -> None:
        self._rng, self._corpus = rng, corpus

    def spoil(self, good: bytes) -> bytes:
        """One to three things done to a message; now and then none at all."""
        rng = self._rng
        if rng.random() < _LARGE:
            return self._huge(good)
        message = self._json(good) if rng.random() < 0.6 else good
        for _ in range(rng.choice((0, 1, 1, 2)) if message is not good else rng.randint(1, 3)):
            message = self.spoil_bytes(message)
        return message

    def spoil_bytes(self, text: bytes) -> bytes:
        """One thing done to its bytes."""
        rng = self._rng
        at = rng.randrange(len(text) + 1)
        end = min(len(text), at + rng.randint(1, 12))
        way = rng.randrange(7)
        if way == 0:
            return self._bits(text)
        ways: tuple[Callable[[], bytes], ...] = (
            lambda: rng.choice(BYTES) + text[at:],
            lambda: text[end:],
            lambda: b"",
            lambda: text[at:end] * rng.randint(2, 5) + text[end:],
            self._tail,
            lambda: rng.randbytes(rng.randint(1, 8)) + text[end:],
        )
        return text[:at] + ways[way - 1]()

    def _bits(self, text: bytes) -> bytes:
        spoilt = bytearray(text)
        for _ in range(self._rng.randint(1, 8) if spoilt else 0):
            spoilt[self._rng.randrange(len(spoilt))] ^= 1 << self._rng.randrange(8)
        return bytes(spoilt)

    def _tail(self) -> bytes:
        other = self._rng.choice(self._corpus)
        return other[self._rng.randrange(len(other) + 1) :]

    def _json(self, good: bytes) -> bytes:
        """Changed as JSON; what is not JSON is left alone."""
        try:
            tree = json.loads(good)
        except (ValueError, RecursionError):
            return good
        raws: list[str] = []
        for _ in range(self._rng.choice((1, 1, 1, 2, 3))):
            tree = self._changed(tree, raws)
        text = json.dumps(tree)
        for i, raw in reversed(list(enumerate(raws))):
            text = text.replace(json.dumps(_MARK % i), raw)
        return text.encode("utf-8", "surrogatepass")

    def _changed(self, tree: Any, raws: list[str]) -> Any:
        rng = self._rng
        if isinstance(tree, dict) and tree and rng.random() < 0.85:
            return self._changed_object(tree, raws)
        if isinstance(tree, list) and tree and rng.random() < 0.8:
            at, choice = rng.randrange(len(tree)), rng.random()
            if choice < 0.6:
                return [*tree[:at], self._changed(tree[at], raws), *tree[at + 1 :]]
            if choice < 0.75:
                return tree[:at] + tree[at + 1 :]
            return tree[:at] + tree[at:] * rng.randint(1, 3)
        if isinstance(tree, float | int) and not isinstance(tree, bool) and rng.random() < 0.5:
            return tree * rng.choice((-1, 0, 2, 1e3, 1e6, 1e-9)) + rng.choice((0, 0, 1, -1, 0.01))
        return self._raw(raws, rng.choice(RAW))

    def _changed_object(self, tree: dict[str, Any], raws: list[str]) -> dict[str, Any]:
        rng = self._rng
        key, choice = rng.choice(list(tree)), rng.random()
        if choice < 0.6:
            return {**tree, key: self._changed(tree[key], raws)}
        if choice < 0.7:
            return {k: v for k, v in tree.items() if k != key}
        if choice < 0.8:
            other = key + rng.choice(("", " ", "s", "\x00"))
            return {(other if k == key else k): v for k, v in tree.items()}
        if choice < 0.9:  # the same key twice
            twice = f"{rng.choice(RAW)}, {json.dumps(key)}: {json.dumps(tree[key])}"
            return {**tree, key: self._raw(raws, twice)}
        return {**tree, rng.choice(("x", "stamp", "name", "__proto__", "")): tree[key]}

    @staticmethod
    def _raw(raws: list[str], text: str) -> str:
        raws.append(text)
        return _MARK % (len(raws) - 1)

    def _huge(self, good: bytes) -> bytes:
        rng = self._rng
        count = rng.choice((100, 1_000, 10_000, 60_000, 200_000))
        match rng.randrange(6):
            case 0:
                return b"[" * count
            case 1:
                return b'{"a":' * count + b"1" + b"}" * count
            case 2:
                return b'{"axes": [' + b"0," * count + b"0]}"
            case 3:
                return good + b" " * count
            case 4:
                return b'{"position": [' + b"9" * count + b"]}"
            case _:
                return b'{"' + b"k" * count + b'": "' + b"\\ud800" * (count // 6) + b'"}'
