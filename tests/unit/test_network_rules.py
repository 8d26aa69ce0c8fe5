"""No message leaves the machine without certificates, unless somebody says so in words."""

from __future__ import annotations

import json
import re
import typing
from dataclasses import replace
from pathlib import Path

import pytest

from rampe_guard.errors import ConnectionFailedError, SettingsError
from rampe_guard.runtime.connecting import Network
from rampe_guard.runtime.zenoh_io import Bus, check_configuration
from rampe_guard.settings import ZenohSettings, load_site
from rampe_guard.settings.network import PLAIN_NETWORK, redacted, shown, stays_here
from rampe_guard.settings.site_model import ZenohModel
from tests.support.processes import BENCH

LONG = "tls/localhost:1?hush=1#connect_private_key_base64=hush"


def client(*endpoints: str, plain: bool = False) -> ZenohSettings:
    return ZenohSettings(None, "client", endpoints, plain_network=plain)


@pytest.mark.parametrize(
    "endpoint",
    [
        *("tcp/127.0.0.1:7447", "tcp/127.9.9.9:1", "tcp/[::1]:7447", "tcp/localhost:7447"),
        *("udp/127.0.0.1:7447", "ws/127.0.0.1:80", "unixsock-stream//run/zenoh.sock"),
        *("tls/10.0.0.1:7447", "quic/router.site:7447", "tls/router.site:7447?prio=1"),
        "tls/router.site:7447#verify_name_on_connect=true",
    ],
)
def test_what_stays_here_or_shows_a_certificate_is_taken(endpoint: str) -> None:
    check_configuration(client(endpoint))


@pytest.mark.parametrize(
    "endpoint",
    [
        *("tcp/10.0.0.1:7447", "tcp/[fe80::1]:7447", "tcp/router.site:7447", "udp/10.0.0.1:7447"),
        *("ws/10.0.0.1:80", "tcp/0.0.0.0:7447", "tcp/[::]:7447", "tcp/localhost.evil.org:7447"),
        *("tcp/127.0.0.1.evil.org:1", "tcp/127.1:7447", "tcp/2130706433:7447", "serial/ttyUSB0"),
        *("tcp/[::ffff:10.0.0.1]:1", "tcp/evil.org:1?x=/127.0.0.1:1", "TCP/10.0.0.1:1", "tcp/x"),
        *("tls/10.0.0.1:1#verify_name_on_connect=false", "vsock/2:7447"),
        "quic/10.0.0.1:1#iface=eth0;verify_name_on_connect=0",
    ],
)
def test_all_else_is_refused_with_both_ways_out(endpoint: str) -> None:
    with pytest.raises(SettingsError) as caught:
        check_configuration(client("tcp/127.0.0.1:7447", endpoint))
    said = str(caught.value)
    assert shown(endpoint) in said
    assert "zenoh.tls" in said
    assert f'zenoh: {{plain_network: "{PLAIN_NETWORK}"}}' in said
    with pytest.raises(SettingsError):  # and nothing was opened
        Bus.open(client(endpoint))


def test_with_the_words_it_is_taken() -> None:
    check_configuration(client("tcp/10.0.0.1:7447", plain=True))


