"""A learned model as bytes, format ``rampe.model.v1``: numeric arrays and a header in JSON.

The bytes are a zip of ``.npy`` members, as `numpy.savez` writes it, so that numpy reads it
without us; one of them, ``header``, is JSON (UTF-8) as an array of bytes. There is no pickle
in it and none is ever loaded: a model can come from anywhere without running anything. What
is read is checked in full (checksums, names, shapes, sizes) before a value of it is used.
"""

from __future__ import annotations

import dataclasses
import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt

from rampe_guard import __version__
from rampe_guard.core.types import FloatArray
from rampe_guard.errors import ModelFileError
from rampe_guard.settings import Site

FORMAT: Final = "rampe.model.v1"
SITUATIONS: Final = "rampe.situations.v1"
MAX_BYTES: Final = 64 * 2**20
"""Largest file that is written or read: far above what a hand of 28 axes learns in a year."""
MAX_SITUATION_BYTES: Final = 256 * 2**20
"""The same of situations: a day of 4 actuators has 18 MiB, of 16 some 65 MiB."""
MAX_ARRAYS: Final = 100_000
MAX_ARRAY_NAME: Final = 200

Arrays: TypeAlias = dict[str, npt.NDArray[Any]]

_HEADER = "header"
_SUFFIX = ".npy"
_NUMERIC = "biuf"
"""Kinds of numpy's dtypes: bool, int, unsigned, float."""
_SAME: Final = {
    FORMAT: (("basis", "rampe.basis"), ("observations", "rampe.observations")),
    SITUATIONS: (("max_velocity", "max_velocity"),),
}
"""Settings that decide what the numbers mean, and their names in the site file; others decide how
one goes on from them."""
_SAME_LIMIT = 1e-6
"""Limits may differ by this share of the range: rounding in the URDF and in the drive."""
_BROKEN = (
    *(zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, SyntaxError),
    *(OSError, RuntimeError, ValueError, TypeError, EOFError, KeyError, ArithmeticError),
    MemoryError,
)
"""What the readers of zip and npy raise on rubbish."""


_Time = Annotated[float, msgspec.Meta(ge=0.0, le=2.5e11)]
"""Unix time [s] that a calendar can show."""
_Count = Annotated[int, msgspec.Meta(ge=0)]


