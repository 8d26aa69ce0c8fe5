"""``rampe-guard model``: what it shows, exports and deletes."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rampe_guard.core.intention import Intention
from rampe_guard.core.situation import Likeness
from rampe_guard.core.situation_memory import SituationMemory
from rampe_guard.core.types import Category
from rampe_guard.errors import ModelFileError, RampeGuardError
from rampe_guard.programs.modelling import export_model, reset_model, show_model
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import ModelFile, model_path, situations_file
from rampe_guard.runtime.store_format import decode, situations_header
from rampe_guard.runtime.store_keeper import Keeper
from rampe_guard.runtime.store_situations import encode_situations
from rampe_guard.settings import for_operator, load_site
from tests.support.models import bench_limits
from tests.support.processes import BENCH

SITE = str(BENCH)
START = np.array([0.2, 0.05, 0.06, 0.07])
DIG: Category = (0, -1, 1, 0)
SWING: Category = (1, 0, 0, 0)


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path))


def teach(operator: str | None = None) -> Path:
    """Seven primitives of two categories, kept as a guard keeps them; returns the file."""
    site = for_operator(load_site(BENCH), operator)
    limits = bench_limits(site)
    rampe = Intention(site.guard, limits).rampe
    with Keeper(site, limits, Sayer("rampe_guard.test")) as keeper:
        keeper.begin(rampe, 0.0)
        for k in range(5):
            rampe.observe(DIG, START, np.array([0.0, -0.01 - 0.001 * k, 0.02, 0.0]))
        for _ in range(2):
            rampe.observe(SWING, START, np.array([0.3, 0.0, 0.0, 0.0]))
    return model_path(site)


def remember(situations: int) -> Path:
    """So many situations, kept as a guard keeps them; returns the file."""
    site = load_site(BENCH)
    limits = bench_limits(site)
    file = situations_file(model_path(site))
    likeness = Likeness(np.ones(4))
    memory = SituationMemory(likeness, 4, 2.5, 10_000)
    for k in range(situations):
        memory.see(0.1 * k, np.full(4, 0.1 * k), np.full(likeness.size, 0.1 * k))
    with file:
        file.write(encode_situations(situations_header(site, limits), memory.pieces()))
    return file.path


def shown(action: Callable[[Console], int]) -> str:
    out = io.StringIO()
    assert action(Console(file=out, width=200)) == 0
    return out.getvalue()


def test_show_tells_whose_it_is_and_what_was_learned() -> None:
    path = teach("Anna Müller")
    lines = shown(lambda c: show_model(SITE, "Anna Müller", c)).splitlines()
    text = "\n".join(lines)
    for words in (
        "Anna Müller",
        "bench-excavator at bench",
        "7 primitives of 2 categories",
        str(path),
        f"{path.stat().st_size:,} bytes, rampe.model.v1",
    ):
        assert words in text
    rows = [line.split() for line in lines if line.rstrip().endswith((" m", " rad"))]
    # the standard deviation of 10, 11, 12, 13, 14 mm is √2 mm
    assert rows == [
        ["boom-", "stick+", "5", "boom", "-0.012", "0.001", "m"],
        ["stick", "+0.020", "0.000", "m"],
        ["swing+", "2", "swing", "+0.300", "0.000", "rad"],
    ]


def test_export_is_json_that_holds_all_of_it() -> None:
    path = teach()
    model = json.loads(export_model(SITE, None))
    header, arrays = decode(path.read_bytes())
    assert model["header"]["occurrences"] == header.occurrences == 7
    assert [a["name"] for a in model["header"]["actuators"]] == ["swing", "boom", "stick", "bucket"]
    dig = next(row for row in model["categories"] if tuple(row["category"]) == DIG)
    assert dig["occurrences"] == 5
    assert dig["mean_displacement"]["boom"] == pytest.approx(-0.012)
    assert dig["spread"]["boom"] == pytest.approx(0.001 * np.sqrt(2.0))
    assert set(model["arrays"]) == set(arrays)
    for name, array in arrays.items():
        values = np.array(model["arrays"][name]["values"], dtype=float).reshape(array.shape)
        assert (
            values.tobytes() == np.where(np.isfinite(array), array.astype(float), np.nan).tobytes()
        )


def test_what_is_not_finite_is_null_in_the_export() -> None:
    path = teach()
    _, arrays = decode(path.read_bytes())
    endless = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    text = export_model(SITE, None)
    assert b"NaN" not in text
    assert b"Infinity" not in text
    assert (b"null" in text) or not endless


@pytest.mark.parametrize("action", [export_model, lambda s, o: show_model(s, o, Console())])
def test_without_a_model_it_says_where_it_looked_and_who_is_known(
    action: Callable[[str, str | None], object], tmp_path: Path
) -> None:
    with pytest.raises(ModelFileError) as nobody:
        action(SITE, None)
    path = tmp_path / "bench" / "bench-excavator" / "operator.npz"
    assert f"nothing is kept of operator 'operator' yet: there is no {path};" in str(nobody.value)
    assert "kept here" not in str(nobody.value)
    teach("Anna")
    teach("ben")
    (path.parent / "rubbish.npz").write_bytes(b"rubbish")
    with pytest.raises(ModelFileError, match="kept here: 'Anna', 'ben';"):
        action(SITE, "anna")


def test_a_model_that_a_guard_would_refuse_is_said_and_left_alone() -> None:
    path = teach()
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ModelFileError, match=r"damaged .* a guard would set this file aside"):
        show_model(SITE, None, Console())
    assert path.exists()


def test_a_model_that_cannot_be_read_is_said() -> None:
    path = teach()
    path.unlink()
    path.mkdir()
    with pytest.raises(ModelFileError, match=f"{path}: it is not a regular file$"):
        show_model(SITE, None, Console())


def test_a_model_of_another_operator_under_this_name_is_refused() -> None:
    other, path = teach("ben"), teach("anna")
    path.write_bytes(other.read_bytes())
    with pytest.raises(ModelFileError, match="it is of operator 'ben', not 'anna'"):
        show_model(SITE, "anna", Console())


def test_reset_deletes_one_operator_and_says_what() -> None:
    other, path = teach("ben"), teach()
    text = shown(lambda c: reset_model(SITE, None, c, sure=False))
    assert f"forgotten: operator 'operator' on bench-excavator at bench; deleted {path}" in text
    assert not path.exists()
    assert other.exists()
    assert [p.name for p in path.parent.iterdir() if p.name.startswith("operator")] == []


def test_situations_are_shown_and_forgotten_with_the_model() -> None:
    path = teach()
    kept = remember(60)
    text = shown(lambda c: show_model(SITE, None, c))
    assert f"60 of 0.0 h of work, {kept.stat().st_size:,} bytes in {kept}" in text
    found = json.loads(export_model(SITE, None))["situations"]
    assert found == {"count": 60, "work_s": pytest.approx(5.9), "file": str(kept)}
    text = shown(lambda c: reset_model(SITE, None, c, sure=False))
    assert f"deleted {path}, {kept}" in " ".join(text.split())
    assert [p.name for p in path.parent.iterdir() if p.name.startswith("operator")] == []
    remember(5)  # a guard that was killed before it had learned a primitive
    with pytest.raises(ModelFileError, match=r"nothing is kept of operator 'operator' yet.*npz;"):
        show_model(SITE, None, Console())
    shown(lambda c: reset_model(SITE, None, c, sure=False))
    assert not kept.exists()


def test_spoilt_situations_are_told() -> None:
    teach()
    remember(5).write_bytes(b"rubbish")
    with pytest.raises(ModelFileError, match="would set this file aside and remember nothing"):
        show_model(SITE, None, Console())


def test_reset_of_nothing_makes_nothing(tmp_path: Path) -> None:
    text = shown(lambda c: reset_model(SITE, None, c, sure=False))
    assert "nothing is kept of operator 'operator'" in text
    assert list(tmp_path.iterdir()) == []
    teach("ben")
    folder = model_path(load_site(BENCH)).parent
    before = sorted(p.name for p in folder.iterdir())
    assert "nothing is kept" in shown(lambda c: reset_model(SITE, None, c, sure=False))
    assert sorted(p.name for p in folder.iterdir()) == before


def test_reset_is_refused_while_a_guard_would_save_again() -> None:
    path = teach()
    with ModelFile(path), pytest.raises(ModelFileError, match=r"running guard.*stop that first"):
        reset_model(SITE, None, Console(), sure=True)
    assert path.exists()


def test_reset_at_a_terminal_needs_yes(monkeypatch: pytest.MonkeyPatch) -> None:
    path = teach()
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    with pytest.raises(RampeGuardError, match="give --yes to do it"):
        reset_model(SITE, None, Console(), sure=False)
    assert path.exists()
    shown(lambda c: reset_model(SITE, None, c, sure=True))
    assert not path.exists()


def test_a_model_goes_on_over_many_runs(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    for _ in range(3):
        path = teach()
    assert decode(path.read_bytes())[0].occurrences == 21
    assert "14 primitives of 2 categories known" in caplog.text
