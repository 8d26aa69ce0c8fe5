"""Models as bytes: nothing is lost on the way, and nothing that is wrong gets in."""

from __future__ import annotations

import dataclasses
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rampe_guard.core.config import PriorConfig
from rampe_guard.errors import ModelFileError
from rampe_guard.runtime import store_format
from rampe_guard.runtime.store_format import (
    ActuatorTag,
    Header,
    decode,
    encode,
    header_of,
    misfit,
)
from tests.support.models import bench_limits, bench_site, same_bits, some_arrays, some_header

HEADER = Header(
    site="s",
    machine="m",
    operator="o",
    actuators=(ActuatorTag("swing", "rad", None, None), ActuatorTag("boom", "m", 0.0, 0.8)),
    settings={"basis": "affine", "n_init": 3},
    saved_unix_s=1e9,
    categories=2,
    occurrences=7,
    refused={"too_short": 4},
)
NAMES = st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=20)
DTYPES = st.one_of(
    hnp.boolean_dtypes(),
    hnp.integer_dtypes(endianness="?"),
    hnp.unsigned_integer_dtypes(endianness="?"),
    hnp.floating_dtypes(endianness="?"),
)
ARRAYS = hnp.arrays(DTYPES, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4))


def rewritten(content: bytes, changes: dict[str, bytes | None], **zip_options: Any) -> bytes:
    """A model file with other bytes (or none) for some members; new names are added."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", **zip_options) as z:
        members = {name: old.read(name) for name in old.namelist()}
        for name, body in {**members, **changes}.items():
            if body is not None:
                z.writestr(name, body)
    return out.getvalue()


def npy(array: npt.NDArray[Any], *, allow_pickle: bool = False) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=allow_pickle)
    return out.getvalue()


def header_npy(text: bytes) -> bytes:
    return npy(np.frombuffer(text, np.uint8))


def with_header(**changes: Any) -> bytes:
    """A model whose header has other fields, as a foreign program might write it."""
    content = encode(HEADER, some_arrays())
    with np.load(io.BytesIO(content)) as loaded:
        fields = json.loads(loaded["header"].tobytes())
    text = json.dumps({**fields, **changes}).encode()
    return rewritten(content, {"header.npy": header_npy(text)})


@settings(max_examples=300, deadline=None)
@given(st.dictionaries(NAMES.filter(lambda name: name != "header"), ARRAYS, max_size=5))
def test_a_snapshot_comes_back_bit_by_bit(arrays: dict[str, npt.NDArray[Any]]) -> None:
    header, back = decode(encode(HEADER, arrays))
    assert same_bits(arrays, back)
    assert msgspec.structs.replace(header, arrays={}) == HEADER
    assert all(array.flags.writeable for array in back.values())


def test_order_of_memory_and_nan_are_kept() -> None:
    strange = np.array([np.nan, -np.nan, -0.0, np.inf, 5e-324])
    arrays = {"f": np.asfortranarray(np.arange(6.0).reshape(2, 3)), "strange": strange}
    assert same_bits(arrays, decode(encode(HEADER, arrays))[1])


def test_numpy_alone_can_read_it() -> None:
    arrays = some_arrays()
    with np.load(io.BytesIO(encode(HEADER, arrays)), allow_pickle=False) as loaded:
        assert same_bits(arrays, {name: loaded[name] for name in arrays})
        header = json.loads(loaded["header"].tobytes())
    assert header["format"] == "rampe.model.v1"
    assert header["actuators"][1] == {"name": "boom", "unit": "m", "lower": 0.0, "upper": 0.8}


def test_the_same_model_gives_the_same_bytes() -> None:
    assert encode(HEADER, some_arrays()) == encode(HEADER, some_arrays())


@pytest.mark.parametrize("array", [np.array([None]), np.array(["a"]), np.array([1j])])
def test_only_numbers_are_written(array: npt.NDArray[Any]) -> None:
    with pytest.raises(ValueError, match="must be bool, int or float"):
        encode(HEADER, {"a": array})


@pytest.mark.parametrize("name", ["", "header", "a\n", "ä", "x" * 201])
def test_names_that_cannot_stand_in_a_file(name: str) -> None:
    with pytest.raises(ValueError, match="cannot be the name"):
        encode(HEADER, {name: np.zeros(1)})


def test_a_file_cut_anywhere_is_refused() -> None:
    content = encode(HEADER, {"theta": np.arange(3.0)})
    for end in range(len(content)):
        with pytest.raises(ModelFileError, match=r"damaged|header|arrays"):
            decode(content[:end])


def test_a_byte_changed_anywhere_is_refused_or_changes_nothing() -> None:
    arrays = {"theta": np.arange(3.0), "count": np.arange(2)}
    content = encode(HEADER, arrays)
    intact = decode(content)[0]
    for at in range(len(content)):
        for flip in (0x01, 0x80, 0xFF):
            changed = bytearray(content)
            changed[at] ^= flip
            try:
                header, back = decode(bytes(changed))
            except ModelFileError:
                continue
            assert header == intact
            assert same_bits(arrays, back)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=400))
def test_rubbish_is_refused(content: bytes) -> None:
    with pytest.raises(ModelFileError):
        decode(content)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200), st.sampled_from(["header.npy", "theta.npy"]))
def test_a_well_formed_zip_of_rubbish_is_refused(body: bytes, name: str) -> None:
    magic = b"\x93NUMPY\x01\x00"
    for member in (body, magic + body, magic + len(body).to_bytes(2, "little") + body):
        with pytest.raises(ModelFileError):
            decode(rewritten(encode(HEADER, some_arrays()), {name: member}))


def claim(shape: str, descr: str = "<f8") -> bytes:
    """An array that claims a shape and holds 8 bytes."""
    text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(8)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"header.npy": None}, "no header"),
        ({"header.npy": npy(np.zeros(3))}, "no header"),
        ({"header.npy": header_npy(b"{")}, "header is wrong"),
        ({"header.npy": header_npy(b"\xff")}, "header is wrong"),
        ({"header.npy": header_npy(b"[" * 100_000)}, "header is wrong"),
        ({"header.npy": header_npy(b"{}")}, "header is wrong"),
        ({"theta.npy": None}, "arrays are not those"),
        ({"theta.npy": npy(np.zeros((3, 5)))}, "arrays are not those"),
        ({"theta.npy": npy(np.zeros((5, 3), np.float32))}, "arrays are not those"),
        ({"more.npy": npy(np.zeros(3))}, "arrays are not those"),
        ({"theta.npy": npy(np.array([print]), allow_pickle=True)}, "has type object"),
        ({"theta.npy": claim("(1000000000000,)")}, "has 8 bytes"),
        ({"theta.npy": claim("(-1,)")}, "has 8 bytes"),
        ({"theta.npy": claim("(1,)", "|S8")}, "has type"),
        ({"theta.npy": claim("(" * 300 + ")" * 300)}, "damaged"),
        ({"theta.npy": b"\x93NUMPY\x02\x00" + bytes(30)}, "npy version"),
        ({"theta": npy(np.zeros(1))}, "no array"),
    ],
)
def test_a_file_that_somebody_made_up_is_refused(
    changes: dict[str, bytes | None], expected: str
) -> None:
    with pytest.raises(ModelFileError, match=expected):
        decode(rewritten(encode(HEADER, some_arrays()), changes))


def test_a_compressed_file_is_refused_before_it_grows() -> None:
    bomb = npy(np.zeros(10_000_000))
    content = encode(HEADER, some_arrays())
    small = rewritten(content, {"theta.npy": bomb}, compression=zipfile.ZIP_DEFLATED)
    assert len(small) < len(bomb) / 100
    with pytest.raises(ModelFileError, match="larger than the whole"):
        decode(small)
    noise = np.random.default_rng(1).integers(0, 256, 5000, np.uint8)  # does not shrink
    same = rewritten(encode(HEADER, {"noise": noise}), {}, compression=zipfile.ZIP_DEFLATED)
    with pytest.raises(ModelFileError, match="is compressed"):
        decode(same)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_array_that_is_twice_in_it_is_refused() -> None:
    out = io.BytesIO(encode(HEADER, some_arrays()))
    with zipfile.ZipFile(out, "a") as archive:
        archive.writestr("theta.npy", npy(np.ones((5, 3))))
    with pytest.raises(ModelFileError, match=r"'theta\.npy' is twice"):
        decode(out.getvalue())


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "rampe.model.v2"}, r"'rampe.model.v2', and this version .* 'rampe.model.v1'"),
        ({"format": "rampe.model.v2", "site": 3}, "its format is 'rampe.model.v2'"),
        ({"format": None}, "header is wrong"),
        ({"site": 3}, r"header is wrong: Expected `str`, got `int` - at `\$.site`"),
        ({"saved_unix_s": 1e300}, "saved_unix_s"),
        ({"occurrences": -1}, "occurrences"),
        ({"surprise": 1}, "unknown field"),
    ],
)
def test_a_header_of_another_kind_is_refused(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(ModelFileError, match=expected):
        decode(with_header(**changes))


def test_size_is_bounded_both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    content = encode(HEADER, {"a": np.zeros(1000)})
    monkeypatch.setattr(store_format, "MAX_BYTES", 8000)
    with pytest.raises(ModelFileError, match="at most"):
        decode(content)
    with pytest.raises(ModelFileError, match="at most"):
        encode(HEADER, {"a": np.zeros(1000)})  # its arrays alone would just fit
    with pytest.raises(ModelFileError, match="in 1 arrays"):
        encode(HEADER, {"a": np.zeros(1001)})
    monkeypatch.setattr(store_format, "MAX_BYTES", 100_000)
    monkeypatch.setattr(store_format, "MAX_ARRAYS", 2)
    with pytest.raises(ModelFileError, match="in 3 arrays"):
        encode(HEADER, {str(k): np.zeros(1) for k in range(3)})


def test_a_model_fits_its_own_site_also_after_the_file(tmp_path: Path) -> None:
    needed = some_header(bench_site(tmp_path))
    found, _ = decode(encode(needed, some_arrays()))
    assert misfit(found, needed) is None


def test_what_does_not_change_the_meaning_may_change(tmp_path: Path) -> None:
    site = bench_site(tmp_path)
    limits = bench_limits(site)
    prior = PriorConfig(spread=0.5)
    rampe = dataclasses.replace(site.guard.rampe, n_init=9, forgetting=0.9, prior=prior)
    other = dataclasses.replace(site, guard=dataclasses.replace(site.guard, rampe=rampe))
    assert misfit(header_of(site, limits), header_of(other, limits * (1 + 1e-12))) is None


def test_misfit_names_what_differs(tmp_path: Path) -> None:
    needed = some_header(bench_site(tmp_path))
    swing, boom, *rest = needed.actuators
    basis = needed.settings["basis"]

    def told(**changes: Any) -> str:
        text = misfit(msgspec.structs.replace(needed, **changes), needed)
        assert text is not None
        return text

    assert told(operator="ben") == "it is of operator 'ben', not 'anna'"
    assert "machine 'x'" in told(machine="x")
    assert "site 'x'" in told(site="x")
    assert "actuators are boom [m], swing [rad], stick" in told(actuators=(boom, swing, *rest))
    assert "swing [m], boom [m]" in told(
        actuators=(msgspec.structs.replace(swing, unit="m"), boom, *rest)
    )
    assert "actuators are swing [rad];" in told(actuators=(swing,))
    longer = msgspec.structs.replace(boom, upper=0.119)
    assert "limits of boom were 0 to 0.119 m when it was learned and are 0 to 0.118 m now" in told(
        actuators=(swing, longer, *rest)
    )
    endless = msgspec.structs.replace(swing, lower=None, upper=None)
    assert "limits of swing were none" in told(actuators=(endless, boom, *rest))
    half = msgspec.structs.replace(swing, lower=None)
    assert "limits of swing were … to 3.2 rad" in told(actuators=(half, boom, *rest))
    assert "learned with rampe.basis 'cubic'; the site file has" in told(
        settings={**needed.settings, "basis": "cubic"}
    )
    assert "learned with rampe.observations None" in told(settings={"basis": basis})
