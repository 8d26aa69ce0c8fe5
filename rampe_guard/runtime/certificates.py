"""Certificates and keys before they are used: there, readable, of each other, and in force.

Zenoh would only say that nobody answers. The times of a certificate are read here, by a few lines
of DER (RFC 5280, 4.1): the standard library has no public way to.
"""

from __future__ import annotations

import re
import ssl
import time
from calendar import timegm
from pathlib import Path
from typing import Final

from rampe_guard.errors import SettingsError
from rampe_guard.settings import TlsFiles

DAY_S: Final = 86_400.0
_MOST = 1024 * 1024
_PEM = re.compile(r"-----BEGIN CERTIFICATE-----.+?-----END CERTIFICATE-----", re.DOTALL)
_UTC_TIME, _GENERALIZED_TIME = 0x17, 0x18
_SEQUENCE, _INTEGER, _VERSION = 0x30, 0x02, 0xA0


def check_files(files: TlsFiles, now_unix_s: float | None = None) -> float:
    """See that a session could prove itself with these files; returns the days they still hold.

    Args:
        files: of the site.
        now_unix_s: wall clock; the present if left out [s].

    Raises:
        SettingsError: naming site file and key, the file, what is wrong with it and what to do.
    """
    of_root, of_certificate, of_key = files.said
    now = time.time() if now_unix_s is None else now_unix_s
    days = [_days(files.root_ca, now, of_root)]
    if files.certificate is not None and files.key is not None:
        check_private(files.key, of_key)
        days.append(_days(files.certificate, now, of_certificate))
        _check_pair(files.certificate, files.key, of_key)
    return min(days)


def check_private(key: str, said: str = "zenoh") -> None:
    """Refuse a private key that others than its owner may read.

    Args:
        key: its file.
        said: where that is named, for messages.

    Raises:
        SettingsError: they may, or it is not there.
    """
    try:
        mode = Path(key).stat().st_mode & 0o777
    except OSError as error:
        raise SettingsError(f"{said}: {key}: cannot be read ({error.strerror})") from None
    if mode & 0o077:
        raise SettingsError(
            f"{said}: {key}: others than its owner may use this private key (mode {mode:04o});"
            f" chmod 600 {key}, and make a new one if somebody may have read it"
        )


def _days(file: str, now_unix_s: float, said: str) -> float:
    try:
        with Path(file).open("rb") as stream:
            text = stream.read(_MOST).decode("ascii", "replace")
    except OSError as error:
        raise SettingsError(f"{said}: {file}: cannot be read ({error.strerror})") from None
    blocks = _PEM.findall(text)
    if not blocks:
        raise SettingsError(f"{said}: {file}: holds no certificate (PEM); give another file")
    least = float("inf")
    for block in blocks:
        try:
            begin, end = validity(ssl.PEM_cert_to_DER_cert(block))
        except ValueError as error:
            raise SettingsError(f"{said}: {file}: is no certificate: {error}") from None
        if now_unix_s < begin:
            raise SettingsError(
                f"{said}: {file}: is not valid before {_date(begin)}, and it is"
                f" {_date(now_unix_s)}; set the clock, or make the certificate anew"
            )
        if now_unix_s >= end:
            raise SettingsError(
                f"{said}: {file}: expired on {_date(end)}, and it is {_date(now_unix_s)};"
                " make a new one (deploy/certificates.sh), or set the clock"
            )
        least = min(least, (end - now_unix_s) / DAY_S)
    return least


def _check_pair(certificate: str, key: str, said: str) -> None:
    def locked() -> str:
        raise SettingsError(
            f"{said}: {key}: is locked with a password, which nobody can type here; give a key"
            " without one that only its owner may read"
        )

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        context.load_cert_chain(certificate, key, password=locked)
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        reason = getattr(error, "reason", None) or error
        raise SettingsError(
            f"{said}: {key}: is not the private key of {certificate} ({reason})"
        ) from None


def validity(der: bytes) -> tuple[float, float]:
    """From when until when a certificate holds [Unix s].

    Raises:
        ValueError: it is no X.509 certificate.
    """
    tbs = _only(_only(der, _SEQUENCE), _SEQUENCE)
    tag, _, rest = _take(tbs)
    if tag == _VERSION:
        tag, _, rest = _take(rest)
    if tag != _INTEGER:
        raise ValueError("it has no serial number")
    for _ in range(2):  # algorithm, issuer
        _, _, rest = _take(rest)
    times = _only(rest, _SEQUENCE)
    tag, begin, rest = _take(times)
    second, end, _ = _take(rest)
    return _time(tag, begin), _time(second, end)


def _take(data: bytes) -> tuple[int, bytes, bytes]:
    """Tag and content of the first element, and what follows it."""
    if len(data) < 2:  # noqa: PLR2004 - tag and length
        raise ValueError("it ends too early")
    length, start = data[1], 2
    if length & 0x80:
        start += length & 0x7F
        length = int.from_bytes(data[2:start], "big")
    if start + length > len(data):
        raise ValueError("it ends too early")
    return data[0], data[start : start + length], data[start + length :]


def _only(data: bytes, wanted: int) -> bytes:
    tag, content, _ = _take(data)
    if tag != wanted:
        raise ValueError(f"tag {tag:#04x} instead of {wanted:#04x}")
    return content


def _time(tag: int, content: bytes) -> float:
    text = content.decode("ascii", "replace")
    if tag == _UTC_TIME:  # two digits: 1950 to 2049
        text = ("19" if text[:2] >= "50" else "20") + text
    elif tag != _GENERALIZED_TIME:
        raise ValueError(f"tag {tag:#04x} instead of a time")
    try:
        return float(timegm(time.strptime(text, "%Y%m%d%H%M%SZ")))
    except (ValueError, OverflowError):
        raise ValueError(f"{text[:20]!r} is no time") from None


def _date(unix_s: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(unix_s))
