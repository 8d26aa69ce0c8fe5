"""Structs ↔ UTF-8 JSON: nothing that is not finite leaves, nothing malformed enters."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from enum import Enum
from typing import Any, TypeVar

import msgspec
import numpy as np

from rampe_guard.errors import MessageError

MAX_PAYLOAD_BYTES = 64 * 1024
MAX_OWN_BYTES = 16 * 1024 * 1024
"""Largest message of our own that a consumer decodes: a state holds many alerts."""

T = TypeVar("T")

_DECODERS: dict[Any, msgspec.json.Decoder[Any]] = {}
_MAKING = threading.Lock()


class Message(msgspec.Struct, frozen=True):
    """Base of all messages: unknown fields are ignored, so that a contract can grow."""


def encode(message: msgspec.Struct) -> bytes:
    """UTF-8 JSON of a message; numpy values become plain ones, None becomes null.

    Raises:
        MessageError: ``not_finite``, with the field: JSON has no NaN and no infinity, and
            null would read as "unknown" where a computation went wrong.
        TypeError: a field holds what JSON cannot say.
    """
    return msgspec.json.encode(_plain(message, type(message).__name__))


def decode(payload: bytes, kind: type[T], *, limit: int = MAX_OWN_BYTES) -> T:
    """Decode ``payload`` as a ``kind``, strictly: no text for numbers, no booleans as such.

    Raises:
        MessageError: ``too_large``, ``not_finite`` or ``bad_json``.
    """
    if len(payload) > limit:
        raise MessageError("too_large", f"{len(payload)} bytes, at most {limit} are taken")
    try:
        if not payload.isascii():  # msgspec does not look into the text of fields it ignores
            payload.decode()
        return _decoder(kind).decode(payload)
    except msgspec.ValidationError as error:
        if "out of range" in str(error):
            raise MessageError("not_finite", f"{error}; no such quantity exists") from None
        raise MessageError("bad_json", str(error)) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        if b"NaN" in payload or b"Infinity" in payload:
            raise MessageError("not_finite", "JSON has no NaN and no Infinity") from None
        raise MessageError("bad_json", str(error)) from None
    except RecursionError:
        raise MessageError("bad_json", "nested too deeply") from None


def _decoder(kind: type[T]) -> msgspec.json.Decoder[T]:
    """The decoder of a type, made by one thread: msgspec crashes if two make the first at once."""
    found = _DECODERS.get(kind)
    if found is None:
        with _MAKING:
            found = _DECODERS.setdefault(kind, msgspec.json.Decoder(kind))
    return found


def _plain(value: Any, where: str) -> Any:
    """``value`` in dicts, lists and scalars that JSON knows."""
    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise MessageError("not_finite", f"{where} is {value}; send None where unknown")
        return float(value)
    if isinstance(value, msgspec.Struct):
        names = value.__struct_encode_fields__
        pairs = zip(names, value.__struct_fields__, strict=True)
        return {out: _plain(getattr(value, own), f"{where}.{out}") for out, own in pairs}
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    raise TypeError(f"{where} is a {type(value).__name__}, which JSON cannot say")
