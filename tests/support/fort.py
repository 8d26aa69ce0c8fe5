"""A router and a guard of the bench site as a site would protect them: all from deploy/.

The machine speaks JSON (`PLAIN`), or whatever another `Plan` says.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.bench_site import bench_copy
from tests.support.ears import Ears
from tests.support.pki import Pki
from tests.support.processes import Process, started, until

MACHINE = "rampe/bench/excavator"
BASE = f"{MACHINE}/guard"
LOG = "info,zenoh_link_tls=debug,zenoh::net::routing::interceptor::access_control=trace"
ACCESS = f"""
router: {{listen: [tls/PLACE], certificates: PKI/router}}
machines:
  - name: excavator
    base: {BASE}
    joystick: {MACHINE}/joystick
    actuators: {MACHINE}/actuators
    objects: [{MACHINE}/truck]
access:
  - {{certificate: machine, role: machine, machines: [excavator]}}
  - {{certificate: guard, role: guard, machines: [excavator]}}
  - {{certificate: truck, role: object, keys: [{MACHINE}/truck]}}
  - {{certificate: recorder, role: recorder}}
  - {{certificate: viewer, role: viewer}}
  - {{certificate: soon, role: viewer}}
  - {{certificate: old, role: viewer}}
  - {{certificate: operator, role: operator}}
  - {{certificate: engineer, role: engineer}}
"""

Site = Callable[[Path, str, str], Path]
"""Of a folder, a block of YAML and a name: makes the machine's site file with that block."""


def _bench(folder: Path, more: str, name: str) -> Path:
    return bench_copy(folder, more, name=name)


@dataclass(frozen=True)
class Plan:
    """What is protected: the access list, where its guard publishes, and its site file."""

    access: str
    base: str
    site: Site

    @property
    def names(self) -> tuple[str, ...]:
        """Certificates on the list."""
        return tuple(dict.fromkeys(re.findall(r"certificate: (\w+)", self.access)))


PLAIN = Plan(ACCESS, BASE, _bench)
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")


@dataclass
class Fort:
    """What an attacker finds."""

    plan: Plan
    folder: Path
    pki: Pki
    endpoint: str
    router: Process
    guard: Process
    ears: Ears

    def at(self, name: str | None) -> str:
        """The router's endpoint for the bearer of a certificate."""
        return self.pki.at(self.endpoint, name)

    def site(self, name: str) -> Path:
        """The machine's site file for the bearer of a certificate."""
        return _site(self.plan, self.folder, self.endpoint, name)

    def logged(self, *words: str, within_s: float = 5.0) -> None:
        """Wait for a line in the router's log that has all of these words."""

        def found() -> bool:
            lines = _COLOURS.sub("", self.router.out + self.router.err).splitlines()
            return any(all(word in line for word in words) for line in lines)

        until(found, within_s, lambda: f"{words} in the router's log")

    def denied(self, name: str, what: str, key: str) -> None:
        """Wait until the router tells that it denied this."""
        self.logged(f"CertCommonName({name})", f"is unauthorized to {what} (ingress) on {key}")


def write_access(plan: Plan, folder: Path, pki: Pki, endpoint: str) -> Path:
    """The router's configuration, by the command that sites use."""
    listed, made = folder / "access.yaml", folder / "router.json5"
    text = plan.access.replace("PLACE", endpoint.partition("/")[2]).replace("PKI", str(pki.folder))
    listed.write_text(text, "utf-8")
    done = processes.called("access", listed, "--out", made)
    assert done.returncode == 0, done.stderr
    return made


def secure_router(folder: Path, config: Path) -> Process:
    """A router that works when this returns, and tells what it denies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RUST_LOG", LOG)
        args = ["-m", "rampe_guard.runtime.router", "--config", str(config)]
        process = Process(folder, "router", args)
    return started(process, "ready")


def _site(plan: Plan, folder: Path, endpoint: str, name: str) -> Path:
    files = {"root_ca": "ca.crt", "certificate": "tls.crt", "key": "tls.key"}
    tls = ", ".join(f"{key}: pki/{name}/{file}" for key, file in files.items())
    secure = endpoint.replace("tcp/", "tls/")
    return plan.site(folder, f"zenoh: {{connect: [{secure}], tls: {{{tls}}}}}", name)


@contextlib.contextmanager
def fort(folder: Path, plan: Plan = PLAIN) -> Iterator[Fort]:
    """Build it; end all."""
    pki = Pki(folder / "pki")
    pki.router("router")
    for name in plan.names:
        if name not in ("soon", "old"):
            pki.issue(name)
    pki.issue_for("old", -60.0)
    pki.issue("stranger")
    endpoint = processes.free_endpoint()
    with contextlib.ExitStack() as stack:
        config = write_access(plan, folder, pki, endpoint)
        router = stack.enter_context(secure_router(folder, config))
        ears = stack.enter_context(Ears(pki.at(endpoint, "viewer"), plan.base))
        args = ["-m", "rampe_guard", "run", str(_site(plan, folder, endpoint, "guard"))]
        guard = stack.enter_context(Process(folder, "guard", args))
        guard.wait_for("guarding on")
        yield Fort(plan, folder, pki, endpoint, router, guard, ears)
        assert guard.alive, guard.err
        assert "Traceback" not in guard.err, guard.err
