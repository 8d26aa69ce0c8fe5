"""The commands of README and pages, word for word, each page in an empty folder of its own.

In a network of its own where the system lets us: pages name ports, and nobody else's are touched.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.support.depth import NIGHTLY
from tests.support.pages import DOCS, Fence, consoles, pages
from tests.support.processes import ROOT, Process, environment
from tests.support.quick import SHIM

pytestmark = pytest.mark.e2e

AT_ONCE = 2
"""Pages: they wait more than they compute."""
LONGEST_S = 240.0
"""Of a page; only a hang takes so long."""
TUTORIAL = DOCS / "tutorial.md"
TEN_MINUTES_S = 600.0
_ALONE = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--map-root-user"])]
"""A network of one's own: loopback alone."""


def to_run(page: Path) -> list[Fence]:
    """Blocks of a page that a test can run now."""
    late = () if NIGHTLY else ("nightly",)
    return [f for f in consoles(page) if not {"not run", *late} & f.notes.keys()]


def script(page: Path) -> str:
    """All of them as one; what is run is said, so that a failure names it."""
    lines = ["set -euo pipefail"]
    for fence in to_run(page):
        for command in fence.commands:
            place = f"{page.name}:{fence.line}: {command.splitlines()[0]}"
            lines.append(f'echo "[$SECONDS s]" {shlex.quote("$ " + place)} >&2')
            code = fence.notes.get("exit code")
            if code is None:
                lines.append(command)
            else:
                lines += ["code=0", f"{{ {command}\n}} || code=$?", f"[ $code = {code} ]"]
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def network() -> list[str]:
    """Words before a command that give it a network of its own, or none."""
    up = ["ip", "link", "set", "lo", "up"]
    if shutil.which("unshare") and shutil.which("ip"):
        done = subprocess.run([*_ALONE, *up], capture_output=True, check=False)
        if done.returncode == 0:
            return [*_ALONE, "sh", "-c", f'{" ".join(up)} && exec "$@"', "sh"]
    return []


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A PATH with ``rampe-guard`` of this checkout; by day one that is loaded already."""
    commands = tmp_path_factory.mktemp("bin")
    program, door = commands / "rampe-guard", commands / "door"
    with contextlib.ExitStack() as stack:
        if NIGHTLY or os.geteuid() != 0:  # who forks must be allowed to change the network
            program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rampe_guard "$@"\n')
        else:
            server = Process(commands, "quick", ["-m", "tests.support.quick", door])
            stack.enter_context(server)
            program.write_text(SHIM.format(python=sys.executable, socket=door))
            server.wait_for("ready")
        program.chmod(0o755)
        yield os.pathsep.join((str(commands), os.environ["PATH"]))


def run(page: Path, folder: Path, path: str, network: list[str]) -> tuple[int, float, str]:
    """Run a page in ``folder``: exit code, seconds, and all that was said."""
    work, log = folder / "work", folder / "log"
    work.mkdir(parents=True)
    began_s = time.monotonic()
    with (
        log.open("wb") as out,
        _ended(
            subprocess.Popen(
                [*network, "bash", "-c", script(page)],
                cwd=work,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                env={**environment(folder / "state"), "PATH": path, "PYTHONPATH": str(ROOT)},
                start_new_session=True,
            )
        ) as shell,
    ):
        try:
            code = shell.wait(LONGEST_S)
        except subprocess.TimeoutExpired:
            code = 124
    return code, time.monotonic() - began_s, log.read_text("utf-8", "replace")


@contextlib.contextmanager
def _ended(shell: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """In the end all that it started is gone: it leads a group of its own."""
    try:
        yield shell
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(shell.pid, signal.SIGTERM)
            time.sleep(0.5)
            os.killpg(shell.pid, signal.SIGKILL)
        shell.wait()


def test_the_pages_do_as_they_say(
    tmp_path: Path, path: str, network: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    found = [page for page in pages() if page != TUTORIAL and to_run(page)]
    with ThreadPoolExecutor(AT_ONCE if network else 1) as pool:
        done = pool.map(lambda page: run(page, tmp_path / page.stem, path, network), found)
        results = dict(zip(found, done, strict=True))
    with capsys.disabled():
        told = (f"{page.stem} {seconds:.1f} s" for page, (_, seconds, _) in results.items())
        print(f"\npages: {', '.join(told)}")
    bad = [f"{page}: exit code {code}\n{said}" for page, (code, _, said) in results.items() if code]
    assert not bad, "\n\n".join(bad)
    assert len(results) >= 3


def test_the_tutorial_protects_an_arm_in_ten_minutes(
    tmp_path: Path, path: str, network: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    code, seconds, said = run(TUTORIAL, tmp_path, path, network)
    assert code == 0, said
    with capsys.disabled():
        print(f"\ntutorial, its commands from URDF to dashboard: {seconds:.1f} s")
    assert seconds < TEN_MINUTES_S  # what its title says
    heard = (tmp_path / "work" / "heard.jsonl").read_text()
    assert '"zone":"wall"' in heard
    assert "<html" in (tmp_path / "work" / "page.html").read_text().lower()
    assert "Traceback" not in said
