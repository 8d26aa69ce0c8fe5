"""Hears everything on a router and holds it against the AsyncAPI document, key by key.

What lies on which key, and with which quality of service, is read from the document alone, as
a consumer would read it: nothing here knows the message types of the program.
"""

from __future__ import annotations

import json
import re
import threading
from collections import Counter
from pathlib import Path
from typing import Any, Self

import jsonschema  # type: ignore[import-untyped]
import zenoh
from ruamel.yaml import YAML

from tests.support.ears import open_session
from tests.support.processes import ROOT

FOLDER = ROOT / "config" / "contract"


class Document:
    """The AsyncAPI document in ``folder``, its schemas compiled."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self._whole = YAML(typ="safe").load((folder / "asyncapi.yaml").read_text("utf-8"))
        self._validators: dict[str, Any] = {}
        for path in folder.glob("*.schema.json"):
            schema = json.loads(path.read_text("utf-8"))
            self._validators[path.name] = jsonschema.Draft202012Validator(schema)

    def channel(self, key: str, parameters: dict[str, str]) -> str:
        """Name of the channel whose address, with the parameters put in, is ``key``."""
        for name, channel in self._whole["channels"].items():
            address = re.sub(r"{(\w+)}", lambda m: parameters.get(m[1], m[0]), channel["address"])
            if address == key:
                return str(name)
        raise AssertionError(f"no channel of the document is at {key}")

    def check(self, channel: str, body: Any, message: str | None = None) -> str:
        """Hold a message against its schema; returns the schema's name.

        ``message`` is its name within the channel; by default the channel has only one.
        """
        messages = self._whole["channels"][channel]["messages"]
        if message is None:
            (message,) = messages
        payload = self._resolve(messages[message]["$ref"])["payload"]
        assert payload["schemaFormat"] == "application/schema+json;version=2020-12"
        file = payload["schema"]["$ref"].removeprefix("./")
        self._validators[file].validate(body)
        return str(file.removesuffix(".schema.json"))

    def quality(self, channel: str) -> dict[str, Any]:
        """What the document says of the service on a channel."""
        wanted = {"$ref": f"#/channels/{channel}"}
        (operation,) = [o for o in self._whole["operations"].values() if o["channel"] == wanted]
        found: dict[str, Any] = operation["bindings"]["x-zenoh"]
        return found

    def _resolve(self, reference: str) -> Any:
        found = self._whole
        for step in reference.removeprefix("#/").split("/"):
            found = found[step]
        return found


class Tap:
    """Subscribes to everything below ``prefix``; keeps all of it for `check`."""

    def __init__(self, endpoint: str, prefix: str) -> None:
        self.session = open_session(endpoint)
        self._lock = threading.Lock()
        self._heard: list[tuple[str, bytes, dict[str, Any]]] = []
        self._subscriber = self.session.declare_subscriber(f"{prefix}/**", self._hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        quality = {
            "priority": str(sample.priority).rpartition(".")[2],
            "congestionControl": str(sample.congestion_control).rpartition(".")[2],
            "express": sample.express,
            "encoding": str(sample.encoding),
        }
        with self._lock:
            self._heard.append((str(sample.key_expr), sample.payload.to_bytes(), quality))

    def ask(self, key: str, payload: bytes | None = None) -> list[Any]:
        """Query a key; the answers."""
        replies = self.session.get(key, payload=payload, timeout=5.0)
        return [json.loads(r.ok.payload.to_bytes()) for r in replies if r.ok is not None]

    def check(self, document: Document, parameters: dict[str, str]) -> Counter[str]:
        """Hold all that was heard against the document; how many of each message there were."""
        with self._lock:
            heard = list(self._heard)
        counts: Counter[str] = Counter()
        for key, payload, quality in heard:
            channel = document.channel(key, parameters)
            counts[document.check(channel, json.loads(payload))] += 1
            said = document.quality(channel)
            assert {k: v for k, v in said.items() if k in quality} == {
                k: v for k, v in quality.items() if k in said
            }, key
        return counts

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
