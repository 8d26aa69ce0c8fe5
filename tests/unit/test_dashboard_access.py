"""Who is let in, request by request; the server itself is in tests/e2e/test_dashboard_gate.py."""

from __future__ import annotations

import socket
from dataclasses import replace
from http import HTTPStatus
from pathlib import Path

import pytest

from rampe_guard.dashboard.access import Access, Answer, Asked, wrong_token
from rampe_guard.errors import SettingsError
from rampe_guard.programs.dashboarding import Place
from rampe_guard.settings.network import is_loopback

TOKEN = "0123456789-abcdefgh"  # noqa: S105 - of no dashboard
HERE = Access("127.0.0.1", 8080)
FAR = Access("0.0.0.0", 8080, TOKEN)  # noqa: S104 - listens nowhere
PAGE = Asked("/", "127.0.0.1:8080")
SOCKET = replace(PAGE, websocket=True, protocol="viser-v1.1.1")


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1:8080", "localhost:8080", "LOCALHOST:1", "[::1]:8080", "127.0.0.1", "127.1.2.3:9"],
)
def test_on_loopback_whoever_works_here(host: str) -> None:
    assert HERE.judge(replace(PAGE, host=host)) is None
    assert HERE.judge(replace(SOCKET, host=host, origin=f"http://{host}")) is None
    assert HERE.judge(replace(SOCKET, host=host)) is None  # no browser


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example", "10.0.0.1:8080"),
        *(None, "", "[", "[::2]", "127.0.0.1@evil.example", "0.0.0.0:8080"),
    ],
)
def test_no_other_name_leads_there(host: str | None) -> None:
    """DNS rebinding: the browser believes that it talks to evil.example."""
    for asked in (PAGE, SOCKET):
        answer = HERE.judge(replace(asked, host=host))
        assert answer is not None
        assert (answer.status, answer.reason) == (HTTPStatus.FORBIDDEN, "wrong_host")


@pytest.mark.parametrize(
    "origin",
    [
        *("http://evil.example", "http://127.0.0.1:8081", "http://localhost:8080", "null"),
        *("", "file://", "https://127.0.0.1:8080.evil.example", "chrome-extension://x"),
    ],
)
def test_pages_of_other_sites_open_no_websocket(origin: str) -> None:
    answer = HERE.judge(replace(SOCKET, origin=origin))
    assert answer is not None
    assert (answer.status, answer.reason) == (HTTPStatus.FORBIDDEN, "wrong_origin")


def test_a_proxy_before_it_may_be_named() -> None:
    behind = Access("127.0.0.1", 8080, None, ["Guard.Example"])
    seen = replace(SOCKET, host="guard.example", origin="https://guard.example")
    assert behind.judge(seen) is None
    assert behind.judge(replace(seen, host="127.0.0.1:8080")) is None  # the proxy wrote it anew
    assert behind.judge(replace(seen, origin="https://evil.example")) is not None


def test_beyond_loopback_there_is_no_dashboard_without_a_token() -> None:
    for host in ("0.0.0.0", "10.0.0.1", "::", "guard.example"):  # noqa: S104
        with pytest.raises(ValueError, match="there is no token"):
            Access(host, 8080)