class TestTheSiteFile:
    def site(self, folder: Path, zenoh: str) -> ZenohSettings:
        text = BENCH.read_text("utf-8")
        for old in ("../../geometry", "../scenes"):
            text = text.replace(old, str((BENCH.parent / old).resolve()))
        (folder / "site.yaml").write_text(f"{text}\nzenoh: {zenoh}\n", "utf-8")
        return load_site(folder / "site.yaml").zenoh

    def test_says_so_in_one_sentence(self, tmp_path: Path) -> None:
        far = 'connect: ["tcp/10.0.0.1:7447"]'
        silent = self.site(tmp_path, f"{{{far}}}")  # which is read: a replay needs no network
        with pytest.raises(SettingsError, match=r"tcp/10\.0\.0\.1:7447 is plain"):
            check_configuration(silent)
        check_configuration(self.site(tmp_path, f'{{{far}, plain_network: "{PLAIN_NETWORK}"}}'))
        for other in ("true", "yes", PLAIN_NETWORK.upper()):
            with pytest.raises(SettingsError, match=r"zenoh\.plain_network"):
                self.site(tmp_path, f"{{{far}, plain_network: {other}}}")

    def test_the_model_has_the_very_sentence(self) -> None:
        field = ZenohModel.model_fields["plain_network"].annotation
        (sentence, _) = typing.get_args(field)
        assert typing.get_args(sentence) == (PLAIN_NETWORK,)

    def test_the_command_line_is_judged_by_its_words(self, tmp_path: Path) -> None:
        far = Network(("tcp/10.0.0.1:7447",))
        quiet = self.site(tmp_path, "{}")
        loud = self.site(tmp_path, f'{{plain_network: "{PLAIN_NETWORK}"}}')
        bench = load_site(BENCH)
        with pytest.raises(SettingsError, match="is plain"):
            check_configuration(far.of(replace(bench, zenoh=quiet)).zenoh)
        check_configuration(far.of(replace(bench, zenoh=loud)).zenoh)
        check_configuration(replace(far, plain=True).of(replace(bench, zenoh=quiet)).zenoh)
        with pytest.raises(SettingsError, match="is plain"):
            check_configuration(far.settings)

    @pytest.mark.parametrize(
        ("zenoh", "said"),
        [
            ("{connect: [tls/a:1], tls: {root_ca: ca.pem, key: k.pem}}", "given without cert"),
            ("{connect: [tls/a:1], tls: {root_ca: ca.pem, certificate: ca.pem}}", "without key"),
            ("{config: z.json5, tls: {root_ca: ca.pem}}", "stands beside a config file"),
            ("{tls: {root_ca: ca.pem}}", "given, and every endpoint is plain; connect to"),
            ("{connect: [tcp/a:1], tls: {root_ca: ca.pem}}", r"endpoint is plain \(tcp/a:1\);"),
            ("{connect: [quic/10.1.2.3:1]}", r"connect\[0\]: 'quic/10\.1\.2\.3:1' is proven by"),
            (
                "{connect: [tcp/a:1, tls/a:1?x]}",
                r"connect\[1\]: 'tls/a:1…' is proven by .*add zenoh",
            ),
            ("{connect: [tcp/localhost:99999]}", r"connect\[0\]: .* no port from 1 to 65535"),
            ("{connect: [tcp/localhost:0]}", "no port from 1 to 65535"),
            ("{connect: [udp/localhost]}", "names no HOST:PORT"),
            ("{connect: ['ws/::1:80']}", "names no HOST:PORT"),
            ("{connect: ['tcp/a:b@c:²']}", "names no HOST:PORT"),
            ("{connect: [tls/a:1], tls: {root_ca: none.pem}}", "'none.pem' does not exist"),
            ("{connect: [tls/a:1], tls: {root_ca: /etc/x.pem}}", "outside the site's folder"),
        ],
    )
    def test_certificates_that_cannot_be(self, tmp_path: Path, zenoh: str, said: str) -> None:
        for name in ("ca.pem", "k.pem", "z.json5"):
            (tmp_path / name).write_text("{}")
        with pytest.raises(SettingsError, match=said):
            self.site(tmp_path, zenoh)

    @pytest.mark.parametrize(
        "endpoint",
        [
            *("tcp/[::1]:7447", "tcp/localhost:65535?prio=1", "unixsock-stream//run/z", "serial/x"),
            "tls/a:1#root_ca_certificate_file=/x",
        ],
    )
    def test_endpoints_that_may_be(self, tmp_path: Path, endpoint: str) -> None:
        assert self.site(tmp_path, f"{{connect: ['{endpoint}']}}").connect == (endpoint,)


def configured(folder: Path, **parts: object) -> ZenohSettings:
    (folder / "z.json5").write_text(json.dumps(parts))
    return ZenohSettings(str(folder / "z.json5"), "client", ())


QUIET = {"multicast": {"enabled": False}, "gossip": {"enabled": False}}


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"mode": "client", "connect": {"endpoints": ["tcp/10.0.0.1:1"]}}, "10.0.0.1:1 is plain"),
        (
            {"mode": "client", "connect": {"endpoints": {"client": ["udp/10.0.0.1:1"]}}},
            "10.0.0.1:1 is plain",
        ),
        ({"mode": "client"}, "scouting/multicast joins"),
        ({}, r"listens on tcp/\[::\]:0, plain"),  # Zenoh's own defaults: a peer, open to all
        ({"mode": "peer", "listen": {"endpoints": []}}, "scouting/multicast joins"),
        (
            {
                "mode": "peer",
                "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
                "scouting": {"multicast": {"enabled": False}},
            },
            "scouting/gossip joins",
        ),
        (
            {"mode": "peer", "listen": {"endpoints": ["tcp/0.0.0.0:1"]}, "scouting": QUIET},
            r"listens on tcp/0\.0\.0\.0:1, plain",
        ),
        (
            {"mode": "peer", "listen": {"endpoints": ["tls/0.0.0.0:1"]}, "scouting": QUIET},
            "asks nobody for a certificate",
        ),
        (
            {
                "mode": "client",
                "connect": {"endpoints": ["tls/10.0.0.1:1"]},
                "transport": {"link": {"tls": {"verify_name_on_connect": False}}},
            },
            "anybody's certificate",
        ),
    ],
)
def test_a_zenoh_file_is_judged_too(tmp_path: Path, parts: dict[str, object], said: str) -> None:
    settings = configured(tmp_path, **parts)
    with pytest.raises(SettingsError, match=said):
        check_configuration(settings)
    check_configuration(replace(settings, plain_network=True))


