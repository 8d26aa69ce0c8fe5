"""What a router's configuration lets the bearer of a certificate do."""

from __future__ import annotations

from typing import Any


def granted(config: dict[str, Any], name: str, flow: str, message: str) -> set[str]:
    """Keys on which the bearer of a certificate may send (or get) a message."""
    control = config["access_control"]
    wanted = {rule for p in control["policies"] if name in p["subjects"] for rule in p["rules"]}
    return {
        key
        for rule in control["rules"]
        if rule["id"] in wanted and flow in rule["flows"] and message in rule["messages"]
        for key in rule["key_exprs"]
    }
