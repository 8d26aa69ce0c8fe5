"""The script that makes a site's certificates."""

from __future__ import annotations

import re
import shutil
import stat
import subprocess
from datetime import datetime
from pathlib import Path

import pytest

from tests.support.pki import HAVE_OPENSSL, Pki, certificates

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(not HAVE_OPENSSL, reason="no openssl: no certificates"),
]


@pytest.fixture(scope="module")
def pki(tmp_path_factory: pytest.TempPathFactory) -> Pki:
    made = Pki(tmp_path_factory.mktemp("site") / "pki")
    made.issue("excavator-7")
    made.router("router")
    return made


def openssl(*args: str | Path) -> str:
    found = shutil.which("openssl")
    assert found is not None
    done = subprocess.run([found, *map(str, args)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def extensions(certificate: Path) -> str:
    shown = openssl("x509", "-in", certificate, "-noout", "-text")
    return shown[shown.index("X509v3 extensions") :]


def days(certificate: Path) -> int:
    ends = openssl("x509", "-in", certificate, "-noout", "-dates")
    begin, end = (
        datetime.strptime(f"{text} +0000", "%b %d %H:%M:%S %Y %Z %z")
        for text in re.findall("=(.+)", ends)
    )
    return (end - begin).days


def test_files_are_for_their_owner_only(pki: Pki) -> None:
    for path in pki.folder.rglob("*"):
        mode = stat.S_IMODE(path.stat().st_mode)
        assert mode == (0o700 if path.is_dir() else 0o600), path
    for name in ("excavator-7", "router"):
        files = sorted(path.name for path in (pki.folder / name).iterdir())
        assert files == ["ca.crt", "tls.crt", "tls.key"]


def test_each_certificate_is_good_for_one_thing(pki: Pki) -> None:
    authority = pki.folder / "ca" / "ca.crt"
    shown = extensions(authority)
    assert "CA:TRUE, pathlen:0" in shown
    assert days(authority) == 3650
    client, router = (pki.folder / name / "tls.crt" for name in ("excavator-7", "router"))
    for certificate in (client, router):
        openssl("verify", "-x509_strict", "-CAfile", authority, certificate)
        assert "CA:FALSE" in extensions(certificate)
        assert "prime256v1" in openssl("x509", "-in", certificate, "-noout", "-text")
        assert days(certificate) == 90
    assert "TLS Web Server Authentication" not in extensions(client)
    assert "TLS Web Client Authentication" in extensions(client)
    assert "TLS Web Server Authentication" in extensions(router)
    assert "IP Address:127.0.0.1, DNS:localhost" in extensions(router)
    assert "subject=CN = excavator-7" in openssl("x509", "-in", client, "-noout", "-subject")


def test_what_is_there_is_listed_and_nothing_is_left_over(pki: Pki) -> None:
    listed = certificates("list", pki.folder).stdout
    assert [line.split()[0] for line in listed.splitlines()] == ["excavator-7", "router", "ca"]
    assert sorted(p.name for p in pki.folder.iterdir()) == ["ca", "excavator-7", "router"]


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (("ca",), "exists already; it is never overwritten"),
        (
            ("issue", "excavator-7"),
            "exists already; a new one under the same name is made by: renew",
        ),
        (("issue", "../elsewhere"), "is no name"),
        (("issue", "ca"), "is the authority's own"),
        (("issue", "a b"), "is no name"),
        (("issue", "x", "--days", "0"), "a number from 1 to 99999"),
        (("issue", "x", "--days"), "--days needs a value"),
        (("issue", "x", "--weeks", "1"), "--weeks is no option"),
        (("router", "x", "a;b"), "is neither a host name nor an IP address"),
        (("router", "x", "1.2.3.4\nsubjectAltName=DNS:y"), "is neither"),
        (("router", "x", "999.1.2.3"), "'999.1.2.3' is no IP address"),
        (("router", "x", "1.2.3"), "'1.2.3' is no IP address"),
        (("router", "x", "1:2:3"), "'1:2:3' is no IP address"),
        (("router", "x", "fe80:::1"), "is neither a host name nor an IP address"),
        (("router", "x", "a..b"), "is neither a host name nor an IP address"),
        (("router", "x"), "certificates.sh router FOLDER NAME ADDRESS"),
        (("renew", "nobody"), "is not there; make it first"),
        (("make", "x"), "certificates.sh ca FOLDER"),
    ],
)
def test_what_cannot_be_is_refused(pki: Pki, args: tuple[str, ...], told: str) -> None:
    before = {path: path.read_bytes() for path in pki.folder.rglob("*") if path.is_file()}
    done = certificates(args[0], pki.folder, *args[1:])
    assert done.returncode == 2
    assert told in done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1 or "FOLDER" in told, lines  # the usage has more
    after = {path: path.read_bytes() for path in pki.folder.rglob("*") if path.is_file()}
    assert after == before


def test_without_an_authority_there_is_none(tmp_path: Path) -> None:
    done = certificates("issue", tmp_path, "x")
    assert done.returncode == 2
    assert "make the authority first" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_no_certificate_outlives_its_authority(tmp_path: Path) -> None:
    folder = tmp_path / "pki"
    assert certificates("ca", folder, "--days", "20").returncode == 0
    done = certificates("issue", folder, "x", "--days", "60")
    assert done.returncode == 0
    assert done.stderr.startswith(
        "certificates.sh: 19 days instead of 60: the authority itself ends"
    )
    assert done.stdout.endswith("for 19 days\n")
    assert days(folder / "x" / "tls.crt") == 19
    certificates("issue", folder, "y", "--days", "19")
    assert days(folder / "y" / "tls.crt") == 19


def test_addresses_of_both_kinds_are_taken(pki: Pki) -> None:
    wanted = ["10.0.0.1", "::1", "fe80::2:3", "1:2:3:4:5:6:7:8", "router-a.quarry.example", "x"]
    done = certificates("router", pki.folder, "wide", *wanted)
    assert done.returncode == 0, done.stderr
    shown = extensions(pki.folder / "wide" / "tls.crt")
    for name in ("10.0.0.1", "0:0:0:0:0:0:0:1", "FE80:0:0:0:0:0:2:3", "1:2:3:4:5:6:7:8", "DNS:x"):
        assert name in shown
    shutil.rmtree(pki.folder / "wide")


def test_a_folder_that_is_not_there_holds_no_list(tmp_path: Path) -> None:
    for place, said in (
        (tmp_path / "none", "is no folder"),
        (tmp_path, "make the authority first"),
    ):
        done = certificates("list", place)
        assert (done.returncode, done.stdout) == (2, "")
        assert said in done.stderr


def test_a_renewed_one_has_another_key_and_the_same_name(pki: Pki) -> None:
    folder = pki.folder / "router"
    key, names = (folder / "tls.key").read_text(), "IP Address:127.0.0.1, DNS:localhost"
    done = certificates("renew", pki.folder, "router", "--days", "30")
    assert done.returncode == 0, done.stderr
    assert (folder / "tls.key").read_text() != key
    assert names in extensions(folder / "tls.crt")
    assert "TLS Web Server Authentication" in extensions(folder / "tls.crt")
    assert days(folder / "tls.crt") == 30
    public = openssl("pkey", "-in", folder / "tls.key", "-pubout")
    assert openssl("x509", "-in", folder / "tls.crt", "-noout", "-pubkey") == public
    assert stat.S_IMODE((folder / "tls.key").stat().st_mode) == 0o600
    certificates("renew", pki.folder, "excavator-7")
    client = extensions(pki.folder / "excavator-7" / "tls.crt")
    assert "TLS Web Server Authentication" not in client
