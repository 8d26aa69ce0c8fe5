"""Any bytes as a site file give a site or a `SettingsError`: never a traceback, never NaN."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rampe_guard.errors import SettingsError
from rampe_guard.settings import load_site, parse_scene

T = TypeVar("T")

SITE = b"""\
site: quarry
machine: excavator
keys: {joystick: a/joystick, actuators: a/actuators, base: a/guard}
arm:
  urdf: arm.urdf
  base_pose: {xyz: [0, 0, 1e-3], rpy: [0, 0, 0]}
  actuators:
    - {name: swing, joint: swing_joint, drive: {type: direct}, max_velocity: 0.6}
    - name: boom
      joint: boom_joint
      max_velocity: 0.15
      limits: {lower: 0, upper: 0.8}
      drive: {type: cylinder, base_m: 1.5, rod_m: 2.1, length_at_zero_m: 1.3}
  linkages: [{joint: barrel, actuator: boom}]
scene: scene.yaml
log: {time: t, joystick: {swing: a, boom: b}, actuators: {swing: a, boom: {column: c}}}
alerts: {debounce_steps: 2}
"""
SCENE = b"""\
margin_m: 0.3
objects:
  - {name: a, type: box, size: [1, 2, 3], pose: {xyz: [0, 0, 0]}}
  - {name: b, type: halfspace, normal: [0, 0, 1], ignore_links: [track]}
  - {name: c, type: actuator_limit, actuator: swing, above: 1}
"""
PIECES = [
    b"", b"\n", b"  ", b"\t", b": ", b"- ", b"[", b"]", b"{", b"}", b"'", b'"', b"|", b">", b"&a ",
    b"*a", b"!!binary ", b"#", b"---\n", b"...", b"%YAML 1.1\n", b"? ", b"<<: ", b"null", b"true",
    b".nan", b"-.inf", b"1e999", b"1e300", b"-1", b"0", b"9" * 400, b"\xff", b"\xef\xbb\xbf",
    b'"\\ud800"', b'"\\UFFFFFFFF"', b"\x00", b"\xc2\x85", b"/" * 300, b"type", b"mesh", b"table",
]  # fmt: skip


@st.composite
def mutations(draw: st.DrawFn, text: bytes) -> bytes:
    """``text`` with a few pieces replaced, inserted or removed."""
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.sampled_from([0, 0, 1, 2, 5, 20])))
        piece = draw(st.sampled_from(PIECES) | st.binary(max_size=4))
        text = text[:start] + piece + text[end:]
    return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    (folder / "arm.urdf").write_bytes(b"<robot/>")
    (folder / "scene.yaml").write_bytes(SCENE)
    (folder / "site.yaml").write_bytes(SITE)
    assert load_site(folder / "site.yaml").name == "quarry"
    return folder


def attempt(load: Callable[[], T]) -> tuple[T | None, list[str]]:
    """What was loaded, or None and the lines of a refusal."""
    try:
        return load(), []
    except SettingsError as error:
        refusal = str(error).splitlines()
    assert refusal
    return None, refusal


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(content=mutations(SITE) | st.binary(max_size=60))
def test_any_site_file_is_a_site_or_a_settings_error(folder: Path, content: bytes) -> None:
    path = folder / "mutated.yaml"
    path.write_bytes(content)
    site, refusal = attempt(lambda: load_site(path))
    for line in refusal:
        # a name that changed in the site may be missed in the scene: that file is named then
        assert line.startswith((str(path), str(path.with_name("scene.yaml"))))
        assert line.isprintable()
        assert len(line) < 1000
    if site is not None:
        assert all(0.0 < actuator.max_velocity <= 1000.0 for actuator in site.guard.actuators)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(content=mutations(SCENE))
def test_any_scene_is_a_scene_or_a_settings_error(folder: Path, content: bytes) -> None:
    scene, refusal = attempt(lambda: parse_scene(content, actuators=("swing",), directory=folder))
    assert all(line.startswith("<scene>") for line in refusal)
    assert scene is None or scene.objects
