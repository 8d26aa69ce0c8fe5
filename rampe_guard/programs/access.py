"""``rampe-guard access``: a router's configuration from the access list of a site.

What is not allowed is denied. Zenoh compares a message's key expression as it was sent: a right to
put on an exact key is none to put on a wildcard that holds it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from rampe_guard.errors import SettingsError
from rampe_guard.programs import access_ros2
from rampe_guard.settings.access import read_access
from rampe_guard.settings.access_model import AccessModel, GrantModel, MachineModel
from rampe_guard.settings.ros2_keys import LIVELINESS

MAX_MESSAGE_BYTES: Final = 128 * 1024
"""Twice what the guard takes: the router drops without a word, the guard refuses and counts."""
MAX_SCENE_BYTES: Final = 8 * 1024 * 1024
MAX_REPLY_BYTES: Final = 16 * 1024 * 1024
PUBLISHED: Final = ("alert", "prediction", "advice", "heartbeat")
READ: Final = ("state", "scene")
"""Queries of those who only look."""
COMMANDS: Final = {
    "operator": ("ack", "shelve"),
    "engineer": ("ack", "shelve", "scene/put", "forget"),
}
EVERYTHING: Final = (
    *("put", "delete", "declare_subscriber", "query", "reply", "declare_queryable"),
    *("liveliness_token", "liveliness_query", "declare_liveliness_subscriber"),
)
_LEASE_MS, _ACCEPT_MS = 1000, 3000
_QUEUE: Final = 16
_PLAIN: Final = "every process of the router's own host"

Rule = dict[str, Any]


def write_router_config(path: str, out: str | None, note: Callable[[str], None]) -> str:
    """Make the configuration of an access list; returns it, or where it was written.

    Args:
        path: of the access list.
        out: file to write, if any.
        note: is told what is allowed and may still be a mistake.

    Raises:
        SettingsError: the access list is wrong, or ``out`` cannot be written.
    """
    access = read_access(path)
    for name, roles in roles_that_add_up(access):
        note(f"{path}: certificate {name} has {len(roles)} roles, which add up: {', '.join(roles)}")
    text = router_text(access, Path(path).name)
    if out is None:
        return text
    try:
        Path(out).write_text(text, encoding="utf-8")
    except OSError as error:
        raise SettingsError(f"{out}: cannot be written ({error.strerror})") from None
    count = len({grant.certificate for grant in access.access})
    return f"{out}: {len(access.machines)} machines, {count} certificates\n"


def roles_that_add_up(access: AccessModel) -> list[tuple[str, list[str]]]:
    """Certificates with more than one role, and their roles as they stand."""
    roles: dict[str, list[str]] = {}
    for grant in access.access:
        if grant.role not in roles.setdefault(grant.certificate, []):
            roles[grant.certificate].append(grant.role)
    return [(name, found) for name, found in roles.items() if len(found) > 1]


def router_text(access: AccessModel, source: str) -> str:
    """The json5 of a router."""
    head = f"// Made by `rampe-guard access {source}`. Edit that file and make this one anew.\n"
    return head + json.dumps(router_config(access), indent=1, ensure_ascii=False) + "\n"


def router_config(access: AccessModel) -> dict[str, Any]:
    """The configuration of a router as Zenoh names its parts."""
    router = access.router
    folder = router.certificates.rstrip("/")
    listen = list(router.listen)
    if router.plain_loopback_port is not None:
        listen.append(f"tcp/127.0.0.1:{router.plain_loopback_port}")
    sizes = dict.fromkeys(("real_time", "data_high", "data"), _QUEUE)
    tls = {
        "root_ca_certificate": f"{folder}/ca.crt",
        "listen_private_key": f"{folder}/tls.key",
        "listen_certificate": f"{folder}/tls.crt",
        "enable_mtls": True,
        "connect_private_key": f"{folder}/tls.key",
        "connect_certificate": f"{folder}/tls.crt",
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
    return {
        "mode": "router",
        "listen": {"endpoints": listen},
        "connect": {"endpoints": list(router.connect), "exit_on_failure": False},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "adminspace": {"enabled": False},
        "transport": {
            "unicast": {"accept_timeout": _ACCEPT_MS, "open_timeout": _ACCEPT_MS},
            "link": {
                "protocols": sorted({endpoint.split("/")[0] for endpoint in listen}),
                "tx": {"lease": _LEASE_MS, "queue": {"size": sizes}},
                "rx": {"max_message_size": MAX_REPLY_BYTES},
                "tls": tls,
            },
            "shared_memory": {"enabled": False},
        },
        "access_control": _access_control(access),
        "low_pass_filter": _sizes(access),
        "downsampling": _rates(access),
    }


def _access_control(access: AccessModel) -> dict[str, Any]:
    rules: dict[str, Rule] = {}
    subjects: dict[str, dict[str, Any]] = {}
    policies = []
    for grant in access.access:
        name = grant.certificate
        subjects[name] = {"id": name, "cert_common_names": [name]}
        wanted = list(_rules(grant, access))
        rules.update((rule["id"], rule) for rule in wanted)
        policies.append({"rules": [rule["id"] for rule in wanted], "subjects": [name]})
    if access.router.plain_loopback_port is not None:
        rule = _everything()
        rules[rule["id"]] = rule
        subjects[_PLAIN] = {"id": _PLAIN, "interfaces": ["lo"], "link_protocols": ["tcp"]}
        policies.append({"rules": [rule["id"]], "subjects": [_PLAIN]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": list(rules.values()),
        "subjects": list(subjects.values()),
        "policies": policies,
    }


def _rules(grant: GrantModel, access: AccessModel) -> Iterator[Rule]:
    if grant.role == "router":
        yield _everything()
        return
    machines = [m for m in access.machines if grant.machines is None or m.name in grant.machines]
    publishes = grant.role in ("machine", "object", "guard", "recorder")
    if publishes:  # a publisher that hears of no subscriber sends nothing
        yield _rule("hear of subscribers", "egress", ("declare_subscriber",), ("**",))
    if grant.role == "object":
        yield _rule(f"object {grant.certificate}", "ingress", ("put",), grant.keys or ())
    elif grant.role == "machine":
        for machine in machines:
            yield from _machine(machine)
    elif grant.role == "guard":
        for machine in machines:
            yield from _guard(machine, access.read)
    else:
        yield from _reading(access.read)
        for machine in access.machines:  # as below read: rights to read are not divided
            yield from _spoken(access_ros2.reader_rights(machine))
        for machine in machines:
            yield from _beyond_reading(grant.role, machine)


def _machine(machine: MachineModel) -> Iterator[Rule]:
    own = (*machine.inputs, machine.enabled)
    yield _rule(f"machine {machine.name}", "ingress", ("put",), own)
    if machine.joystick_alive is not None:
        token = (machine.joystick_alive,)
        yield _rule(f"joystick {machine.name}", "ingress", ("liveliness_token",), token)
    advice = (f"{machine.base}/advice",)
    yield _rule(f"machine {machine.name}: asks", "ingress", ("declare_subscriber",), advice)
    yield _rule(f"machine {machine.name}: is advised", "egress", ("put",), advice)
    yield from _spoken(access_ros2.machine_rights(machine))


def _guard(machine: MachineModel, read: str) -> Iterator[Rule]:
    who, base = f"guard {machine.name}", machine.base
    taken = (*machine.inputs, machine.enabled, *machine.objects)
    asked = tuple(f"{base}/{part}" for part in (*READ, *COMMANDS["engineer"]))
    alive = f"{base}/alive"
    yield _rule(f"{who}: subscribes", "ingress", ("declare_subscriber",), taken)
    yield _rule(f"{who}: takes", "egress", ("put",), taken)
    told = tuple(f"{base}/{part}" for part in PUBLISHED)
    yield _rule(f"{who}: tells", "ingress", ("put",), told)
    yield _rule(f"{who}: answers", "ingress", ("declare_queryable", "reply"), asked)
    # a query may be for all guards at once: who may ask what is decided where it comes in
    yield _rule(f"{who}: is asked", "egress", ("query",), (read,))
    yield _rule(f"{who}: is alive", "ingress", ("liveliness_token", "liveliness_query"), (alive,))
    tokens = (alive, machine.joystick_alive)
    yield _rule(f"{who}: hears tokens", "egress", ("liveliness_token",), tokens)
    if machine.joystick_alive is not None:
        watched = (machine.joystick_alive,)
        yield _rule(f"{who}: watches", "ingress", ("declare_liveliness_subscriber",), watched)
    yield from _spoken(access_ros2.guard_rights(machine))


def _reading(read: str) -> Iterator[Rule]:
    asks = ("declare_subscriber", "liveliness_query", "declare_liveliness_subscriber")
    yield _rule("read: asks for", "ingress", asks, (read,))
    yield _rule("read: gets", "egress", ("put", "reply", "liveliness_token"), (read,))
    yield _rule("read: queries", "ingress", ("query",), tuple(f"{read}/{part}" for part in READ))


def _beyond_reading(role: str, machine: MachineModel) -> Iterator[Rule]:
    if role == "recorder":
        own = (f"{machine.base}/recorder",)
        yield _rule(f"recorder {machine.name}", "ingress", ("put", "liveliness_token"), own)
    elif role in COMMANDS:
        commands = tuple(f"{machine.base}/{part}" for part in COMMANDS[role])
        yield _rule(f"{role} {machine.name}", "ingress", ("query",), commands)


def _everything() -> Rule:
    # ** stands for no part that begins with @
    rule = _rule("everything", "ingress", EVERYTHING, ("**", f"{LIVELINESS}/**"))
    return {**rule, "flows": ["ingress", "egress"]}


def _spoken(rights: Iterable[access_ros2.Right]) -> Iterator[Rule]:
    return (_rule(*right) for right in rights)


def _rule(name: str, flow: str, messages: tuple[str, ...], keys: tuple[str | None, ...]) -> Rule:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": [key for key in keys if key is not None],
    }


def _sizes(access: AccessModel) -> list[dict[str, Any]]:
    """Of several limits on a key Zenoh takes the smallest, so each key has one."""
    scenes = [f"{machine.base}/scene/put" for machine in access.machines]
    small = [f"{access.read}/{part}" for part in READ]
    small += [
        f"{machine.base}/{part}"
        for machine in access.machines
        for part in COMMANDS["engineer"]
        if part != "scene/put"
    ]
    return [
        _size("messages", ("put", "delete"), ["**"], MAX_MESSAGE_BYTES),
        _size("questions", ("query",), small, MAX_MESSAGE_BYTES),
        _size("scenes", ("query",), scenes, MAX_SCENE_BYTES),
        _size("answers", ("reply",), ["**"], MAX_REPLY_BYTES),
    ]


def _size(name: str, messages: tuple[str, ...], keys: list[str], limit: int) -> dict[str, Any]:
    return {
        "id": name,
        "flows": ["ingress"],
        "messages": list(messages),
        "key_exprs": keys,
        "size_limit": limit,
    }


def _rates(access: AccessModel) -> list[dict[str, Any]]:
    """Only what comes in, and only inputs: an alert is never thinned out."""
    rates = {
        key: machine.max_rate_hz
        for machine in access.machines
        if machine.max_rate_hz is not None
        for key in (*machine.inputs, machine.enabled, *machine.objects)
        if key is not None
    }
    rules = [{"key_expr": key, "freq": rate} for key, rate in rates.items()]
    what = {"id": "inputs", "flows": ["ingress"], "messages": ["put"], "rules": rules}
    return [what] if rules else []
