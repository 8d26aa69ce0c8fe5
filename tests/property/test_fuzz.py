"""Spoilt messages and files; the deep form is ``python -m tests.benchmarks.fuzz``."""

from __future__ import annotations

from pathlib import Path

import pytest

from rampe_guard import kernel_cache
from tests.benchmarks.fuzz import Files, fuzz_files
from tests.support.depth import depth
from tests.support.message_fuzz import fuzz_messages


@pytest.mark.parametrize("cdr", [False, True], ids=["json", "cdr"])
def test_spoilt_messages_neither_stop_a_guard_nor_clear_its_alert(
    tmp_path: Path, *, cdr: bool
) -> None:
    found = fuzz_messages(tmp_path, depth(3_000, 200_000), 1, cdr=cdr)
    assert found.wrong == []
    assert found.judged > 50  # the arm pushed, and was shown to
    assert {"joystick", "actuators", "enabled", "object_pose", "ack", "shelve"} <= found.fed.keys()
    assert found.well_formed.total() > 0  # it is not all rubbish


def test_spoilt_files_are_refused_with_words(tmp_path: Path) -> None:
    kernel_cache.choose_folder()
    found = Files()
    fuzz_files(tmp_path / "files", 1, 0, depth(10, 2_000), found)
    assert found.wrong == []
    assert found.outcomes.total() == depth(10, 2_000)
    assert {outcome for _, outcome in found.outcomes} <= {"ok", "refused"}
