"""The access list: what is wrong with one is said, and what it grants is what the router gets."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import zenoh

from rampe_guard.errors import SettingsError
from rampe_guard.programs.access import MAX_MESSAGE_BYTES, router_config, write_router_config
from rampe_guard.settings.access import check_access
from rampe_guard.settings.access_model import AccessModel
from rampe_guard.settings.source import parse
from rampe_guard.wire import MAX_PAYLOAD_BYTES
from rampe_guard.wire.channels import KEYS
from tests.support.processes import ROOT, called
from tests.support.rights import granted

EXAMPLE = ROOT / "deploy" / "access.example.yaml"
BASE = "rampe/quarry-north/excavator-7/guard"
TEXT = """
router: {certificates: /tls}
machines:
  - {name: a, base: rampe/s/a/guard, joystick: rampe/s/a/joystick, actuators: rampe/s/a/actuators,
     enabled: rampe/s/a/enabled, joystick_alive: rampe/s/a/alive, objects: [rampe/s/truck]}
  - {name: b, base: rampe/s/b/guard, joystick: rampe/s/b/joystick, actuators: rampe/s/b/actuators,
     max_rate_hz: null}
access:
  - {certificate: one, role: ROLE}
"""


def access(role: str = "viewer") -> AccessModel:
    return check_access(parse(TEXT.replace("ROLE", role), "access.yaml"))


@pytest.mark.parametrize(
    ("role", "puts", "asks"),
    [
        ("machine, machines: [a]", {"joystick", "actuators", "enabled"}, set()),
        ("object, keys: [rampe/s/truck]", {"rampe/s/truck"}, set()),
        (
            "guard, machines: [a]",
            {"guard/alert", "guard/prediction", "guard/advice", "guard/heartbeat"},
            set(),
        ),
        ("recorder, machines: [a]", {"guard/recorder"}, {"state", "scene"}),
        ("viewer", set(), {"state", "scene"}),
        ("operator, machines: [a]", set(), {"state", "scene", "ack", "shelve"}),
        (
            "engineer, machines: [a]",
            set(),
            {"state", "scene", "ack", "shelve", "scene/put", "forget"},
        ),
    ],
)
def test_a_role_may_put_and_ask_this_and_no_more(role: str, puts: set[str], asks: set[str]) -> None:
    config = router_config(access(role))
    assert config["access_control"]["default_permission"] == "deny"
    assert {rule["permission"] for rule in config["access_control"]["rules"]} == {"allow"}
    expected = {key if key.startswith("rampe/") else f"rampe/s/a/{key}" for key in puts}
    assert granted(config, "one", "ingress", "put") == expected
    assert granted(config, "one", "ingress", "delete") == set()
    every = {"state": "rampe/**/state", "scene": "rampe/**/scene"}
    keys = {every.get(word, f"rampe/s/a/guard/{word}") for word in asks}
    assert granted(config, "one", "ingress", "query") == keys
    serves = granted(config, "one", "ingress", "declare_queryable")
    assert bool(serves) is role.startswith("guard")
    hears = granted(config, "one", "ingress", "declare_subscriber")
    assert ("rampe/**" in hears) is bool(asks)


def test_without_machines_a_reader_s_rights_are_on_all_of_them() -> None:
    config = router_config(access("operator"))
    asks = granted(config, "one", "ingress", "query")
    assert {"rampe/s/a/guard/ack", "rampe/s/b/guard/ack"} <= asks


def test_every_key_of_the_contract_is_granted_to_its_guard() -> None:
    """A key that is added to the contract must be added to the access list, too."""
    config = router_config(access("guard, machines: [a]"))
    ways = {
        "published": ("ingress", "put"),
        "answered": ("ingress", "declare_queryable"),
        "held": ("ingress", "liveliness_token"),
    }
    for key in KEYS:
        if key.way in ways and key.name != "recorder":
            address = key.address.replace("{base}", "rampe/s/a/guard")
            assert address in granted(config, "one", *ways[key.way]), key.name
    taken = {"rampe/s/a/joystick", "rampe/s/a/actuators", "rampe/s/a/enabled", "rampe/s/truck"}
    assert granted(config, "one", "ingress", "declare_subscriber") == taken
    assert granted(config, "one", "egress", "put") == taken
    assert granted(config, "one", "ingress", "declare_liveliness_subscriber") == {"rampe/s/a/alive"}


def test_sizes_and_rates() -> None:
    config = router_config(access())
    assert MAX_MESSAGE_BYTES > MAX_PAYLOAD_BYTES  # so that the guard can count what is too large
    queries = [
        key for s in config["low_pass_filter"] if "query" in s["messages"] for key in s["key_exprs"]
    ]
    assert len(queries) == len(set(queries))
    (rates,) = config["downsampling"]
    assert rates["flows"] == ["ingress"]
    keys = {rule["key_expr"] for rule in rates["rules"]}
    assert keys == {
        "rampe/s/a/joystick",
        "rampe/s/a/actuators",
        "rampe/s/a/enabled",
        "rampe/s/truck",
    }  # all of a, whose rate is limited, and none of b


def test_a_router_wants_certificates_and_finds_nobody() -> None:
    config = router_config(access())
    link = config["transport"]["link"]
    assert config["listen"]["endpoints"] == ["tls/0.0.0.0:7447"]
    assert link["protocols"] == ["tls"]
    assert link["tls"]["enable_mtls"] is True
    assert link["tls"]["close_link_on_expiration"] is True
    assert config["scouting"] == {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
    assert config["adminspace"] == {"enabled": False}


def test_plain_messages_are_for_the_router_s_own_host() -> None:
    text = TEXT.replace("/tls}", "/tls, plain_loopback_port: 7448}").replace("ROLE", "viewer")
    config = router_config(check_access(parse(text, "access.yaml")))
    assert config["listen"]["endpoints"][1:] == ["tcp/127.0.0.1:7448"]
    (plain,) = (s for s in config["access_control"]["subjects"] if "cert_common_names" not in s)
    assert plain["interfaces"] == ["lo"]
    assert plain["link_protocols"] == ["tcp"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("role: ROLE", "role: boss", "access.yaml:9: access[0].role"),
        ("role: ROLE", "role: guard", "access[0].role: guard of which machines is not said"),
        ("role: ROLE", "role: viewer, machines: [c]", "machines[0]: no machine is named 'c'"),
        ("role: ROLE", "role: object", "object needs the keys of its poses"),
        ("role: ROLE", "role: viewer, keys: [rampe/s/truck]", "viewer cannot have keys"),
        ("role: ROLE", "role: object, keys: [rampe/s/trock]", "did you mean 'rampe/s/truck'?"),
        ("rampe/s/b/joystick", "rampe/s/b/*", "machines[1].joystick"),
        ("rampe/s/b/joystick", "rampe/s/a/joystick", "is there twice"),
        ("rampe/s/b/joystick", "other/b/joystick", "is not below read, rampe/**"),
        ("name: b", "name: a", "'a' is there twice"),
        ("[rampe/s/truck]", "[rampe/s/b/guard/alert]", "is a key that a guard publishes"),
        ("/tls}", "/tls, listen: [tcp/0.0.0.0:7447]}", "'tcp/0.0.0.0:7447' is not encrypted"),
        ("/tls}", "/tls, lisen: []}", "lisen"),
        ("certificate: one", "certificate: 'one, two'", "access[0].certificate"),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, told: str) -> None:
    assert old in TEXT
    text = TEXT.replace(old, new).replace("ROLE", "viewer")
    with pytest.raises(SettingsError) as caught:
        check_access(parse(text, "access.yaml"))
    assert told in str(caught.value)


def test_zenoh_takes_what_is_made_of_the_example(tmp_path: Path) -> None:
    out = tmp_path / "router.json5"
    notes: list[str] = []
    assert (
        write_router_config(str(EXAMPLE), str(out), notes.append)
        == f"{out}: 1 machines, 7 certificates\n"
    )
    taken = zenoh.Config.from_file(out)
    rules = json.loads(taken.get_json("access_control/rules"))
    assert {key for rule in rules for key in rule["key_exprs"]} >= {f"{BASE}/ack", f"{BASE}/alert"}
    assert write_router_config(str(EXAMPLE), None, notes.append) == out.read_text()
    assert notes == []


def test_the_command_says_what_is_wrong(tmp_path: Path) -> None:
    assert called("access", EXAMPLE).stdout.startswith("// Made by `rampe-guard access access.ex")
    done = called("access", tmp_path / "none.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert "there is no such access list" in done.stderr
    done = called("access", EXAMPLE, "--out", tmp_path / "no" / "such")
    assert done.returncode == 2
    assert "cannot be written (No such file or directory)" in done.stderr
    assert "is a directory; give an access list" in called("access", tmp_path).stderr


def test_roles_of_one_certificate_add_up_and_that_is_told(tmp_path: Path) -> None:
    file = tmp_path / "access.yaml"
    more = "  - {certificate: one, role: viewer}\n  - {certificate: two, role: viewer}\n"
    more += "  - {certificate: one, role: machine, machines: [a]}\n"
    file.write_text(TEXT.replace("ROLE", "viewer") + more)
    done = called("access", file)
    assert done.returncode == 0
    assert done.stderr == (
        f"note: {file}: certificate one has 2 roles, which add up: viewer, machine\n"
    )
