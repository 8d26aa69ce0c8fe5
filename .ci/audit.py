"""Are packages of the lock known to be vulnerable? Exit code 1 if so.

pip-audit asks PyPI for advisories. Where PyPI cannot be reached, or a mirror knows no advisories,
it would report that it found none; here that is said as what it is: not audited.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

TIME_S = 120.0


def main(lock: str) -> int:
    """Audit one lock file."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "audit.json"
        command = [sys.executable, "-m", "pip_audit", "--disable-pip", "--require-hashes"]
        command += ["-r", lock, "--progress-spinner", "off", "--timeout", "5"]
        try:
            done = subprocess.run(
                [*command, "-f", "json", "-o", str(out)],
                capture_output=True,
                text=True,
                timeout=TIME_S,
                check=False,
            )
            said = done.stderr.strip().splitlines()[-1:] or ["no report"]
        except subprocess.TimeoutExpired:
            said = [f"no answer within {TIME_S:g} s"]
        text = out.read_text("utf-8") if out.exists() else ""
    return report(lock, text, said[0])


def report(lock: str, text: str, said: str) -> int:
    """Print what was found, and return the exit code.

    Args:
        lock: name of the file.
        text: pip-audit's report as JSON; empty if it made none.
        said: its last words then.
    """
    if not text:
        print(f"{lock}: not audited: {said}")
        return 0
    found = json.loads(text)["dependencies"]
    bad = [(one, flaw) for one in found for flaw in one.get("vulns", ())]
    skipped = [one for one in found if "skip_reason" in one]
    for one, flaw in bad:
        fixed = ", ".join(flaw.get("fix_versions", ())) or "no version yet"
        print(f"{lock}: {one['name']} {one['version']}: {flaw['id']}; mended in {fixed}")
    if skipped:
        why = skipped[0]["skip_reason"]
        print(f"{lock}: {len(skipped)} of {len(found)} packages not audited, such as: {why}")
    if len(skipped) < len(found) and not bad:
        print(f"{lock}: nothing is known against {len(found) - len(skipped)} packages")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(max(main(lock) for lock in sys.argv[1:]))
