"""Pieces of the dashboard that need no page: places, words, shapes, lead times, HTML."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from rampe_guard.client.items import Protection, ProtectionLost, alert_from
from rampe_guard.core.scene import Box, Capsule, Cylinder, Halfspace, Sphere
from rampe_guard.dashboard import markup
from rampe_guard.dashboard.feed import Feed
from rampe_guard.dashboard.happenings import KEPT_EVENTS, Leads, with_items
from rampe_guard.dashboard.picture import Banner, Bar, Card, Event
from rampe_guard.dashboard.places import Places
from rampe_guard.dashboard.solids import Triangles, solids
from rampe_guard.dashboard.tones import BY_LEVEL, Tone
from rampe_guard.errors import SettingsError
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import ZenohSettings, load_site
from tests.support.messages import ALERT
from tests.support.processes import BENCH, until

AT = np.array([[1.0, 0, 0, 2.0], [0, 1, 0, 3.0], [0, 0, 1, 4.0], [0, 0, 0, 1]])


@given(st.lists(st.lists(st.sampled_from("abcdefgh"), unique=True, max_size=7), max_size=12))
def test_an_alert_keeps_its_place_and_the_gravest_always_has_one(days: list[list[str]]) -> None:
    places = Places(3)
    before: tuple[str | None, ...] = (None,) * 3
    for wanted in days:
        seats = places.seat(wanted)
        taken = [s for s in seats if s is not None]
        assert len(set(taken)) == len(taken) == min(3, len(wanted))
        assert set(taken) <= set(wanted)
        if wanted:
            assert wanted[0] in seats
        pushed = 0
        for place, who in enumerate(before):
            if who is not None and who in wanted and seats[place] != who:
                assert seats[place] == wanted[0]  # only the gravest may take a place
                assert who not in seats
                pushed += 1
        assert pushed <= 1
        before = seats


def test_levels_differ_in_shape_word_and_pulse_and_none_is_green() -> None:
    looks = [tone.look for tone in (*BY_LEVEL.values(), Tone.LOST, Tone.OFF)]
    assert len({look.shape for look in looks}) == len(looks)
    assert len({look.word for look in looks}) == len(looks)
    assert len({look.name for look in looks}) == len(looks)
    for look in looks:
        for red, green, blue in (look.lit, look.dim):
            assert not (green > 1.15 * red and green > 1.15 * blue)
    assert Tone.IMMINENT.look.pulse_hz > Tone.WARNING.look.pulse_hz > Tone.CAUTION.look.pulse_hz


def test_a_pulse_goes_on_and_off_until_somebody_has_seen_it() -> None:
    times = np.arange(0.0, 2.0, 0.01)
    shown = [Tone.IMMINENT.lit(float(t), attention=True) for t in times]
    changes = sum(a != b for a, b in itertools.pairwise(shown))
    assert changes == pytest.approx(16, abs=1)  # 4 Hz for 2 s
    assert all(Tone.IMMINENT.lit(float(t), attention=False) for t in times)
    assert all(Tone.CAUTION.lit(float(t), attention=True) for t in times)


def test_what_ends_the_thread_of_a_feed_ends_the_dashboard() -> None:
    """Else its page would show for ever that it is connecting."""
    site = load_site(BENCH)
    feed = Feed(replace(site, zenoh=ZenohSettings(None, "client", ("foo",))), StopFlag())
    feed.start()

    def ended() -> bool:
        try:
            feed.poll(time.monotonic())
        except SettingsError as error:
            return "foo" in str(error)
        return False

    until(ended, 5.0, "the end told")


def extent(body: Triangles) -> tuple[list[float], list[float]]:
    return body.vertices.min(axis=0).tolist(), body.vertices.max(axis=0).tolist()


@pytest.mark.parametrize(
    ("item", "low", "high"),
    [
        (Box(name="x", margin_m=0.5, size_m=(2, 4, 6), pose=AT), (1, 1, 1), (3, 5, 7)),
        (Sphere(name="x", margin_m=0.5, radius_m=1.0, center_m=(1, 2, 3)), (0, 1, 2), (2, 3, 4)),
        (
            Cylinder(name="x", margin_m=0.5, radius_m=1.0, height_m=4.0, pose=AT),
            (1, 2, 2),
            (3, 4, 6),
        ),
        (
            Capsule(name="x", margin_m=0.5, radius_m=0.5, start_m=(0, 0, 0), end_m=(4, 0, 0)),
            (-0.5, -0.5, -0.5),
            (4.5, 0.5, 0.5),
        ),
    ],
)
def test_a_body_is_the_object_and_its_shell_the_margin(
    item: Box, low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    (solid,) = solids((item,), 10.0)
    assert solid.shell is not None
    for body, by in ((solid.body, 0.0), (solid.shell, 0.5)):
        least, most = extent(body)
        np.testing.assert_allclose(least, np.array(low) - by, atol=0.02)
        np.testing.assert_allclose(most, np.array(high) + by, atol=0.02)
    assert solid.top[2] == pytest.approx(high[2], abs=0.02)


def test_a_halfspace_is_a_plate_with_its_face_where_it_is_said() -> None:
    ceiling = Halfspace(name="x", margin_m=0.5, normal=(0.0, 0.0, -1.0), offset_m=-3.0)
    (solid,) = solids((ceiling,), 10.0)
    least, most = extent(solid.body)
    assert least[2] == pytest.approx(3.0)  # solid above
    assert most[2] == pytest.approx(3.04)
    assert most[0] - least[0] == pytest.approx(20.0)
    assert solid.shell is None
    assert solid.sheer


def test_lead_time_is_from_the_first_warning_to_the_entry() -> None:
    leads = Leads()
    for level, source, at_s in (
        ("caution", "intent", 10.0),
        ("warning", "intent", 10.5),
        ("imminent", "stopping", 11.0),
        ("imminent", "contact", 11.75),
        ("imminent", "contact", 11.95),
    ):
        alert = structs.replace(ALERT, level=level, source=source, published_unix_s=at_s)
        leads = leads.take(alert)
    assert leads.lines == ("wall: 1.25 s ahead",)
    surprise = structs.replace(ALERT, alert_id="b", level="imminent", source="contact")
    assert leads.take(surprise).lines[0] == "wall: entered without a warning"


def test_what_happens_is_said_once_and_old_news_go() -> None:
    raised = alert_from(ALERT, "base", 1.0)
    events = with_items((), (raised, raised), 1.0)
    assert [e.text for e in events] == [ALERT.text]
    assert events[0].tone is Tone.WARNING
    lost = ProtectionLost(
        base="base", site="s", machine="m", protection=Protection.UNAVAILABLE, level="warning",
        text="PROTECTION UNAVAILABLE: no heartbeat",
    )  # fmt: skip
    assert with_items(events, (lost,), 2.0)[0].tone is Tone.LOST
    for number in range(2 * KEPT_EVENTS):
        events = with_items(events, (structs.replace(raised, text=f"{number}"),), 3.0)
    assert len(events) == KEPT_EVENTS
    for state, said in (
        ({"state": "acked", "acked_by": "anna"}, "wall: acknowledged by anna"),
        ({"state": "rtn_unacked", "level": "clear"}, "wall: over, nobody has acknowledged it"),
        ({"state": "normal", "level": "clear"}, "wall: over"),
        ({"inhibit": "shelved", "shelved_by": "bo"}, "wall: shelved by bo"),
    ):
        item = structs.replace(raised, **state)
        assert with_items((), (item,), 4.0)[0].text == said


EVIL = '<script>alert("x")</script>&'


def test_every_word_is_escaped() -> None:
    banner = Banner(Tone.LOST, EVIL, EVIL, EVIL, EVIL)
    card = Card("id", Tone.WARNING, EVIL, EVIL, EVIL, flash=True, can_ack=True, can_shelve=True,
                shelved=False)  # fmt: skip
    for html in (markup.banner(banner), markup.card(card)):
        assert "<script" not in html
        assert "&lt;script&gt;" in html
    bar = Bar(EVIL, 0.5, 0.7, 0.6, 0.8, ((0.0, 0.1, Tone.CALM),), EVIL, EVIL, EVIL)
    event = Event(1.0, Tone.CALM, EVIL)
    words = SimpleNamespace(  # a picture of words alone

        machine=EVIL, site=EVIL, bars=(bar,), basis=EVIL, events=(event,), leads=(EVIL,),
        footer=EVIL, limits=(), zones=(), intent=None, stopping=None,
    )  # fmt: skip
    pieces = (markup.head, markup.actuators, markup.footer)
    for html in (*(piece(words) for piece in pieces), markup.happenings(words, 0.0)):  # type: ignore[arg-type]
        assert "<script" not in html
        assert "&lt;script&gt;" in html


def test_the_words_of_a_lost_page_are_hidden_only_while_it_is_told_anew() -> None:
    assert markup.alive(1) != markup.alive(2)  # else the browser would not begin anew
    css = markup.style()
    assert "visibility: hidden; animation: rg-gone 0s linear 1.2s forwards" in css
    assert "http" not in css  # nothing from elsewhere


def test_the_frame_stands_only_without_protection() -> None:
    assert "rg-frame" in markup.banner(Banner(Tone.LOST, "NOT MONITORING", "x"))
    assert "rg-frame" not in markup.banner(Banner(Tone.IMMINENT, "IMMINENT", "x"))
