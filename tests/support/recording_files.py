"""Small recordings made by the real writer, without any network."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rampe_guard.recording.bundle import gather
from rampe_guard.recording.channels import Channel, channels_of
from rampe_guard.recording.recorded_site import absolute_words
from rampe_guard.recording.writer import FILES, METADATA, Entry, Head, McapFile
from rampe_guard.settings import Site, load_site
from tests.support.arms import slider

SITE = """\
site: quarry
machine: e7
keys: {joystick: r/joystick, actuators: r/actuators, base: r/guard, enabled: r/enabled}
arm:
  urdf: slider.urdf
  actuators:
    - {name: slide, joint: slide, max_velocity: 1.0, limits: {lower: -2, upper: 2}}
inputs: {joystick: {alive_key: r/alive}}
scene: scene.yaml
"""
SCENE = """\
objects:
  - {name: wall, type: box, size: [1, 1, 1], pose: {xyz: [5, 0, 0]}}
  - {name: truck, type: sphere, radius_m: 1, center: [0, 0, 0], key: r/truck, max_speed: 2}
"""
START_NS = 1_700_000_000_000_000_000


def small_site(folder: Path) -> Site:
    """One actuator, a wall, a truck that moves, an enable key and a token of the joystick."""
    slider(folder)
    (folder / "scene.yaml").write_text(SCENE, "utf-8")
    (folder / "site.yaml").write_text(SITE, "utf-8")
    return load_site(folder / "site.yaml")


def channel(site: Site, role: str) -> Channel:
    """The channel of a role."""
    return next(c for c in channels_of(site) if c.role == role)


def entry(site: Site, at_s: float, role: str, said: Any, key: str | None = None) -> Entry:
    """A message that came ``at_s`` after the start; bytes as they are, else as JSON."""
    where = channel(site, role)
    payload = said if isinstance(said, bytes) else json.dumps(said).encode()
    return Entry(START_NS + round(at_s * 1e9), where, key or where.key, payload)


def head_of(site: Site) -> Head:
    """With the site's files."""
    bundle = gather(site)
    words = {"site_file": FILES + bundle.site, "absolute": absolute_words(bundle)}
    words["operator"] = site.operator
    return Head({METADATA: words}, {FILES + n: c for n, c in bundle.files.items()})


def write(site: Site, path: Path, batches: Iterable[list[Entry]], head: Head | None = None) -> Path:
    """A finished file, a chunk for each batch."""
    file = McapFile(path, channels_of(site), head_of(site) if head is None else head)
    for batch in batches:
        for one in batch:
            file.add(one)
        file.commit()
    file.finish({})
    return path
