"""A site's certificates, made by the script that sites use; and such as no site should have."""

from __future__ import annotations

import shutil
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

from tests.support.processes import ROOT

SCRIPT = ROOT / "deploy" / "certificates.sh"
HAVE_OPENSSL = shutil.which("openssl") is not None


def certificates(*args: str | Path) -> subprocess.CompletedProcess[str]:
    """Run ``certificates.sh ARGS``."""
    command = ["bash", str(SCRIPT), *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


class Pki:
    """An authority of its own, below ``folder``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._make("ca", folder)

    def issue(self, *names: str) -> None:
        for name in names:
            self._make("issue", self.folder, name)

    def router(self, name: str) -> None:
        """A certificate for 127.0.0.1."""
        self._make("router", self.folder, name, "127.0.0.1", "localhost")

    def issue_for(self, name: str, seconds: float) -> None:
        """A certificate that ends so many seconds from now; in the past if below 0."""
        self.issue(name)
        ends = datetime.now(UTC) + timedelta(seconds=seconds)
        begins = ends - timedelta(days=2)
        place, authority = self.folder / name, self.folder / "ca"
        work = place / "work"
        work.mkdir()
        (work / "index.txt").touch()
        (work / "serial").write_text(f"{int(ends.timestamp()):08X}\n")
        (work / "ca.cnf").write_text(
            "[ca]\ndefault_ca = it\n[it]\n"
            f"dir = {work}\ndatabase = {work}/index.txt\nserial = {work}/serial\n"
            f"new_certs_dir = {work}\ndefault_md = sha256\npolicy = any\nx509_extensions = ext\n"
            "unique_subject = no\n[any]\ncommonName = supplied\n"
            "[ext]\nbasicConstraints = critical, CA:FALSE\nextendedKeyUsage = clientAuth\n"
            f"subjectAltName = DNS:{name}\n[req]\ndistinguished_name = dn\nprompt = no\n"
            f"[dn]\nCN = {name}\n"
        )
        config = ["-config", str(work / "ca.cnf")]
        request = str(work / "new.csr")
        _openssl("req", "-new", "-key", str(place / "tls.key"), *config, "-out", request)
        _openssl(
            *("ca", "-batch", "-notext", *config, "-in", request, "-out", str(place / "tls.crt")),
            *("-cert", str(authority / "ca.crt"), "-keyfile", str(authority / "ca.key")),
            *("-startdate", f"{begins:%Y%m%d%H%M%SZ}", "-enddate", f"{ends:%Y%m%d%H%M%SZ}"),
        )
        shutil.rmtree(work)

    def at(self, endpoint: str, name: str | None, *, ca: Path | None = None) -> str:
        """The endpoint for the bearer of a certificate (None: who has none)."""
        told = {"root_ca_certificate_file": (ca or self.folder) / "ca" / "ca.crt"}
        if name is not None:
            told["connect_certificate_file"] = self.folder / name / "tls.crt"
            told["connect_private_key_file"] = self.folder / name / "tls.key"
        words = [f"{key}={path}" for key, path in told.items()]
        words += ["enable_mtls=true"] if name is not None else []
        return f"{endpoint.replace('tcp/', 'tls/')}#{';'.join(words)}"

    def _make(self, *args: str | Path) -> None:
        done = certificates(*args)
        assert done.returncode == 0, done.stderr


def _openssl(*args: str) -> None:
    done = subprocess.run(
        ["/usr/bin/env", "openssl", *args], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