def test_the_token_is_asked_for_and_becomes_a_cookie() -> None:
    refused = FAR.judge(PAGE)
    assert refused is not None
    assert (refused.status, refused.reason) == (HTTPStatus.UNAUTHORIZED, "no_token")
    assert TOKEN not in repr(refused)

    there = FAR.judge(replace(PAGE, path=f"/x?token={TOKEN}&y=1"))
    assert there is not None
    headers = dict(there.headers)
    assert (there.status, headers["Location"]) == (HTTPStatus.SEE_OTHER, "/x?y=1")
    assert headers["Set-Cookie"].endswith("; Path=/; HttpOnly; SameSite=Lax")
    cookie = headers["Set-Cookie"].partition(";")[0]
    for asked in (PAGE, SOCKET):
        assert FAR.judge(replace(asked, cookie=f"other=1; {cookie}")) is None
        assert FAR.judge(replace(asked, authorization=f"Bearer {TOKEN}")) is None
        assert FAR.judge(replace(asked, host="10.0.0.7:8080", cookie=cookie)) is None
    assert TOKEN not in cookie
    name, _, value = cookie.partition("=")
    as_token = replace(PAGE, path=f"/?token={value}")  # what a cookie tells opens nothing else
    as_bearer = replace(PAGE, authorization=f"Bearer {value}")
    as_cookie = replace(PAGE, cookie=f"{name}={TOKEN}")
    for asked in (as_token, as_bearer, as_cookie):
        answer = FAR.judge(asked)
        assert answer is not None
        assert answer.reason in {"no_token", "wrong_token"}
    other = Access("0.0.0.0", 8081, TOKEN)  # noqa: S104
    assert other.judge(replace(PAGE, cookie=cookie)) is not None
    assert other.judge(replace(PAGE, cookie=f"{name[:-1]}1={value}")) is not None


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8080", None, "", "[", "10.0.0.1.x"])
def test_the_right_token_is_none_under_a_foreign_name(host: str | None) -> None:
    cookie = dict(entered().headers)["Set-Cookie"].partition(";")[0]
    for asked in (
        replace(PAGE, path=f"/?token={TOKEN}", host=host),
        replace(PAGE, authorization=f"Bearer {TOKEN}", host=host),
        replace(PAGE, cookie=cookie, host=host),
        replace(SOCKET, cookie=cookie, host=host),
    ):
        answer = FAR.judge(asked)
        assert answer is not None
        assert (answer.status, answer.reason) == (HTTPStatus.FORBIDDEN, "wrong_host")
        assert "Set-Cookie" not in dict(answer.headers)


def entered() -> Answer:
    answer = FAR.judge(replace(PAGE, path=f"/?token={TOKEN}"))
    assert answer is not None
    return answer


def test_beyond_loopback_it_goes_by_its_addresses_its_own_name_and_those_that_are_told() -> None:
    far = Access("guard.example", 8080, TOKEN, ["Wall.Example"])
    shown = replace(PAGE, authorization=f"Bearer {TOKEN}")
    own = socket.gethostname()
    for host in (
        "10.0.0.7:8080",
        "[fe80::1]:8080",
        "localhost",
        "guard.example",
        "WALL.example",
        own,
    ):
        assert far.judge(replace(shown, host=host)) is None
        assert far.judge(replace(PAGE, host=host)) is not None
    here = Access("127.0.0.1", 8080, TOKEN)  # a token behind a proxy: only names that are told
    for host in ("10.0.0.7:8080", "guard.example"):
        assert here.judge(replace(shown, host=host)) is not None


@pytest.mark.parametrize("given", ["", "x", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "é", "\ud800"])
def test_another_token_is_none(given: str) -> None:
    for asked in (
        replace(PAGE, path=f"/?token={given}"),
        replace(PAGE, cookie=f"rampe-guard-dashboard-8080={given}"),
        replace(PAGE, authorization=f"Bearer {given}"),
        replace(SOCKET, cookie=f"rampe-guard-dashboard-8080={given}"),
    ):
        answer = FAR.judge(asked)
        assert answer is not None
        assert answer.status == HTTPStatus.UNAUTHORIZED


def test_a_websocket_takes_no_token_from_its_address_nor_with_a_foreign_origin() -> None:
    answer = FAR.judge(replace(SOCKET, path=f"/?token={TOKEN}"))
    assert answer is not None
    assert answer.status == HTTPStatus.UNAUTHORIZED
    cookie = f"rampe-guard-dashboard-8080={TOKEN}"
    answer = FAR.judge(replace(SOCKET, cookie=cookie, origin="http://evil.example"))
    assert answer is not None
    assert answer.reason == "wrong_origin"


@pytest.mark.parametrize(
    ("path", "to"),
    [
        (f"//evil.example/?token={TOKEN}", "/"),
        (f"/\\evil.example?token={TOKEN}", "/evil.example"),
        (f"https://evil.example/a?token={TOKEN}", "/a"),
        (f"/?token={TOKEN}#x", "/"),
    ],
)
def test_the_redirection_never_leads_elsewhere(path: str, to: str) -> None:
    answer = FAR.judge(replace(PAGE, path=path))
    assert answer is not None
    assert dict(answer.headers)["Location"] == to


@pytest.mark.parametrize("protocol", [None, "", "viser-v", "viser-v[red]", "x", "viser-v1\x1b[0m"])
def test_what_is_no_page_opens_no_websocket(protocol: str | None) -> None:
    answer = HERE.judge(replace(SOCKET, protocol=protocol))
    assert answer is not None
    assert answer.reason == "no_page"


def test_of_this_machine() -> None:
    assert all(is_loopback(h) for h in ("127.0.0.1", "::1", "localhost", "127.5.5.5"))
    assert not any(is_loopback(h) for h in ("0.0.0.0", "::", "", "10.0.0.1", "machine"))  # noqa: S104


class TestPlace:
    def test_a_token_is_made_beyond_loopback_only(self) -> None:
        assert Place().token() is None
        first, second = Place("0.0.0.0").token(), Place("0.0.0.0").token()  # noqa: S104
        assert first is not None
        assert first != second
        assert wrong_token(first) is None

    def test_a_file_gives_it(self, tmp_path: Path) -> None:
        file = tmp_path / "token"
        file.write_text(f"{TOKEN}\n")
        file.chmod(0o640)
        place = Place(token_file=str(file))
        with pytest.raises(SettingsError, match=f"chmod 600 {file}"):
            place.token()
        file.chmod(0o600)
        assert place.token() == TOKEN
        for bad, said in (("short", "has 5 characters"), ("a b" * 9, "other than letters")):
            file.write_text(bad)
            with pytest.raises(SettingsError, match=said) as caught:
                place.token()
            assert bad not in str(caught.value)
        file.unlink()
        with pytest.raises(SettingsError, match="cannot be read"):
            place.token()
