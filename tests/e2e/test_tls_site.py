"""The certificates of a site file, against a router that asks for them."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from rampe_guard.errors import SettingsError
from rampe_guard.runtime.certificates import DAY_S, check_files, validity
from rampe_guard.runtime.expiry import Expiry
from rampe_guard.runtime.zenoh_io import check_configuration
from rampe_guard.settings import TlsFiles, load_site
from tests.support import processes
from tests.support.pki import HAVE_OPENSSL, Pki
from tests.support.processes import BENCH, ROOT, Process

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl: no certificates"),
]

OPEN = """
import sys
from rampe_guard.errors import RampeGuardError
from rampe_guard.runtime.zenoh_io import Bus
from rampe_guard.settings import load_site
try:
    with Bus.open(load_site(sys.argv[1]).zenoh) as bus:
        print("joined", bus.connected)
except RampeGuardError as error:
    print(type(error).__name__, error)
"""


@dataclass
class Quarry:
    """A router with mutual TLS, and the certificates of its site."""

    pki: Pki
    port: int

    def site(self, who: str | None, *, host: str = "127.0.0.1", ca: Path | None = None) -> Path:
        """A site file beside the certificates."""
        text = BENCH.read_text("utf-8")
        for old in ("../../geometry", "../scenes"):
            text = text.replace(old, str((BENCH.parent / old).resolve()))
        authority = ca or self.pki.folder / "ca" / "ca.crt"
        tls = [f"root_ca: {authority}"]
        if who is not None:
            tls += [f"certificate: {who}/tls.crt", f"key: {who}/tls.key"]
        zenoh = f"{{connect: [tls/{host}:{self.port}], tls: {{{', '.join(tls)}}}}}"
        text = text.replace("files: {allow: [", f"files: {{allow: [{authority.parent}, ")
        path = self.pki.folder / f"site-{time.monotonic_ns()}.yaml"
        path.write_text(f"{text}\nzenoh: {zenoh}\n", "utf-8")
        return path

    def says(self, *args: str | None, **options: object) -> str:
        """What opening a session says, in a process of its own."""
        site = self.site(*args, **options)  # type: ignore[arg-type]
        done = subprocess.run(
            [sys.executable, "-c", OPEN, str(site)],
            capture_output=True,
            text=True,
            cwd=ROOT,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()


@pytest.fixture(scope="module")
def quarry(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Quarry]:
    folder = tmp_path_factory.mktemp("quarry")
    pki = Pki(folder / "pki")
    pki.issue("guard")
    pki.router("router")
    port = int(processes.free_endpoint().rpartition(":")[2])
    place = pki.folder / "router"
    config = {
        "mode": "router",
        "listen": {"endpoints": [f"tls/127.0.0.{end}:{port}" for end in (1, 2)]},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {
            "link": {
                "tls": {
                    "root_ca_certificate": str(place / "ca.crt"),
                    "listen_certificate": str(place / "tls.crt"),
                    "listen_private_key": str(place / "tls.key"),
                    "enable_mtls": True,
                }
            }
        },
    }
    (folder / "router.json5").write_text(json.dumps(config))
    args: list[str | Path] = [
        "-m",
        "rampe_guard.runtime.router",
        "--config",
        folder / "router.json5",
    ]
    process = Process(folder, "router", args)
    try:
        process.wait_for("ready", 60.0)
        yield Quarry(pki, port)
    finally:
        process.close()


def test_a_site_joins_by_its_certificate(quarry: Quarry) -> None:
    assert quarry.says("guard") == "joined True"


def test_who_has_none_or_another_authoritys_stays_out(quarry: Quarry, tmp_path: Path) -> None:
    other = Pki(tmp_path / "other")
    other.issue("guard")
    assert "ConnectionFailedError no Zenoh router at tls/127.0.0.1" in quarry.says(None)
    # it does not believe that router, either
    assert "ConnectionFailedError" in quarry.says("guard", ca=tmp_path / "other" / "ca" / "ca.crt")
    stranger = Quarry(other, quarry.port)
    assert "ConnectionFailedError" in stranger.says("guard", ca=quarry.pki.folder / "ca" / "ca.crt")


def test_a_router_by_another_name_is_not_believed(quarry: Quarry) -> None:
    """It listens on 127.0.0.2 as well, and its certificate names 127.0.0.1 and localhost."""
    assert quarry.says("guard", host="localhost") == "joined True"
    assert "ConnectionFailedError" in quarry.says("guard", host="127.0.0.2")


class TestBeforeItIsUsed:
    def files(self, quarry: Quarry) -> TlsFiles:
        place = quarry.pki.folder / "guard"
        root, certificate, key = (str(place / name) for name in ("ca.crt", "tls.crt", "tls.key"))
        return TlsFiles(root, certificate, key)

    def test_days_are_those_that_openssl_made(self, quarry: Quarry) -> None:
        assert check_files(self.files(quarry)) == pytest.approx(90.0, abs=0.1)

    def test_expired_and_not_yet_valid(self, quarry: Quarry) -> None:
        now = time.time()
        with pytest.raises(SettingsError, match=r"guard/tls\.crt: expired on .*make a new one"):
            check_files(self.files(quarry), now + 91 * DAY_S)
        with pytest.raises(SettingsError, match=r"ca\.crt: is not valid before .*set the clock"):
            check_files(self.files(quarry), now - 1 * DAY_S)
        quarry.pki.issue_for("late", -3600.0)
        site = quarry.site("late")
        line = site.read_text("utf-8").splitlines().index(self.block(site)) + 1
        with pytest.raises(SettingsError) as caught:
            check_configuration(load_site(site).zenoh)
        where = (
            f"{site}:{line}: zenoh.tls.certificate: {quarry.pki.folder}/late/tls.crt: expired on"
        )
        assert str(caught.value).startswith(where)
        assert "SettingsError" in (said := quarry.says("late"))
        assert "expired on" in said

    def block(self, site: Path) -> str:
        """The line with the certificates."""
        (line,) = [text for text in site.read_text("utf-8").splitlines() if "root_ca" in text]
        return line

    def test_a_key_of_another_certificate(self, quarry: Quarry) -> None:
        other = quarry.pki.folder / "router" / "tls.key"
        files = self.files(quarry)
        with pytest.raises(SettingsError, match="is not the private key of"):
            check_files(TlsFiles(files.root_ca, files.certificate, str(other)))

    def test_a_key_that_others_may_read(self, quarry: Quarry, tmp_path: Path) -> None:
        files = self.files(quarry)
        key = tmp_path / "tls.key"
        key.write_bytes(Path(str(files.key)).read_bytes())
        key.chmod(0o644)
        with pytest.raises(SettingsError, match=f"mode 0644.*chmod 600 {key}"):
            check_files(TlsFiles(files.root_ca, files.certificate, str(key)))

    @pytest.mark.parametrize(
        ("content", "said"),
        [
            ("", "holds no certificate"),
            ("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----", "is no certificate"),
            ("-----BEGIN CERTIFICATE-----\n!!\n-----END CERTIFICATE-----", "is no certificate"),
        ],
    )
    def test_what_is_none(self, quarry: Quarry, tmp_path: Path, content: str, said: str) -> None:
        (tmp_path / "ca.crt").write_text(content)
        files = self.files(quarry)
        with pytest.raises(SettingsError, match=said):
            check_files(TlsFiles(str(tmp_path / "ca.crt"), files.certificate, files.key))

    def test_its_end_is_told_two_weeks_before(self, quarry: Quarry) -> None:
        zenoh, now = load_site(quarry.site("guard")).zenoh, time.time()
        expiry = Expiry(zenoh, now)
        assert expiry.reasons(now + 75 * DAY_S) == ()
        (reason,) = expiry.reasons(now + 80 * DAY_S)
        assert reason.code == "certificate_expiring"
        assert "ends in 10.0 days" in reason.text
        assert "has ended" in expiry.reasons(now + 91 * DAY_S)[0].text
        assert Expiry(load_site(BENCH).zenoh, now).reasons(now + 1000 * DAY_S) == ()

    def test_check_says_so_too(self, quarry: Quarry) -> None:
        site = load_site(quarry.site("guard"))
        check_configuration(site.zenoh)
        (quarry.pki.folder / "router" / "tls.key").chmod(0o640)
        with pytest.raises(SettingsError, match=r"\.yaml:[0-9]+: zenoh\.tls\.key: .*chmod 600"):
            check_configuration(load_site(quarry.site("router")).zenoh)
        (quarry.pki.folder / "router" / "tls.key").chmod(0o600)


@pytest.mark.parametrize("data", [b"", b"0", b"\x30\x80", b"\x30\x03\x02\x01\x00", bytes(100)])
def test_rubbish_is_no_certificate(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"ends too early|instead of|no serial"):
        validity(data)
