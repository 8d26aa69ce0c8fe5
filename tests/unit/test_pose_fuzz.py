from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = 300


def test_no_pose_that_is_let_through_brings_the_sweep_down_or_makes_it_lie(tmp_path: Path) -> None:
    case = tmp_path / "case.json"
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.pose_fuzz", str(case), str(EXAMPLES)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if done.returncode:
        held = case.read_text() if case.exists() else "none"
        pytest.fail(f"exit code {done.returncode} on {held}\n{done.stderr[-3000:]}")
    let_through, refused = (int(word) for word in done.stdout.split())
    # both must happen, or nothing was tried
    assert let_through > EXAMPLES // 4
    assert refused > EXAMPLES // 10
