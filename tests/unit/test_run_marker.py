"""The next guard knows how this one ended, and what nobody had seen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from rampe_guard import wire
from rampe_guard.runtime import run_marker
from rampe_guard.runtime.run_marker import NAME, RunMarker
from rampe_guard.runtime.say import Sayer
from rampe_guard.runtime.store import model_folder
from rampe_guard.settings import Site
from tests.support.messages import ALERT
from tests.support.models import bench_site
from tests.support.processes import until


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return bench_site(tmp_path)


def marker(site: Site) -> RunMarker:
    return RunMarker(site, Sayer("rampe_guard.test"))


def written(site: Site) -> Any:
    path = model_folder(site) / NAME
    return json.loads(path.read_bytes()) if path.exists() else None


def alert(**changes: Any) -> wire.Alert:
    base = {"alert_id": "a1", "source": "contact", "zone": "wall", "link": "bucket"}
    return msgspec.structs.replace(ALERT, **{**base, "state": "unacked", **changes})


def cut_off(site: Site, *alerts: wire.Alert) -> None:
    """A run that is never left: its process died."""
    run = marker(site).__enter__()
    for one in alerts:
        run.note(one)
    wanted = msgspec.to_builtins(msgspec.structs.replace(run._now, unseen=run._unseen()))
    wanted["unseen"] = list(wanted["unseen"])
    until(lambda: written(site) == wanted, 5.0, "written")
    assert run._file is not None
    run._file.release()  # as the kernel does


def test_a_clean_end_leaves_nothing(site: Site) -> None:
    with marker(site) as run:
        until(lambda: written(site) is not None, 5.0, "there")
        assert run.after(None) is None
        run.clean = True
    assert written(site) is None
    with marker(site) as again:
        assert again.after(None) is None


def test_what_was_cut_off_is_told_unless_the_supervisor_knows_better(site: Site) -> None:
    cut_off(site)
    with marker(site) as run:
        assert run.after(None) == "a kill"
        assert run.after("a crash (SIGSEGV)") == "a crash (SIGSEGV)"


def test_another_start_of_the_computer_is_a_power_loss(
    site: Site, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    cut_off(site)
    other = tmp_path / "boot_id"
    other.write_text("another\n", encoding="ascii")
    monkeypatch.setattr(run_marker, "_COMPUTER", other)
    with marker(site) as run:
        assert run.after(None) == "a power loss or reboot"


def test_a_contact_that_nobody_has_seen_survives_and_is_told_until_somebody_has(
    site: Site,
) -> None:
    cut_off(site, alert(), alert(alert_id="a2", zone="truck"), alert(level="clear"))
    cut_off(site, alert(alert_id="b1", source="system", level="caution", zone=None))
    with marker(site) as run:  # twice cut off, and nobody there
        assert run.after(None) == "a kill; unseen: bucket at wall, bucket at truck"
        run.note(alert(alert_id="c1", source="system", state="acked", level="caution", zone=None))
        assert run.after(None) == "a kill"
        run.clean = True
    assert written(site) is None


def test_what_nobody_has_seen_outlives_a_clean_end_too(site: Site) -> None:
    with marker(site) as run:
        run.note(alert(source="contact"))
        run.note(alert(source="stopping", state="rtn_unacked", level="clear"))  # it was a contact
        run.clean = True
    assert written(site)["clean"] is True
    with marker(site) as run:
        assert run.after(None) == "a stop; unseen: bucket at wall"


def test_what_was_acknowledged_or_goes_by_itself_is_not_kept(site: Site) -> None:
    with marker(site) as run:
        run.note(alert())
        run.note(alert(state="acked"))
        run.note(alert(alert_id="a2", source="intent"))
        assert run._unseen() == ()
        run.note(alert(alert_id="s", source="system", level="warning", zone=None))
        assert run._unseen() == ("not monitoring",)


@pytest.mark.parametrize(
    "content", [b"", b"{", b'{"clean": 1}', b"\xff" * 100, b"[]", b"x" * 70000]
)
def test_a_file_that_cannot_be_read_is_an_end_of_which_nothing_is_known(
    site: Site, content: bytes
) -> None:
    folder = model_folder(site)
    folder.mkdir(parents=True)
    (folder / NAME).write_bytes(content)
    with marker(site) as run:
        assert run.after(None) == "an end of which nothing is known"
        assert run.reasons() == ()
        run.clean = True
    assert written(site) is None


def test_a_field_of_a_later_version_does_no_harm(site: Site) -> None:
    folder = model_folder(site)
    folder.mkdir(parents=True)
    later = {"clean": False, "started_unix_s": 1.0, "unseen": ["bucket at wall"], "mood": "good"}
    (folder / NAME).write_text(json.dumps(later), encoding="utf-8")
    with marker(site) as run:
        assert run.after(None) == "a kill; unseen: bucket at wall"


def test_machines_of_one_state_folder_do_not_mix(site: Site) -> None:
    cut_off(site, alert())
    with marker(replace(site, machine="other")) as run:
        assert run.after(None) is None


def test_a_folder_that_cannot_be_written_stops_nothing_and_is_said(site: Site) -> None:
    folder = model_folder(site)
    folder.parent.mkdir(parents=True)
    folder.write_text("no folder", encoding="utf-8")
    with marker(site) as run:
        run.note(alert())
        (reason,) = run.reasons()
        assert reason.code == "alerts_not_kept"
        run.clean = True


def test_a_second_guard_of_the_machine_does_not_touch_the_first_ones(site: Site) -> None:
    with marker(site) as first:
        first.note(alert())
        until(lambda: (written(site) or {}).get("unseen"), 5.0, "written")
        with marker(site) as second:
            assert [r.code for r in second.reasons()] == ["alerts_not_kept"]
            second.clean = True
        assert written(site)["unseen"] == ["bucket at wall"]


def test_however_many_there_are_the_file_stays_small(site: Site) -> None:
    with marker(site) as run:
        for number in range(500):
            run.note(alert(alert_id=str(number), zone=f"zone {number}"))
        run.clean = True
    assert len(written(site)["unseen"]) == 20
    assert written(site)["unseen"][-1] == "bucket at zone 499"
    assert (model_folder(site) / NAME).stat().st_mode & 0o777 == 0o600
