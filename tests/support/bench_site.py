"""Copies of the bench site, elsewhere and changed."""

from __future__ import annotations

import re
from pathlib import Path

from tests.support.processes import BENCH, ROOT


def bench_copy(
    folder: Path,
    *more: str,
    machine: str = "excavator",
    scene: Path | None = None,
    name: str = "bench",
) -> Path:
    """The bench site below ``folder``.

    Args:
        folder: that is there.
        more: blocks of YAML that it has beside its own.
        machine: its name, also in its keys.
        scene: instead of its own.
        name: of the file.
    """
    text = re.sub(r"^files:.*\n", "", BENCH.read_text("utf-8"), flags=re.MULTILINE)
    for old, new in (
        ("../../geometry", str(ROOT / "geometry")),
        ("../scenes/bench.yaml", str(scene or ROOT / "config" / "scenes" / "bench.yaml")),
        ("rampe/bench/excavator", f"rampe/bench/{machine}"),
        ("machine: bench-excavator", f"machine: {machine}"),
    ):
        assert old in text, old
        text = text.replace(old, new)
    if "files:" in BENCH.read_text("utf-8"):
        text += f"\nfiles: {{allow: ['{ROOT}']}}\n"
    path = folder / f"{name}.yaml"
    path.write_text("\n".join((text, *more, "")), "utf-8")
    return path
