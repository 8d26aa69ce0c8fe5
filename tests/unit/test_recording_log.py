"""Recordings as logs: the steps, samples and refusals that the guard had, for other sites too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.types import Inputs
from rampe_guard.errors import LogError, SettingsError
from rampe_guard.programs.recording import Wishes, record
from rampe_guard.programs.replaying import replay_offline
from rampe_guard.programs.replaying_live import replay_live
from rampe_guard.recording import McapLog, McapReading, is_mcap, open_log
from rampe_guard.recording.compare import changes, compare
from rampe_guard.recording.recorded_site import recorded_site
from rampe_guard.recording.writer import METADATA, Entry, Head
from rampe_guard.runtime.replay import IDLE_STEP_S
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import Site, load_site
from tests.support.recording_files import START_NS, entry, head_of, small_site, write

LIMITS = np.array([[-2.0, 2.0]])


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return small_site(tmp_path)


def opened(site: Site, path: Path, *entries: Entry, other: Site | None = None) -> McapLog:
    log = open_log(other or site, write(site, path / "log.mcap", [list(entries)]), LIMITS)
    assert isinstance(log, McapLog)
    return log


def came(log: McapLog) -> list[tuple[float, Inputs]]:
    """Steps for which something arrived."""
    return [(t, i) for t, i in log.steps() if replace(i, joystick_alive=None) != Inputs()]


def test_what_came_together_is_one_step_and_gaps_have_idle_ones(site: Site, tmp_path: Path) -> None:
    log = opened(
        site,
        tmp_path,
        entry(site, 0.0, "heartbeat", {}),
        entry(site, 0.2, "joystick", {"stamp": 7.0, "axes": [0.5]}),
        entry(site, 0.2, "actuators", {"stamp": 7.0, "position": [0.1], "velocity": [0.3]}),
        entry(site, 0.4, "actuators", {"position": [0.2]}),
        entry(site, 1.0, "heartbeat", {}),
    )
    assert (log.first_s, log.last_s, log.epoch_s) == (0.0, 1.0, START_NS / 1e9)
    (first_s, first), (second_s, second) = came(log)
    assert (first_s, second_s) == (0.2, 0.4)
    assert (first.joystick[0].stamp_s, first.joystick[0].arrival_s) == (7.0, 0.2)
    assert first.joystick[0].axes.tolist() == [0.5]
    assert first.actuators[0].velocity is not None
    assert first.actuators[0].velocity.tolist() == [0.3]
    assert second.actuators[0].stamp_s == 0.4  # without a stamp the arrival counts
    times = [t for t, _ in log.steps()]
    assert times == sorted(set(times))
    assert times[0] == IDLE_STEP_S
    assert 0.95 <= times[-1] < 1.0  # silence up to the last word of the guard
    assert max(np.diff(times)) <= IDLE_STEP_S + 1e-9


def test_what_the_intake_refuses_is_refused_in_replay_by_the_same_word(
    site: Site, tmp_path: Path
) -> None:
    log = opened(
        site,
        tmp_path,
        entry(site, 0.0, "joystick", b"{"),
        entry(site, 0.1, "joystick", {"axes": []}),
        entry(site, 0.2, "joystick", {"axes": [0.0]}, key="r/*"),
        entry(site, 0.3, "actuators", b'{"position": [NaN]}'),
        entry(site, 0.4, "object", {"xyz_m": [0, 0, 0]}),
        entry(site, 0.5, "enabled", {"enabled": "yes"}),
    )
    assert [i.rejected + i.objects_rejected for _, i in came(log)] == [
        (("joystick", "bad_json"),),
        (("joystick", "wrong_length"),),
        (("joystick", "wildcard_key"),),
        (("actuators", "not_finite"),),
        (("truck", "bad_rotation"),),
        (("enabled", "bad_json"),),
    ]
    assert [key for _, key, _ in log.posts()].count("r/joystick") == 2  # and none on a wildcard


def test_poses_key_and_token_are_replayed(site: Site, tmp_path: Path) -> None:
    pose = {"stamp": 1.0, "xyz_m": [1, 2, 3], "rpy_rad": [0, 0, 0]}
    log = opened(
        site,
        tmp_path,
        entry(site, 0.0, "joystick_alive", {"alive": True}),
        entry(site, 0.1, "object", pose),
        entry(site, 0.2, "enabled", {"enabled": False, "stamp": 1.0}),
        entry(site, 0.3, "joystick_alive", {"alive": False}),
        entry(site, 0.4, "heartbeat", {}),
    )
    assert log.objects == {"truck"}
    (_, placed), (_, off) = came(log)
    assert placed.objects[0].pose[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert (off.enabled[0].enabled, off.enabled[0].stamp_s) == (False, 1.0)
    alive = [i.joystick_alive for t, i in log.steps() if t < 0.3]
    assert all(alive)
    assert [i.joystick_alive for t, i in log.steps() if t >= 0.3].count(False) > 1


def moves(site: Site) -> list[Entry]:
    found = []
    for k in range(20):
        found.append(
            entry(site, 0.1 * k, "actuators", {"stamp": 5 + 0.1 * k, "position": [k / 50]})
        )
        if k >= 5:
            axes = {"stamp": 5 + 0.1 * k, "axes": [k / 20]}
            found.append(entry(site, 0.1 * k + 0.01, "joystick", axes))
    found.append(entry(site, 2.0, "actuators", {"stamp": 7.0, "position": [1.9]}))  # a jump
    # three that came at once after a hiccup of the network
    found += [
        entry(site, 2.3, "actuators", {"stamp": 5 + 0.1 * k, "position": [k / 50]})
        for k in (21, 22, 23)
    ]
    return found


def test_positions_are_those_that_the_gate_accepts(site: Site, tmp_path: Path) -> None:
    log = opened(site, tmp_path, *moves(site))
    times, places = zip(*log.positions(), strict=True)
    assert [p[0] for p in places] == [k / 50 for k in (*range(20), 21, 22, 23)]
    assert times == pytest.approx([*(0.1 * k for k in range(20)), 2.1, 2.2, 2.3])
    # rows: positions for which a lever is known, with the last lever before them
    assert log.time_s.tolist() == pytest.approx([*(0.1 * k for k in range(6, 20)), 2.1, 2.2, 2.3])
    assert log.axes[:, 0].tolist() == [*((k - 1) / 20 for k in range(6, 20)), *3 * (19 / 20,)]
    assert len(list(log.samples())) == len(log.position) == len(log.time_s)


def test_another_site_sees_its_own_keys(site: Site, tmp_path: Path) -> None:
    text = Path(site.path).read_text("utf-8").replace(" r/", " other/")
    (tmp_path / "other.yaml").write_text(text, "utf-8")
    other = load_site(tmp_path / "other.yaml")
    log = opened(site, tmp_path, *moves(site), other=other)
    assert len(list(log.positions())) == 23
    assert {key for _, key, _ in log.posts()} == {"other/joystick", "other/actuators"}


def test_an_object_is_known_by_its_name_where_its_key_is_another(
    site: Site, tmp_path: Path
) -> None:
    pose = entry(site, 0.5, "object", {"xyz_m": [1, 2, 3], "rpy_rad": [0, 0, 0]})
    scene = Path(site.scene.path)
    scene.write_text(scene.read_text("utf-8").replace("key: r/truck", "key: r/lorry"), "utf-8")
    log = opened(site, tmp_path, pose, other=load_site(site.path))
    assert log.objects == {"truck"}
    (_, placed), *_ = came(log)
    assert placed.objects[0].name == "truck"
    assert placed.objects_rejected == ()


def test_a_recording_of_something_else_is_told(site: Site, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"none of its topics is an input of .*r/guard/alert"):
        opened(site, tmp_path, entry(site, 0.0, "alert", {}))


def test_half_a_recording_warns(site: Site, tmp_path: Path) -> None:
    log = opened(site, tmp_path, entry(site, 0.0, "actuators", {"position": [0.0]}))
    assert any("no message of the joystick" in warning for warning in log.warnings)
    with pytest.raises(LogError, match="no position for which a lever is known"):
        log.axes  # noqa: B018 - computed when asked for


def test_the_site_comes_out_of_the_recording(site: Site, tmp_path: Path) -> None:
    path = write(site, tmp_path / "log.mcap", [moves(site)])
    assert is_mcap(path)
    with recorded_site(McapReading(path)) as found:
        folder = Path(found.path).parent
        assert (found.guard, found.keys) == (site.guard, site.keys)
        assert found.content_hash == site.content_hash
        assert folder != tmp_path
    assert not folder.exists()


def test_a_recording_without_a_site_is_told(site: Site, tmp_path: Path) -> None:
    bare = McapReading(write(site, tmp_path / "a.mcap", [moves(site)], Head({}, {})))
    with pytest.raises(LogError, match="has no site file in it"), recorded_site(bare):
        pass
    head = head_of(site)
    words = {METADATA: {**head.metadata[METADATA], "site_file": "files/../../site.yaml"}}
    files = {"files/../../site.yaml": b"", **head.attachments}
    evil = McapReading(write(site, tmp_path / "b.mcap", [moves(site)], Head(words, files)))
    with pytest.raises(LogError, match="refused"), recorded_site(evil):
        pass
    words[METADATA]["absolute"] = "[1]"
    odd = McapReading(write(site, tmp_path / "c.mcap", [moves(site)], Head(words, files)))
    with pytest.raises(LogError, match="absolute"), recorded_site(odd):
        pass


def test_alerts_are_compared_in_order_and_by_time() -> None:
    live = [
        (1.0, "a", "warning"),
        (1.2, "a", "warning"),
        (1.5, "a", "clear"),
        (9.0, None, "caution"),
    ]
    replayed = [
        (1.1, "a", "warning"),
        (1.45, "a", "clear"),
        (3.0, "a", "warning"),
        (3.1, "b", "clear"),
    ]
    zone_a, system = compare(changes(live), changes(replayed))
    assert (zone_a.zone, zone_a.same, zone_a.only_live) == ("a", 2, ())
    assert zone_a.only_replay == ((3.0, "warning"),)
    assert zone_a.apart_s == pytest.approx((0.1, -0.05))
    assert (system.zone, system.only_live) == ("system", ((9.0, "caution"),))


def test_what_cannot_be_is_told(site: Site, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,u,q\n0,0,0\n")
    csv, log = str(tmp_path / "log.csv"), str(write(site, tmp_path / "a.mcap", [moves(site)]))
    stop = StopFlag()
    with pytest.raises(LogError, match="a CSV log has no site in it"):
        list(replay_offline(None, csv, stop, repeats=False))
    with pytest.raises(LogError, match=r"none\.mcap: cannot be read: No such file"):
        list(replay_offline(None, str(tmp_path / "none.mcap"), stop, repeats=False))
    with pytest.raises(SettingsError, match="Give --connect"):
        replay_live(None, log, [], 1.0, stop)
    wishes = Wishes(site.path, str(tmp_path / "no" / "a.mcap"), [], None, 1.0, 1.0, None)
    with pytest.raises(LogError, match=r"no/a\.mcap: cannot be written: No such file"):
        record(wishes, stop)
