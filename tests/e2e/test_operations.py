"""What the pages for who runs a site say is so: commands run, no status is left out."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rampe_guard.core.monitor import OVERLOAD
from tests.support.pki import HAVE_OPENSSL
from tests.support.processes import ROOT

pytestmark = pytest.mark.e2e
DEPLOY = ROOT / "deploy"
OPERATIONS = (DEPLOY / "operations.md").read_text("utf-8")
THREATS = (DEPLOY / "threat-model.md").read_text("utf-8")


@pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl: no certificates")
def test_the_commands_run_as_they_stand(tmp_path: Path) -> None:
    blocks = re.findall(r"<!-- run -->\n```sh\n(.*?)```", OPERATIONS, re.DOTALL)
    assert len(blocks) >= 3
    commands = tmp_path / "bin"
    commands.mkdir()
    script = commands / "rampe-guard"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rampe_guard "$@"\n')
    script.chmod(0o755)
    found = os.pathsep.join((str(commands), str(DEPLOY), os.environ["PATH"]))
    done = subprocess.run(
        ["/bin/bash", "-euo", "pipefail", "-c", "".join(blocks)],
        cwd=tmp_path,
        env={**os.environ, "PATH": found, "DEPLOY": str(DEPLOY), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "router.json5: 1 machines, 7 certificates" in done.stdout
    # each name on the list has a certificate
    access = (tmp_path / "access.yaml").read_text()
    for name in re.findall(r"certificate: ([\w-]+)", access):
        assert (tmp_path / "pki" / name / "tls.key").is_file()


def test_every_reason_and_refusal_is_explained() -> None:
    source = "\n".join(path.read_text("utf-8") for path in (ROOT / "rampe_guard").rglob("*.py"))
    reasons = set(re.findall(r"(?:wire\.)?Reason\(\s*(?:code=)?\"([a-z_]+)\"", source))
    assert len(reasons) >= 15
    refusals = set(re.findall(r"MessageError\(\s*\"([a-z_]+)\"", source))
    refusals |= {"stamp_back", "stamp_jump", "position_jump", "position_out_of_range"}
    for word in {OVERLOAD, *reasons, *refusals}:
        assert f"`{word}`" in OPERATIONS, word
    for word in ("NAME_silent", "NAME_late"):
        assert f"`{word}`" in OPERATIONS


def test_nothing_is_explained_that_is_not() -> None:
    source = "\n".join(path.read_text("utf-8") for path in (ROOT / "rampe_guard").rglob("*.py"))
    table = OPERATIONS[OPERATIONS.index("## What a status means") : OPERATIONS.index("## Logs")]
    for cell in re.findall(r"^\| (`[^|]+) \|", table, re.MULTILINE):
        for word in re.findall(r"`([a-z]+_?[a-z_]*)`", cell):
            assert f'"{word}"' in source or f"{word}" in ("enabled_", "object_"), word


@pytest.mark.parametrize("page", sorted(DEPLOY.glob("*.md")), ids=lambda path: path.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text("utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_every_cannot_names_a_test_that_there_is() -> None:
    table = THREATS[THREATS.index("## What they cannot") : THREATS.index("## What they can\n")]
    rows = [line for line in table.splitlines() if re.match(r"\| [A-F]", line)]
    assert len(rows) >= 15
    attack = (ROOT / "tests" / "e2e" / "test_attack.py").read_text("utf-8")
    named = set()
    for row in rows:
        cell = row.rstrip(" |").rpartition("|")[2]
        tests = re.findall(r"`(test_\w+)`", cell)
        files = re.findall(r"`((?:unit|e2e|property)/\w+\.py)`", cell)
        assert tests or files, row
        for test in tests:
            assert f"def {test}(" in attack, test
            named.add(test)
        for file in files:
            assert (ROOT / "tests" / file).is_file(), file
    there = set(re.findall(r"^def (test_\w+)\(", attack, re.MULTILINE))
    assert there - named == {"test_each_role_can_do_its_own_work"}