@pytest.mark.parametrize(
    "parts",
    [
        {"mode": "client", "connect": {"endpoints": ["tcp/127.0.0.1:1"]}},
        {"mode": "client", "connect": {"endpoints": ["tls/10.0.0.1:1"]}},
        {"mode": "peer", "listen": {"endpoints": ["tcp/127.0.0.1:0"]}, "scouting": QUIET},
        {  # found by scouting, but held to protocols that prove themselves
            "mode": "peer",
            "listen": {"endpoints": ["tls/0.0.0.0:1"]},
            "transport": {"link": {"tls": {"enable_mtls": True}}},
        },
    ],
)
def test_a_zenoh_file_that_exposes_nothing(tmp_path: Path, parts: dict[str, object]) -> None:
    check_configuration(configured(tmp_path, **parts))


def test_a_private_key_that_others_may_read_is_refused(tmp_path: Path) -> None:
    key = tmp_path / "k.pem"
    key.write_text("hush")
    parts = {
        "mode": "client",
        "connect": {"endpoints": ["tls/10.0.0.1:1"]},
        "transport": {"link": {"tls": {"connect_private_key": str(key)}}},
    }
    for mode in (0o640, 0o604, 0o660):
        key.chmod(mode)
        with pytest.raises(SettingsError, match=f"{key}.*chmod 600 {key}"):
            check_configuration(configured(tmp_path, **parts))
    for mode in (0o600, 0o400):
        key.chmod(mode)
        check_configuration(configured(tmp_path, **parts))
    key.unlink()
    with pytest.raises(SettingsError, match="cannot be read"):
        check_configuration(configured(tmp_path, **parts))


class TestSecrets:
    def test_an_endpoint_is_shown_without_its_ends(self) -> None:
        assert shown(LONG) == "tls/localhost:1…"
        assert shown("tcp/user:hush@127.0.0.1:7447") == "tcp/…@127.0.0.1:7447"
        assert shown("tcp/127.0.0.1:7447") == "tcp/127.0.0.1:7447"
        assert redacted(f"no [{LONG}]!", (LONG, "tls/localhost:1")) == "no [tls/localhost:1…]!"

    @pytest.mark.parametrize("endpoint", [LONG, "tcp/user:hush@127.0.0.1:1?hush#hush=hush"])
    def test_no_error_of_a_session_tells_them(self, endpoint: str, tmp_path: Path) -> None:
        by_file = configured(tmp_path, mode="client", connect={"endpoints": [endpoint]})
        for settings in (client(endpoint, plain=True), replace(by_file, plain_network=True)):
            with pytest.raises(ConnectionFailedError) as caught:
                Bus.open(settings)
            assert "hush" not in str(caught.value)
        far = re.sub("^.*:1", "tcp/user:hush@10.0.0.1:1", endpoint)
        with pytest.raises(SettingsError) as refused:
            check_configuration(client(far))
        assert "hush" not in str(refused.value)

    @pytest.mark.parametrize(
        "text",
        [
            '{mode: "client", password "hush"}',
            '{mode: "client", transport: {auth: {usrpwd: {user: "a", password: ["hush"]}}}}',
            '{mode: "x"} "hush"',
        ],
    )
    def test_nor_does_that_of_a_broken_file(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "z.json5").write_text(text)
        with pytest.raises(SettingsError) as caught:
            check_configuration(ZenohSettings(str(tmp_path / "z.json5"), "client", ()))
        assert "hush" not in str(caught.value)


def test_of_this_machine() -> None:
    assert not stays_here("tcp/")
    assert not stays_here("")
    assert not stays_here("tcp/localhost")
