"""Who may see a page and press its buttons: rules for one request, without any network.

On loopback whoever works on this machine. Elsewhere whoever has the token: it comes with the first
address, and then a cookie that is made of it. In both cases no page of somebody else's may speak
through a browser (DNS rebinding: Host; websockets of other sites: Origin).
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Final
from urllib.parse import parse_qsl, urlencode, urlsplit

from rampe_guard.settings.network import host_of, is_loopback

SHORTEST: Final = 16
"""Characters of a token; fewer could be guessed."""
_COOKIE: Final = "rampe-guard-dashboard"
_PROTOCOL: Final = re.compile(r"viser-v[0-9A-Za-z.+-]{1,32}")
# viser's one file is an inline script with WebAssembly that makes functions from text
_PAGE_HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:;"
        " style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:;"
        " connect-src 'self' data: blob:; worker-src 'self' blob:; frame-ancestors 'none';"
        " object-src 'none'; base-uri 'none'; form-action 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True, slots=True)
class Asked:
    """What matters of a request; a header that was not sent is None."""

    path: str
    host: str | None
    origin: str | None = None
    cookie: str | None = None
    authorization: str | None = None
    protocol: str | None = None
    websocket: bool = False


@dataclass(frozen=True, slots=True)
class Answer:
    """A refusal or a redirection.

    Attributes:
        status: of HTTP.
        text: for people.
        reason: a word for logs and counters.
        headers: beside those of every answer.
    """

    status: HTTPStatus
    text: str
    reason: str
    headers: tuple[tuple[str, str], ...] = ()


class Access:
    """The rules of one dashboard.

    Args:
        host: address that it listens on.
        port: the same; it makes the cookie's name, since browsers share cookies among ports.
        token: that every request has to show; None: whoever reaches it, which must be loopback.
        names: further names by which browsers may call it, such as that of a proxy before it.
            Beyond loopback its addresses and this computer's own name need not be given.
    """

    def __init__(
        self, host: str, port: int, token: str | None = None, names: Sequence[str] = ()
    ) -> None:
        if token is None and not is_loopback(host):
            raise ValueError(f"{host} can be reached from outside, and there is no token")
        self._token = None if token is None else token.encode()
        self._names = {name.lower() for name in names}
        self._far = not is_loopback(host)
        self._own_names = {host.lower(), socket.gethostname().lower()} if self._far else set()
        self._cookie = f"{_COOKIE}-{port}"
        # not the token: a browser's store of cookies gives it to nobody, and no other dashboard's
        # cookie fits; made of it alone, so that pages outlive a new start with the same token
        made = hmac.new(self._token or b"", self._cookie.encode(), "sha256")
        self._pass = made.hexdigest().encode()

    @staticmethod
    def headers() -> dict[str, str]:
        """Headers of every answer: what its pages may load, and that nobody frames them."""
        return dict(_PAGE_HEADERS)

    def judge(self, asked: Asked) -> Answer | None:
        """An answer instead of a page; None if it may be had."""
        if not self._named(asked.host):
            text = f"called by a name that is not its own: {ascii(asked.host or '')[:80]}"
            text += "; if it is, start the dashboard with it: --name"
            return Answer(HTTPStatus.FORBIDDEN, text, "wrong_host")
        if asked.origin is not None and not self._own(asked.origin, asked.host):
            return Answer(HTTPStatus.FORBIDDEN, "asked by a page of another site", "wrong_origin")
        if asked.websocket and _PROTOCOL.fullmatch(asked.protocol or "") is None:
            return Answer(HTTPStatus.BAD_REQUEST, "not a page of this dashboard", "no_page")
        if self._token is None or self._shown(asked):
            return None
        given = dict(parse_qsl(urlsplit(asked.path).query)).get("token")
        if given is None or not _same(given, self._token) or asked.websocket:
            reason = "no_token" if given is None else "wrong_token"
            text = "This dashboard wants its token: open the address that it printed."
            return Answer(HTTPStatus.UNAUTHORIZED, text, reason, (("WWW-Authenticate", "Bearer"),))
        cookie = f"{self._cookie}={self._pass.decode()}; Path=/; HttpOnly; SameSite=Lax"
        there = (("Location", _without_token(asked.path)), ("Set-Cookie", cookie))
        return Answer(HTTPStatus.SEE_OTHER, "", "entered", (*there, ("Cache-Control", "no-store")))

    def _named(self, host: str | None) -> bool:
        """Whether it may be called so. No other site can make its pages come from an address."""
        name = host_of(host)
        if name is None:
            return False
        if self._far and (name in self._own_names or _is_address(name)):
            return True
        return name in self._names or is_loopback(name)

    def _own(self, origin: str, host: str | None) -> bool:
        parts = urlsplit(origin)
        if parts.scheme not in {"http", "https"}:
            return False
        return parts.netloc.lower() == (host or "").lower() or host_of(parts.netloc) in self._names

    def _shown(self, asked: Asked) -> bool:
        scheme, _, given = (asked.authorization or "").partition(" ")
        bearer = self._token is not None and scheme.lower() == "bearer"
        if bearer and _same(given.strip(), self._token or b""):
            return True
        try:
            cookie = SimpleCookie(asked.cookie or "").get(self._cookie)
        except CookieError:
            return False
        return cookie is not None and _same(cookie.value, self._pass)


def wrong_token(token: str) -> str | None:
    """Why this is no good token, None if it is one."""
    if len(token) < SHORTEST:
        return f"has {len(token)} characters, fewer than {SHORTEST}"
    if re.fullmatch(r"[A-Za-z0-9._~-]+", token) is None:
        return "has characters other than letters, digits and . _ ~ -"
    return None


def _same(given: str, secret: bytes) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), secret)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _without_token(path: str) -> str:
    """The same address without the token; always on this very server."""
    parts = urlsplit(path)
    kept = urlencode([(key, value) for key, value in parse_qsl(parts.query) if key != "token"])
    return "/" + parts.path.lstrip("/\\") + (f"?{kept}" if kept else "")
