"""Machines that speak ROS 2 on the access list: what is granted for them, and what is wrong."""

from __future__ import annotations

import pytest

from rampe_guard.errors import SettingsError
from rampe_guard.programs.access import router_config
from rampe_guard.settings.access import check_access
from rampe_guard.settings.access_model import AccessModel
from rampe_guard.settings.ros2_keys import DIAGNOSTICS, JOINT_STATE, JOY, MARKERS, NO_HASH
from rampe_guard.settings.source import parse
from tests.support.rights import granted

TEXT = """
router: {certificates: /tls}
machines:
  - {name: a, base: rampe/s/a/guard, format: ros2, ros2: {domain: 3}, joystick: /joy,
     actuators: /arm/joints, ros2_nodes: [/arm/driver]}
  - {name: b, base: rampe/s/b/guard, joystick: rampe/s/b/joystick, actuators: rampe/s/b/actuators}
access:
  - {certificate: one, role: ROLE}
"""
INPUTS = {f"3/joy/{JOY.dds}/{JOY.hash}", f"3/arm/joints/{JOINT_STATE.dds}/{JOINT_STATE.hash}"}
TOLD = {
    f"3/diagnostics/{DIAGNOSTICS.dds}/{DIAGNOSTICS.hash}",
    f"3/rampe_guard/markers/{MARKERS.dds}/{MARKERS.hash}",
}
NODE = "@ros2_lv/3/*/0"
OF_GUARD = {
    f"{NODE}/0/NN/%/%/rampe_guard",
    f"{NODE}/10/MP/%/%/rampe_guard/%diagnostics/{DIAGNOSTICS.dds}/{DIAGNOSTICS.hash}/::,10:,:,:,,",
    f"{NODE}/11/MP/%/%/rampe_guard/%rampe_guard%markers/{MARKERS.dds}/{MARKERS.hash}/::,10:,:,:,,",
}
OF_DRIVER = {
    "@ros2_lv/3/*/*/*/NN/*/%arm/driver",
    f"@ros2_lv/3/*/*/*/MP/*/%arm/driver/%joy/{JOY.dds}/{JOY.hash}/*",
    f"@ros2_lv/3/*/*/*/MP/*/%arm/driver/%arm%joints/{JOINT_STATE.dds}/{JOINT_STATE.hash}/*",
}


def access(role: str, *changes: tuple[str, str]) -> AccessModel:
    text = TEXT.replace("ROLE", role)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return check_access(parse(text, "access.yaml"))


def ours(keys: set[str]) -> set[str]:
    """Keys that are ROS 2's: all of a site's own lie below rampe."""
    return {key for key in keys if not key.startswith("rampe/")}


@pytest.mark.parametrize(
    ("role", "puts", "shows", "subscribes"),
    [
        ("machine, machines: [a]", INPUTS, OF_DRIVER, set()),
        ("machine, machines: [b]", set(), set(), set()),
        ("guard, machines: [a]", TOLD, OF_GUARD, {*INPUTS, "3/joy/*/*", "3/arm/joints/*/*"}),
        ("guard, machines: [b]", set(), set(), set()),
        ("viewer", set(), set(), INPUTS | TOLD),
        ("operator, machines: [b]", set(), set(), INPUTS | TOLD),  # reading is not divided
        ("recorder", set(), set(), INPUTS | TOLD),
    ],
)
def test_a_role_may_this_in_ros_2_and_no_more(
    role: str, puts: set[str], shows: set[str], subscribes: set[str]
) -> None:
    config = router_config(access(role))

    def may(flow: str, message: str) -> set[str]:
        return ours(granted(config, "one", flow, message))

    assert may("ingress", "put") == puts
    assert may("ingress", "liveliness_token") == shows
    assert may("ingress", "declare_subscriber") == subscribes
    assert may("egress", "put") == subscribes
    reads = not role.startswith(("machine", "guard"))
    who = {"@ros2_lv/3/**"} if reads else set()
    assert may("ingress", "liveliness_query") == who
    assert may("ingress", "declare_liveliness_subscriber") == who
    assert may("egress", "liveliness_token") == (OF_GUARD | OF_DRIVER if reads else set())
    for message in ("delete", "query", "reply", "declare_queryable"):
        assert may("ingress", message) == set()


