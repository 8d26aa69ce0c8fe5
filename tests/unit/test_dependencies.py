"""The bill of materials lists what the lock lists, and the audit fails only on what it found."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


def locked() -> dict[str, str]:
    text = (ROOT / "requirements.lock").read_text("utf-8")
    found = re.findall(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", text, re.MULTILINE)
    return {name.lower(): version for name, version in found}


def test_the_bill_of_materials_of_the_readme_lists_the_lock(tmp_path: Path) -> None:
    pytest.importorskip("cyclonedx_py")
    readme = (ROOT / "README.md").read_text("utf-8")
    (line,) = re.findall(r"^\S*cyclonedx-py (.* requirements\.lock)", readme, re.MULTILINE)
    out = tmp_path / "sbom.json"
    args = line.replace("sbom.json", str(out)).split()
    done = subprocess.run(
        [sys.executable, "-m", "cyclonedx_py", *args, "--no-validate"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    bill = json.loads(out.read_text("utf-8"))
    assert (bill["bomFormat"], bill["metadata"]["component"]["name"]) == (
        "CycloneDX",
        "rampe-guard",
    )
    listed = {part["name"].lower(): part["version"] for part in bill["components"]}
    assert len(locked()) > 20
    assert listed == locked()
    assert all(part["externalReferences"][0]["hashes"] for part in bill["components"])


@pytest.fixture
def audit() -> ModuleType:
    spec = importlib.util.spec_from_file_location("audit", ROOT / ".ci" / "audit.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FLAW = {"name": "a", "version": "1", "vulns": [{"id": "CVE-1", "fix_versions": ["2"]}]}
FINE = {"name": "b", "version": "1", "vulns": []}
SKIPPED = {"name": "c", "skip_reason": "Dependency not found on PyPI"}


@pytest.mark.parametrize(
    ("found", "code", "says"),
    [
        ([FLAW, FINE], 1, "a 1: CVE-1; mended in 2"),
        ([FLAW, SKIPPED], 1, "1 of 2 packages not audited"),
        ([FINE, FINE], 0, "nothing is known against 2 packages"),
        ([SKIPPED, SKIPPED], 0, "2 of 2 packages not audited, such as: Dependency not found"),
    ],
)
def test_the_audit_tells_found_from_not_looked(
    audit: ModuleType,
    capsys: pytest.CaptureFixture[str],
    found: list[dict[str, object]],
    code: int,
    says: str,
) -> None:
    assert audit.report("x.lock", json.dumps({"dependencies": found}), "") == code
    said = capsys.readouterr().out
    assert says in said
    assert ("nothing is known" in said) == (found == [FINE, FINE])


def test_no_report_is_said_and_is_no_failure(
    audit: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert audit.report("x.lock", "", "ConnectionError") == 0
    assert capsys.readouterr().out == "x.lock: not audited: ConnectionError\n"