class ActuatorTag(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An actuator as it was when the model was learned; limits [unit], null: endless."""

    name: str
    unit: str
    lower: float | None
    upper: float | None


class Header(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a model is of.

    Attributes:
        format: name and version of this format.
        version: of the software that wrote it.
        site, machine, operator: whose model it is.
        actuators: in the order of the arrays.
        settings: of the estimator (`core.config.RampeConfig`); of situations, what scales them.
        saved_unix_s: when it was saved [s].
        categories: how many were learned; 0 of situations.
        occurrences: primitives learned, of all categories; of situations, how many there are.
        refused: primitives that were not learned, by reason.
        arrays: type and shape of every array, such as ``<f8(3, 4)``.
    """

    format: Literal["rampe.model.v1", "rampe.situations.v1"] = FORMAT
    version: str = __version__
    site: str
    machine: str
    operator: str
    actuators: tuple[ActuatorTag, ...]
    settings: dict[str, Any]
    saved_unix_s: _Time = 0.0
    categories: _Count = 0
    occurrences: _Count = 0
    refused: dict[str, _Count] = {}
    arrays: dict[str, str] = {}


class _Format(msgspec.Struct):
    """The one field that every version of the header has."""

    format: str


def header_of(site: Site, limits: FloatArray) -> Header:
    """The header of a model that a guard of ``site`` can use.

    Args:
        site: with its operator.
        limits: (n, 2) [unit], infinite where there are none.
    """
    actuators = tuple(
        ActuatorTag(actuator.name, actuator.unit, *(_finite(limit) for limit in pair))
        for actuator, pair in zip(site.guard.actuators, limits.tolist(), strict=True)
    )
    return Header(
        site=site.name,
        machine=site.machine,
        operator=site.operator,
        actuators=actuators,
        # through JSON, so that they equal what is read back from a file
        settings=msgspec.json.decode(msgspec.json.encode(dataclasses.asdict(site.guard.rampe))),
    )


def situations_header(site: Site, limits: FloatArray) -> Header:
    """The same of situations."""
    top = [actuator.max_velocity for actuator in site.guard.actuators]
    return msgspec.structs.replace(
        header_of(site, limits), format=SITUATIONS, settings={"max_velocity": top}
    )


def misfit(found: Header, needed: Header) -> str | None:
    """Why a model with the header ``found`` cannot serve where ``needed`` is; None if it can."""
    for field in ("site", "machine", "operator"):
        has, needs = getattr(found, field), getattr(needed, field)
        if has != needs:
            return f"it is of {field} {has!r}, not {needs!r}"
    has, needs = ([f"{a.name} [{a.unit}]" for a in h.actuators] for h in (found, needed))
    if has != needs:
        return f"its actuators are {', '.join(has)}; those of the site file {', '.join(needs)}"
    for old, new in zip(found.actuators, needed.actuators, strict=True):
        if not _same_limits(old, new):
            return (
                f"the limits of {old.name} were {_span(old)} when it was learned and are"
                f" {_span(new)} now"
            )
    for name, told in _SAME[needed.format]:
        was, now = found.settings.get(name), needed.settings.get(name)
        if was != now:
            return f"it was learned with {told} {was!r}; the site file has {now!r}"
    return None


def encode(header: Header, arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """A model as the bytes of its file; the same model gives the same bytes.

    Raises:
        ValueError: an array is not numeric, or its name cannot stand in a file.
        ModelFileError: the file would be larger than its format may be (`most_bytes`).
    """
    most = most_bytes(header.format)
    described = {}
    for name, array in arrays.items():
        if array.dtype.kind not in _NUMERIC or array.dtype.hasobject:
            raise ValueError(f"array {name!r} is of type {array.dtype}, must be bool, int or float")
        if not _good_name(name):
            raise ValueError(f"{name!r} cannot be the name of an array")
        described[name] = _described(array)
    total = sum(array.nbytes for array in arrays.values())
    if total > most or len(arrays) > MAX_ARRAYS:
        raise ModelFileError(_too_large(total, len(arrays), most))
    text = msgspec.json.encode(msgspec.structs.replace(header, arrays=described))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, array in ((_HEADER, np.frombuffer(text, np.uint8)), *arrays.items()):
            member = io.BytesIO()
            np.lib.format.write_array(member, array, version=(1, 0), allow_pickle=False)
            # a member written by name would carry the time of day
            archive.writestr(zipfile.ZipInfo(name + _SUFFIX), member.getbuffer())
    content = out.getvalue()
    if len(content) > most:
        raise ModelFileError(_too_large(len(content), len(arrays), most))
    return content


def most_bytes(form: str) -> int:
    """Size of the largest file of a format that is written or read."""
    return MAX_SITUATION_BYTES if form == SITUATIONS else MAX_BYTES


def decode(content: bytes, form: str = FORMAT) -> tuple[Header, Arrays]:
    """The header and the arrays of a file of the format ``form``, all of it checked.

    Raises:
        ModelFileError: anything at all is wrong with it; the message says what.
    """
    most = most_bytes(form)
    if len(content) > most:
        raise ModelFileError(_too_large(len(content), None, most))
    try:
        arrays = _members(content)
    except _BROKEN as error:
        raise ModelFileError(f"it is damaged or no model file ({error})") from None
    header = _header(arrays.pop(_HEADER, None), form)
    if header.arrays != {name: _described(array) for name, array in arrays.items()}:
        raise ModelFileError("its arrays are not those that its header names")
    return header, arrays


def _members(content: bytes) -> Arrays:
    arrays: Arrays = {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > MAX_ARRAYS + 1:
            raise ValueError(f"{len(members)} arrays")
        if sum(member.file_size for member in members) > len(content):
            raise ValueError("its parts are larger than the whole")
        for member in members:
            name = member.filename.removesuffix(_SUFFIX)
            if name == member.filename or name in arrays:
                raise ValueError(f"{member.filename!r} is twice in it, or no array")
            if member.compress_type != zipfile.ZIP_STORED:
                raise ValueError(f"{name!r} is compressed")
            arrays[name] = _array(archive.read(member))  # checks its CRC
    return arrays


def _array(content: bytes) -> npt.NDArray[Any]:
    """One ``.npy``; numpy's own reader would reserve whatever a shape claims before it looks."""
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"an array has npy version {version}")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    body = content[stream.tell() :]
    if dtype.kind not in _NUMERIC or dtype.hasobject:
        raise ValueError(f"an array has type {dtype}")
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(body):
        raise ValueError(f"an array of shape {shape} has {len(body)} bytes")
    order: Literal["F", "C"] = "F" if fortran else "C"
    return np.ndarray(shape, dtype, bytearray(body), order=order)


def _header(raw: npt.NDArray[Any] | None, form: str) -> Header:
    if raw is None or raw.dtype != np.uint8 or raw.ndim != 1:
        raise ModelFileError("it has no header")
    text = raw.tobytes()
    try:
        found = msgspec.json.decode(text, type=_Format).format
        if found != form:
            raise ModelFileError(
                f"its format is {found!r}, and this version ({__version__}) reads {form!r}"
            )
        return msgspec.json.decode(text, type=Header)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ModelFileError(f"its header is wrong: {error}") from None


def _described(array: npt.NDArray[Any]) -> str:
    return f"{array.dtype.str}{array.shape}"


def _good_name(name: str) -> bool:
    fits = 0 < len(name) <= MAX_ARRAY_NAME and name != _HEADER
    return fits and name.isascii() and name.isprintable()


def _too_large(size: int, arrays: int | None, most: int) -> str:
    many = "" if arrays is None else f" in {arrays} arrays"
    return f"it has {size / 2**20:.1f} MiB{many}; at most {most >> 20} MiB are kept"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _same_limits(old: ActuatorTag, new: ActuatorTag) -> bool:
    span = 1.0
    if old.lower is not None and old.upper is not None:
        span = abs(old.upper - old.lower)
    for was, now in ((old.lower, new.lower), (old.upper, new.upper)):
        if (was is None) != (now is None):
            return False
        if was is not None and now is not None and abs(was - now) > _SAME_LIMIT * span:
            return False
    return True


def _span(actuator: ActuatorTag) -> str:
    if actuator.lower is None and actuator.upper is None:
        return "none"
    low, high = ("…" if v is None else f"{v:.6g}" for v in (actuator.lower, actuator.upper))
    return f"{low} to {high} {actuator.unit}"