def test_a_node_that_is_not_named_is_not_shown() -> None:
    config = router_config(access("machine, machines: [a]", (", ros2_nodes: [/arm/driver]", "")))
    assert granted(config, "one", "ingress", "liveliness_token") == set()
    nodes = ("[/arm/driver]", "[/driver, /arm/driver]")
    config = router_config(access("machine, machines: [a]", nodes))
    tokens = granted(config, "one", "ingress", "liveliness_token")
    assert len(tokens) == 6
    assert "@ros2_lv/3/*/*/*/NN/*/%/driver" in tokens


def test_the_block_is_that_of_the_site_file() -> None:
    bridged = ("{domain: 3}", "{transport: ros2dds, node: seven}")
    nobody = (", ros2_nodes: [/arm/driver]", "")
    config = router_config(access("guard, machines: [a]", bridged, nobody))
    assert ours(granted(config, "one", "ingress", "put")) == {"diagnostics", "seven/markers"}
    assert ours(granted(config, "one", "egress", "put")) == {"joy", "arm/joints"}
    assert granted(config, "one", "ingress", "liveliness_token") == {"rampe/s/a/guard/alive"}
    quiet = ("{domain: 3}", "{publish: false, type_hash: false}")
    config = router_config(access("guard, machines: [a]", quiet))
    assert ours(granted(config, "one", "ingress", "put")) == set()
    assert granted(config, "one", "ingress", "liveliness_token") == {"rampe/s/a/guard/alive"}
    assert f"0/joy/{JOY.dds}/{NO_HASH}" in granted(config, "one", "egress", "put")
    config = router_config(access("machine, machines: [a]", ("joystick: /joy", "joystick: p/joy")))
    assert "p/joy" in granted(config, "one", "ingress", "put")


def test_rates_are_of_keys_and_routers_pass_tokens_on() -> None:
    config = router_config(access("router"))
    (rates,) = config["downsampling"]
    assert {rule["key_expr"] for rule in rates["rules"]} >= INPUTS
    assert "@ros2_lv/**" in granted(config, "one", "ingress", "liveliness_token")
    assert "@ros2_lv/**" in granted(config, "one", "egress", "liveliness_token")


B = "joystick: rampe/s/b/joystick, actuators: rampe/s/b/actuators"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("format: ros2, ", "", "machines[0].ros2: is given, and format is json"),
        ("format: ros2, ros2: {domain: 3}, ", "", "'/joy' begins with a slash; give a Zenoh key"),
        ("domain: 3", "domian: 3", "domian"),
        ("/joy,", "/9joy,", "machines[0].joystick: '/9joy' is no ROS 2 topic"),
        ("/joy,", f"3/joy/{JOY.dds}/RIHS01_0,", "has not the hash of sensor_msgs/msg/Joy"),
        ("/joy,", '"/*",', "machines[0].joystick"),
        ("/joy,", "rampe/s/b/guard/alert,", "is a key that a guard publishes or answers on"),
        ("[/arm/driver]", "[driver]", "machines[0].ros2_nodes[0]: 'driver' has not the form"),
        ("[/arm/driver]", "[/rampe_guard]", "'/rampe_guard' is the node of a guard"),
        ("domain: 3", "transport: ros2dds", "machines[0].ros2_nodes: is given, and only nodes of"),
        (B, f"{B}, ros2_nodes: [/x]", "machines[1].ros2_nodes: is given, and only nodes of"),
        (
            B,
            "format: ros2, ros2: {domain: 3, node: b}, joystick: /joy, actuators: /b/joints",
            "machines[1].joystick: '3/joy/",
        ),
        (
            B,
            "format: ros2, ros2: {domain: 3}, joystick: /b/joy, actuators: /b/joints",
            "is there twice; give each guard its own node, or domain",
        ),
        (
            B,
            "format: ros2, ros2: {transport: ros2dds}, joystick: /diagnostics, actuators: /j",
            "machines[1].joystick: 'diagnostics' is a key that a guard publishes or answers on",
        ),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, told: str) -> None:
    with pytest.raises(SettingsError) as caught:
        access("viewer", (old, new))
    assert told in str(caught.value)


def test_machines_of_one_domain_share_diagnostics_alone() -> None:
    more = "format: ros2, ros2: {domain: 3, node: b}, joystick: /b/joy, actuators: /b/joints"
    one, two = (
        ours(granted(router_config(access(f"guard, machines: [{m}]", (B, more))), "one", *way))
        for m, way in (("a", ("ingress", "put")), ("b", ("ingress", "put")))
    )
    assert one & two == {f"3/diagnostics/{DIAGNOSTICS.dds}/{DIAGNOSTICS.hash}"}
