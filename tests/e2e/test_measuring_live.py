"""`init` and `check --live` on a machine that is really there, in a process of its own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess
from typing import NamedTuple

import pytest

from rampe_guard.settings import load_site
from tests.support import processes, small_arm
from tests.support.processes import Process, called

pytestmark = pytest.mark.e2e

JOYSTICK, ACTUATORS = "yard/arm/joystick", "yard/arm/actuators"


class Place(NamedTuple):
    """A machine at work, and the site that was made of it."""

    folder: Path
    endpoint: str
    machine: Process
    made: CompletedProcess[str]

    def check(self, seconds: float, site: str = "site.yaml") -> CompletedProcess[str]:
        """`check --live` of the site."""
        more = ("--live", "--seconds", str(seconds), "--connect", self.endpoint)
        return called("check", self.folder / "site" / site, *more)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    folder = tmp_path_factory.mktemp("live")
    endpoint = processes.free_endpoint()
    urdf = small_arm.write_urdf(folder)
    args = ("-m", "tests.support.exerciser", endpoint, JOYSTICK, ACTUATORS)
    with (
        processes.router(folder, endpoint),
        Process(folder, "machine", args, talk=True) as machine,
    ):
        machine.wait_for("ready")
        keys = ("--joystick", JOYSTICK, "--actuators", ACTUATORS)
        live = ("--connect", endpoint, *keys, "--seconds", "8", "--yes")
        made = called("init", urdf, "--out", folder / "site", *live)
        yield Place(folder, endpoint, machine, made)


def test_a_live_machine_becomes_a_site(place: Place) -> None:
    assert place.made.returncode == 0, place.made.stderr
    site = load_site(place.folder / "site" / "site.yaml")
    assert (site.keys.joystick, site.keys.actuators) == (JOYSTICK, ACTUATORS)
    assert site.zenoh.connect == (place.endpoint,)
    told = small_arm.told_levers(place.folder / "site" / "site.yaml")
    assert len(told) >= 2  # in so short a time perhaps not of all
    assert told.items() <= small_arm.LEVERS.items()
    for true, made in zip(small_arm.ACTUATORS, site.guard.actuators, strict=True):
        if true.name in told:
            assert 0.5 * true.max_velocity < made.max_velocity < 2.0 * true.max_velocity
    replayed = called(
        "replay", place.folder / "site" / "site.yaml", place.folder / "site" / "measured.csv"
    )
    assert replayed.returncode == 0, replayed.stderr


def test_silent_keys_are_named_and_those_that_speak(place: Place, tmp_path: Path) -> None:
    keys = ("--joystick", "yard/arm/stick", "--actuators", ACTUATORS)
    live = ("--connect", place.endpoint, *keys, "--seconds", "0.4", "--yes")
    done = called("init", place.folder / "small_arm.urdf", "--out", tmp_path, *live)
    assert done.returncode == 2
    assert "nothing came on yard/arm/stick" in done.stderr
    assert f"there are messages on {ACTUATORS}, {JOYSTICK}" in done.stderr
    assert not (tmp_path / "site.yaml").exists()


def test_a_machine_as_the_site_file_says(place: Place) -> None:
    done = place.check(1.5)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {line.split()[0]: line.split() for line in done.stdout.splitlines() if line.strip()}
    for name in ("joystick", "actuators"):
        assert rows[name][-1] == "none"  # is refused
        assert 30.0 < float(rows[name][2].removesuffix("/s")) < 60.0
    assert "ms apart" in done.stdout
    assert "should be" not in done.stdout
    assert "a guard does not work on" in done.stdout
    assert "ok: this site can be guarded" in done.stdout


def test_what_is_wrong_with_a_machine_is_told(place: Place) -> None:
    """Another clock, levers the other way round, and messages that are none."""
    place.machine.tell(json.dumps({"skew_s": 2.0, "flip": True, "rubbish": True}))
    try:
        done = place.check(5.0)
    finally:
        place.machine.tell(json.dumps({"skew_s": 0.0, "flip": False, "rubbish": False}))
    assert done.returncode == 2, done.stdout + done.stderr  # no guard takes such clocks
    text = " ".join(done.stdout.split())
    assert "can be guarded" not in text
    assert "not ok: machine and site file contradict each other" in text
    assert "bad_json" in text
    assert "turn: it moves against its lever" in text
    assert "the site file's sign 1 should be -1" in text
    assert "joystick: its clock is 2 s ahead of this computer's" in text
    assert "the clocks of joystick and actuators are 2 s apart" in text


def test_a_missing_stream_is_no_ok(place: Place) -> None:
    place.machine.tell(json.dumps({"joystick": False}))
    try:
        done = place.check(0.6)
    finally:
        place.machine.tell(json.dumps({"joystick": True}))
    assert done.returncode == 2
    assert f"joystick: nothing came on {JOYSTICK}" in done.stdout
    assert "ok: this site can be guarded" not in done.stdout.replace("not ok", "")
