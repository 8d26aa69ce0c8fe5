"""Many machines on one screen: real messages through the fleet, rendered to text."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest
from msgspec import structs
from rich.cells import cell_len

from rampe_guard import wire
from rampe_guard.client import fleet as core
from rampe_guard.client.fleet import Fleet
from rampe_guard.client.items import Item, Protection
from rampe_guard.view.marks import HATCH
from rampe_guard.view.tell import json_line, words, worth_a_line
from rampe_guard.view.wall import Wall, fitted
from rampe_guard.view.wall_screen import render_wall
from tests.support.messages import ALERT, HEARTBEAT, SILENT_JOYSTICK, STATE
from tests.support.rendered import line_of, shown

NOW = 100.0
LINES = Path(__file__).resolve().parents[2] / "config/contract/rampe.watch_line.v1.schema.json"


def clocks(now_s: float) -> dict[str, float]:
    """Of a guard whose messages take no time."""
    return {"uptime_s": now_s, "published_unix_s": ALERT.published_unix_s + now_s - NOW}


class Scene:
    """Guards that are heard, and the wall that shows them."""

    def __init__(self) -> None:
        self.fleet = Fleet()
        self.items: list[Item] = []
        self._seq: Counter[str] = Counter()

    def beat(self, machine: str, now_s: float = NOW, site: str = "north", **change: Any) -> None:
        base = f"rampe/{site}/{machine}/guard"
        seq = self._next(f"{base}/heartbeat")
        change = {**clocks(now_s), **change}
        beat = structs.replace(HEARTBEAT, machine=machine, site=site, seq=seq, **change)
        self._took(core.on_heartbeat(self.fleet, base, beat, now_s))
        if not self.fleet.machines[base].told_all:
            state = structs.replace(STATE, heartbeat=beat, alerts=())
            self._took(core.on_state(self.fleet, base, state, now_s, float("-inf")))

    def alert(self, machine: str, now_s: float = NOW, site: str = "north", **change: Any) -> None:
        base = f"rampe/{site}/{machine}/guard"
        seq = self._next(f"{base}/alert")
        change = {**clocks(now_s), "alert_id": change.get("zone", "wall"), **change}
        alert = structs.replace(ALERT, machine=machine, site=site, seq=seq, **change)
        self._took(core.on_alert(self.fleet, base, alert, now_s))

    def lose(self, machine: str) -> None:
        """An alert does not arrive."""
        self._next(f"rampe/north/{machine}/guard/alert")

    def _next(self, key: str) -> int:
        self._seq[key] += 1
        return self._seq[key]

    def later(self, now_s: float) -> None:
        self._took(core.at(self.fleet, now_s))

    def wall(self, now_s: float = NOW, **change: Any) -> Wall:
        wall = Wall(now_s, asked=("rampe/*/*/guard",), **change)
        problems: tuple[str, ...] = ()
        wall = wall.look(self.fleet.machines.values(), problems, now_s, "12:34:56")
        return wall.hear(self.items, now_s)

    def screen(self, width: int = 80, height: int = 24, now_s: float = NOW) -> str:
        return shown(render_wall(self.wall(now_s), width, height), width)

    def _took(self, told: core.Told) -> None:
        self.fleet, items = told
        self.items += items


def row_of(text: str, machine: str) -> str:
    """The line of a machine, whatever its style."""
    lines = text.splitlines()
    return next(
        line for line in lines if re.sub(r"^(\x1b\[[\d;]*m)*", "", line).startswith(machine)
    )


def lost(scene: Scene, machine: str) -> None:
    scene.beat(machine, status="not_monitoring", reasons=(SILENT_JOYSTICK,))


@pytest.fixture
def scene() -> Scene:
    """Four machines: calm, with alerts, degraded, and not monitoring."""
    made = Scene()
    for machine in ("crane-2", "digger-1", "loader-4"):
        made.beat(machine)
    made.beat("loader-4", status="degraded", reasons=(wire.Reason(code="x", text="two refused"),))
    lost(made, "mixer-9")
    made.alert("digger-1", zone="wall", text="bucket → wall in 1.4 s")
    made.alert(
        "digger-1",
        zone="silo",
        level="imminent",
        source="stopping",
        time_to_collision_s=0.48,
        text="bucket → silo in 0.4 s",
    )
    return made


@pytest.mark.parametrize(("width", "height"), [(80, 24), (80, 12), (120, 40), (200, 60), (60, 8)])
@pytest.mark.parametrize("machines", [0, 1, 4, 40])
def test_everything_fits_the_terminal(width: int, height: int, machines: int) -> None:
    scene = Scene()
    for number in range(machines):
        scene.beat(f"excavator-with-a-long-name-{number}", site="電" * 40)
        for zone in ("wall", "a-zone-with-a-very-long-name-" * 3):
            scene.alert(f"excavator-with-a-long-name-{number}", site="電" * 40, zone=zone)
    lines = scene.screen(width, height).splitlines()
    assert len(lines) <= height
    assert all(cell_len(line) <= width for line in lines)


def test_a_line_tells_protection_gravest_alert_inputs_and_heartbeat(scene: Scene) -> None:
    row = row_of(scene.screen(), "digger-1")
    for part in ("monitoring", "■ IMMINENT", "bucket → silo in 0.4 s", "10 ms", "0.0 s"):
        assert part in row
    assert "two refused" in row_of(scene.screen(), "loader-4")
    assert "· no alert" in row_of(scene.screen(), "crane-2")


def test_active_alerts_expand_below_their_machine_the_gravest_first(scene: Scene) -> None:
    lines = scene.screen().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("digger-1"))
    assert "■ IMMINENT" in lines[at + 1]
    assert "bucket → silo" in lines[at + 1]
    assert "△ WARNING" in lines[at + 2]
    assert "83%" in lines[at + 2]
    assert lines[at + 3].startswith("loader-4")


def test_not_monitoring_has_a_hatched_banner_and_a_row_of_its_own_colour(scene: Scene) -> None:
    wall = render_wall(scene.wall(), 80, 24)
    text = shown(wall)
    banner = text.splitlines()[1]
    assert "NOT PROTECTED: mixer-9" in banner
    assert banner.count(HATCH) > 20
    row = row_of(shown(wall, styles=True), "mixer-9")
    assert row.count("48;2;139;0;139") > 3  # all across, not only a word
    assert "✕ NOT MONITORING no joystick for 1.2 s" in row_of(text, "mixer-9")
    assert "no alert" not in row_of(text, "mixer-9")


def test_a_guard_that_fell_silent_is_unavailable_and_its_alerts_are_stale(scene: Scene) -> None:
    scene.later(NOW + 1.2)
    text = scene.screen(now_s=NOW + 1.2)
    assert "✕ UNAVAILABLE" in row_of(text, "digger-1")
    assert "no heartbeat for 1.2 s" in row_of(text, "digger-1")
    assert "STALE" in line_of(text, "bucket → silo  ")
    assert "NOT PROTECTED: crane-2, digger-1, loader-4, mixer-9" in text
    assert "monitoring" not in row_of(text, "crane-2")


def test_nothing_heard_is_not_calm() -> None:
    text = Scene().screen()
    assert "no guard was heard on rampe/*/*/guard" in text
    assert "0 machines" in text


def test_nothing_is_ever_green_and_calm_has_no_colour(scene: Scene) -> None:
    codes = re.findall(r"\x1b\[([\d;]*)m", shown(render_wall(scene.wall(), 80, 24), styles=True))
    assert not any(code.split(";")[-1] in {"32", "92", "42", "102"} for code in codes)
    calm = Scene()
    calm.beat("crane-2")
    text = shown(render_wall(calm.wall(), 80, 24), styles=True)
    assert "48;2" not in text
    assert "[33m" not in text


def test_a_shelved_alert_and_a_machine_that_is_off_are_grey_and_say_so() -> None:
    scene = Scene()
    off = wire.Reason(code="machine_off", text="the machine is switched off")
    scene.beat("crane-2", status="not_monitoring", reasons=(off,))
    scene.beat("digger-1")
    unix_s = ALERT.published_unix_s
    scene.alert("digger-1", inhibit="shelved", shelved_by="ann", shelved_until_unix_s=unix_s + 12.0)
    text = scene.screen()
    assert "○ machine off" in row_of(text, "crane-2")
    assert "NOT PROTECTED" not in text
    assert "shelved by ann, 12 s left" in text
    assert "WARNING" not in row_of(text, "digger-1")  # nobody is to be troubled


def test_one_who_saw_that_it_does_not_monitor_stops_the_flashing() -> None:
    scene = Scene()
    lost(scene, "mixer-9")
    system: dict[str, Any] = {
        "zone": None,
        "source": "system",
        "alert_id": "s",
        "text": "NOT MONITORING: x",
    }
    scene.alert("mixer-9", **system)

    def banners() -> set[str]:
        times = (NOW, NOW + 0.25, NOW + 0.5, NOW + 0.75)
        return {
            shown(render_wall(scene.wall(t), 80, 24), styles=True).split("\n")[1] for t in times
        }

    assert len(banners()) == 2
    scene.alert("mixer-9", **system, state="acked", acked_by="bob")
    assert len(banners()) == 1
    assert "seen by bob" in row_of(scene.screen(), "mixer-9")


def test_what_does_not_fit_is_counted_and_trouble_is_never_hidden() -> None:
    scene = Scene()
    for number in range(30):
        scene.beat(f"crane-{number:02}")
    lost(scene, "zz-last")
    scene.alert("crane-29", level="imminent", text="bucket → silo now")
    text = scene.screen(80, 14)
    assert "✕ NOT MONITORING" in row_of(text, "zz-last")
    assert "bucket → silo now" in row_of(text, "crane-29")
    hidden = line_of(text, "more do not fit")
    assert "monitoring; no alerts" in hidden
    rows = sum(bool(re.match(r"(crane|zz)-", line)) for line in text.splitlines())
    assert rows + int(hidden.split()[1]) == 31


def test_machines_come_before_details_and_details_of_the_gravest_first(scene: Scene) -> None:
    scene.alert("crane-2", zone="pole", level="caution")
    rows = scene.wall().rows
    assert [d for _, d in fitted(rows, 20).rows] == [1, 2, 0, 0]
    assert [d for _, d in fitted(rows, 6).rows] == [0, 2, 0, 0]
    assert [d for _, d in fitted(rows, 4).rows] == [0, 0, 0, 0]
    tight = fitted(rows, 3)
    assert [row.name for row, _ in tight.rows] == ["digger-1", "mixer-9"]
    assert len(tight.hidden) == 2


def test_a_name_says_the_site_only_where_it_must() -> None:
    scene = Scene()
    scene.beat("crane-2")
    scene.beat("digger-1", site="south")
    assert "south" not in scene.screen()
    assert "digger-1 · south" in scene.screen(140)
    scene.beat("crane-2", site="south")
    wall = scene.wall().look(scene.fleet.machines.values(), (), NOW, "")
    assert [row.name for row in wall.rows] == ["crane-2 · north", "crane-2 · south", "digger-1"]


def test_a_machine_that_was_never_heard_has_the_name_of_its_site_file() -> None:
    base = "rampe/north/crane-2/guard"
    fleet, items = core.expect(Fleet(), base, NOW)
    wall = Wall(NOW, names={base: ("crane-2", "north")})
    wall = wall.look(fleet.machines.values(), (), NOW, "").hear(items, NOW)
    text = shown(render_wall(wall, 80, 24))
    assert "✕ UNAVAILABLE" in row_of(text, "crane-2")
    assert "crane-2: PROTECTION UNAVAILABLE: no guard was heard" in text


def test_a_network_that_cannot_be_heard_is_named() -> None:
    wall = Wall(NOW).look((), ("no Zenoh router at tcp/10.0.0.1:7447",), NOW, "")
    assert "△ no Zenoh router at tcp/10.0.0.1:7447" in shown(render_wall(wall, 80, 24))


def test_not_monitoring_is_one_line_for_people_and_both_for_scripts() -> None:
    scene = Scene()
    scene.beat("crane-2")
    lost(scene, "crane-2")
    system: dict[str, Any] = {
        "zone": None,
        "source": "system",
        "alert_id": "s",
        "text": "NOT MONITORING: x",
    }
    scene.alert("crane-2", **system)
    said = [words(item) for item in scene.items if worth_a_line(item)]
    assert said == ["monitoring", "NOT MONITORING: no joystick for 1.2 s"]
    assert len(scene.items) == 3
    scene.alert("crane-2", **{**system, "alert_id": "r", "level": "caution"})
    assert worth_a_line(scene.items[-1])


def test_words_say_who_has_done_what() -> None:
    scene = Scene()
    scene.beat("crane-2")
    scene.alert("crane-2", inhibit="shelved", shelved_by="ann")
    scene.alert("crane-2", state="acked", acked_by="bob")
    scene.alert("crane-2", state="rtn_unacked", level="clear", text="wall clear")
    assert [words(item).partition("(")[2] for item in scene.items[1:]] == [
        "shelved by ann)",
        "seen by bob)",
        "please acknowledge)",
    ]


def test_every_kind_of_line_is_as_its_schema_says(scene: Scene) -> None:
    validator = jsonschema.Draft202012Validator(json.loads(LINES.read_text("utf-8")))
    scene.later(NOW + 2.0)
    scene.beat("crane-2", NOW + 2.1, boot_id="boot-2")
    scene.lose("digger-1")
    scene.alert("digger-1", NOW + 2.1, zone="silo")
    events = set()
    for item in scene.items:
        line = json.loads(json_line(item, 1.7e9))
        validator.validate(line)
        assert line["told_unix_s"] == 1.7e9
        events.add(line["event"])
        with pytest.raises(jsonschema.ValidationError):
            validator.validate({k: v for k, v in line.items() if k != "told_unix_s"})
    assert events == {
        "alert",
        "protection_lost",
        "protection_back",
        "guard_restarted",
        "messages_lost",
    }
    assert Protection.UNAVAILABLE in {getattr(i, "protection", None) for i in scene.items}
