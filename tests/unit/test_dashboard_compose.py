"""What a page shows of a machine, without a page: the picture of what was heard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from rampe_guard import wire
from rampe_guard.client import fleet as fleets
from rampe_guard.client.contact import Contact
from rampe_guard.client.fleet import Fleet
from rampe_guard.client.machine import MachineState
from rampe_guard.core.scene import Box
from rampe_guard.dashboard.compose import compose, countdown
from rampe_guard.dashboard.ghosts import INTENT, STOPPING
from rampe_guard.dashboard.markup import side
from rampe_guard.dashboard.model import Model, load_model
from rampe_guard.dashboard.picture import Picture
from rampe_guard.dashboard.sight import Sight
from rampe_guard.dashboard.tones import Tone
from rampe_guard.settings import load_site
from tests.support.messages import ALERT, HEARTBEAT, SILENT_JOYSTICK, STATE, SWINGING
from tests.support.processes import BENCH

POSITION = np.array([1.0, 0.065, 0.08, 0.03])
STILL = np.zeros(4)
BASE = "rampe/bench/excavator/guard"
CRATE = structs.replace(
    ALERT,
    alert_id="boot-1.crate.1",
    zone="crate",
    level="imminent",
    contact_point_m=(0.4, 0.3, 0.1),
    text="bucket → crate in 1.4 s",
)


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(load_site(BENCH))


def guard(
    *alerts: wire.Alert, beat: wire.Heartbeat | None = HEARTBEAT, now_s: float = 100.0
) -> MachineState:
    """A guard that said all this just now."""
    fleet, _ = fleets.expect(Fleet(), BASE, now_s)
    if beat is not None:
        state = structs.replace(STATE, heartbeat=beat, alerts=())
        fleet, _ = fleets.on_state(fleet, BASE, state, now_s, now_s)
    for number, alert in enumerate(alerts):
        fleet, _ = fleets.on_alert(fleet, BASE, structs.replace(alert, seq=number + 1), now_s)
    return fleet.machines[BASE]


def sight(state: MachineState, now_s: float = 100.0) -> Sight:
    return Sight(
        state, now_s, position=POSITION, position_s=100.0, velocity=STILL, command=STILL,
        command_s=100.0,
    )  # fmt: skip


def zone(picture: Picture, name: str) -> Tone:
    return {z.name: z.tone for z in (*picture.zones, *picture.limits)}[name]


def test_nothing_raised_is_grey_and_says_that_it_is_watched(model: Model) -> None:
    picture = compose(model, sight(guard()))
    assert picture.banner.tone is Tone.CALM
    assert picture.banner.word == "monitoring"
    assert {z.tone for z in (*picture.zones, *picture.limits)} == {Tone.CALM}
    assert picture.links is not None
    assert picture.links.shape == (5, 4, 4)
    assert picture.intent is None
    assert picture.stopping is None
    assert not picture.lost


def test_an_alert_colours_banner_object_link_and_contact(model: Model) -> None:
    picture = compose(model, sight(guard(CRATE)))
    banner = picture.banner
    assert (banner.tone, banner.word, banner.flash) == (Tone.IMMINENT, "IMMINENT", True)
    assert (banner.text, banner.count) == ("bucket → crate", "1.4 s")
    assert zone(picture, "crate") is Tone.IMMINENT
    assert zone(picture, "ceiling") is Tone.CALM
    label = next(z.label for z in picture.zones if z.name == "crate")
    assert label == "■ IMMINENT crate 1.4 s"  # never by colour alone
    tones = dict(zip(model.arm.link_names, picture.link_tones, strict=True))
    assert tones.pop("bucket") is Tone.IMMINENT
    assert set(tones.values()) == {Tone.CALM}
    assert picture.contact is not None
    assert picture.contact.point == (0.4, 0.3, 0.1)


def test_the_gravest_is_told_and_the_others_are_counted(model: Model) -> None:
    limit = structs.replace(ALERT, alert_id="boot-1.slew.1", zone="slew-left", link=None)
    picture = compose(model, sight(guard(limit, CRATE)))
    assert picture.banner.text == "bucket → crate"
    assert picture.banner.detail == "1 more alert"
    assert [c.tone for c in picture.cards] == [Tone.IMMINENT, Tone.WARNING]
    assert zone(picture, "slew-left") is Tone.WARNING
    swing = picture.bars[0]
    assert Tone.WARNING in {tone for _, _, tone in swing.barred}


@pytest.mark.parametrize(
    ("beat", "now_s", "said"),
    [
        (None, 100.0, "no guard was heard"),
        (HEARTBEAT, 101.5, "no heartbeat for 1.5 s"),
        (
            structs.replace(HEARTBEAT, status="not_monitoring", reasons=(SILENT_JOYSTICK,)),
            100.0,
            "no joystick for 1.2 s",
        ),
    ],
)
def test_without_protection_nothing_looks_judged(
    model: Model, beat: wire.Heartbeat | None, now_s: float, said: str
) -> None:
    alerts = (CRATE,) if beat is not None else ()
    state = replace(guard(*alerts, beat=beat), now_s=now_s)
    seen = replace(sight(state, now_s), prediction=SWINGING, velocity=np.full(4, 0.3))
    picture = compose(model, seen)
    assert picture.lost
    assert picture.banner.tone is Tone.LOST
    assert picture.banner.word == "NOT MONITORING"
    assert picture.banner.flash
    assert said in picture.banner.text
    assert "Work as if there were none" in picture.banner.detail
    assert {z.tone for z in (*picture.zones, *picture.limits)} == {Tone.LOST}
    assert set(picture.link_tones) == {Tone.CALM}  # the stage greys a lost arm
    assert (picture.intent, picture.stopping, picture.contact) == (None, None, None)
    assert {b.there for b in picture.bars} == {None}
    assert {c.tone for c in picture.cards} <= {Tone.LOST}  # the last that was known stays listed
    assert len(picture.cards) == len(alerts)


def test_a_broken_line_is_no_protection_whatever_was_said_before(model: Model) -> None:
    picture = compose(model, replace(sight(guard()), trouble="no Zenoh router"))
    assert picture.banner.word == "NOT MONITORING"
    assert "no Zenoh router" in picture.banner.text
    assert picture.lost


def test_a_machine_switched_off_is_not_monitored_and_says_why(model: Model) -> None:
    off = wire.Reason(code="machine_off", text="the machine is switched off")
    beat = structs.replace(HEARTBEAT, status="not_monitoring", reasons=(off,))
    picture = compose(model, sight(guard(beat=beat)))
    assert picture.banner.word == "MACHINE OFF"
    assert picture.banner.tone is Tone.OFF
    assert not picture.banner.flash
    assert picture.lost


def test_degraded_is_told_with_and_without_an_alert(model: Model) -> None:
    reason = wire.Reason(code="rejected", text="3 messages refused")
    beat = structs.replace(HEARTBEAT, status="degraded", reasons=(reason,))
    calm = compose(model, sight(guard(beat=beat))).banner
    assert (calm.tone, calm.word, calm.text) == (Tone.CAUTION, "DEGRADED", "3 messages refused")
    raised = compose(model, sight(guard(CRATE, beat=beat))).banner
    assert raised.tone is Tone.IMMINENT
    assert "degraded: 3 messages refused" in raised.detail


def test_what_was_seen_flashes_no_more_and_what_is_over_waits(model: Model) -> None:
    seen = structs.replace(CRATE, state="acked", acked_by="anna")
    picture = compose(model, sight(guard(seen)))
    assert not picture.banner.flash
    assert picture.banner.tone is Tone.IMMINENT
    assert "seen by anna" in picture.cards[0].detail
    assert not picture.cards[0].can_ack
    over = structs.replace(CRATE, state="rtn_unacked", level="clear", time_to_collision_s=None)
    picture = compose(model, sight(guard(over)))
    assert picture.banner.tone is Tone.CALM
    assert "please acknowledge" in picture.banner.text
    assert picture.cards[0].can_ack


def test_shelved_is_listed_not_shouted_and_imminent_cannot_be(model: Model) -> None:
    warning = structs.replace(CRATE, level="warning")
    assert compose(model, sight(guard(warning))).cards[0].can_shelve
    assert not compose(model, sight(guard(CRATE))).cards[0].can_shelve
    shelved = structs.replace(warning, inhibit="shelved", shelved_by="anna")
    picture = compose(model, sight(guard(shelved)))
    assert picture.banner.tone is Tone.CALM
    assert picture.banner.detail == "1 alert shelved"
    assert zone(picture, "crate") is Tone.CALM
    assert (picture.cards[0].shelved, picture.cards[0].can_shelve) == (True, False)
    assert "shelved by anna" in picture.cards[0].detail


def test_the_usual_way_is_ghosts_to_the_predicted_end(model: Model) -> None:
    picture = compose(model, replace(sight(guard()), prediction=SWINGING))
    assert picture.intent is not None
    assert picture.intent.shape == (INTENT, 5, 4, 4)
    end = model.poses(np.array([[0.6, 0.065, 0.08, 0.03]]))[0]
    np.testing.assert_allclose(picture.intent[-1], end, atol=1e-9)
    swing = picture.bars[0]
    assert swing.there is not None
    assert swing.near is not None
    assert swing.far is not None
    assert swing.near < swing.there < swing.far
    assert swing.expected == "-0.50 ± 0.10"
    assert picture.basis == "prediction from 12 earlier moves like this"


def test_two_futures_share_the_ghosts(model: Model) -> None:
    start = dict(SWINGING.start)
    both = tuple(
        wire.prediction.Endpoint(position={**start, "swing": swing}, share=0.5)
        for swing in (0.8, 0.4)
    )
    forked = structs.replace(SWINGING, endpoints=both)
    ghosts = compose(model, replace(sight(guard()), prediction=forked)).intent
    assert ghosts is not None
    for index, swing in ((1, 0.8), (3, 0.4)):
        end = model.poses(np.array([[swing, 0.065, 0.08, 0.03]]))[0]
        np.testing.assert_allclose(ghosts[index], end, atol=1e-9)


def test_a_way_that_is_already_made_has_no_ghosts(model: Model) -> None:
    beyond = replace(sight(guard()), prediction=SWINGING, position=np.array([0.5, *POSITION[1:]]))
    assert compose(model, beyond).intent is None


def test_the_stopping_path_is_the_guards_own(model: Model) -> None:
    moving = replace(sight(guard()), velocity=np.array([-0.9, 0.0, 0.0, 0.0]))
    ghosts = compose(model, moving).stopping
    assert ghosts is not None
    assert ghosts.shape == (STOPPING, 5, 4, 4)
    way = model.forecaster.stopping(POSITION, moving.velocity, STILL).displacement  # type: ignore[arg-type]
    np.testing.assert_allclose(ghosts[-1], model.poses((POSITION + way)[None])[0], atol=1e-9)


def test_an_old_position_is_stale_and_has_no_future(model: Model) -> None:
    state = replace(guard(), contact=Contact(beat_s=102.0), now_s=102.0)
    old = replace(sight(state, 102.0), prediction=SWINGING, velocity=np.full(4, 0.3))
    picture = compose(model, old)
    assert picture.stale
    assert not picture.lost  # its guard says otherwise; it sees the actuators, we do not
    assert (picture.intent, picture.stopping) == (None, None)
    assert {b.here for b in picture.bars} == {None}


def test_a_position_beyond_its_linkage_is_drawn_at_the_end(model: Model) -> None:
    far = replace(sight(guard()), position=np.array([1.0, 5.0, -3.0, 9.0]))
    links = compose(model, far).links
    assert links is not None
    assert np.isfinite(links).all()


def test_a_moving_object_is_where_it_was_seen_or_nobody_knows(model: Model) -> None:
    site = model.site
    moving = Box(
        name="truck", margin_m=0.1, key="k", size_m=(0.1, 0.1, 0.1), pose=np.eye(4), max_speed=1.0
    )
    body = model.solids[0]
    placed = replace(model, solids=(*model.solids, replace(body, name="truck", moves=True)))
    assert moving.key is not None
    assert site.scene.moving == ()
    truck = compose(placed, sight(guard())).zones[-1]
    assert (truck.known, truck.pose) == (False, None)
    assert "nobody knows where" in truck.label
    pose = np.eye(4)
    seen = replace(sight(guard()), placed={"truck": pose}, placed_s={"truck": 99.9})
    truck = compose(placed, seen).zones[-1]
    assert truck.known
    assert truck.pose is pose
    lost = wire.ObjectInput(
        name="truck", key="k", placed=False, age_s=3.0, grown_m=None, rate_hz=0.0, accepted=1,
        rejected={},
    )  # fmt: skip
    beat = structs.replace(HEARTBEAT, objects=(lost,))
    said = replace(seen, guard=guard(beat=beat))
    assert not compose(placed, said).zones[-1].known


@pytest.mark.parametrize(
    ("seconds", "said"), [(None, ""), (1.99, "1.9 s"), (0.04, "now"), (-1.0, "now"), (0.3, "0.3 s")]
)
def test_no_more_time_is_promised_than_there_is(seconds: float | None, said: str) -> None:
    assert countdown(seconds) == said


def test_memory_shows_where_its_likeliest_way_leads_and_how_often_it_did(model: Model) -> None:
    start = dict(SWINGING.start)
    ways = tuple(
        wire.Scenario(share=share, count=count, duration_s=2.5, endpoint={**start, "swing": swing})
        for share, count, swing in ((0.8, 6, 0.3), (0.2, 2, 1.4))
    )
    seen = replace(sight(guard()), prediction=structs.replace(SWINGING, scenarios=ways))
    picture = compose(model, seen)
    assert picture.next is not None
    end = model.poses(np.array([[0.3, 0.065, 0.08, 0.03]]))
    np.testing.assert_allclose(picture.next, end, atol=1e-9)
    assert picture.next_words == "in 6 of 8 similar situations you went on to here"
    assert picture.next_words in side(picture)
    for unfit in (
        replace(seen, prediction=SWINGING),
        replace(seen, now_s=102.0),
        replace(seen, guard=guard(beat=None)),
        replace(seen, position=np.array([0.3, *POSITION[1:]])),
    ):
        nothing = compose(model, unfit)
        assert (nothing.next, nothing.next_words) == (None, "")
        assert "similar situations" not in side(nothing)


def test_an_alert_of_memory_says_in_how_many_times_it_came_to_contact(model: Model) -> None:
    known = structs.replace(CRATE, source="next", similar_situations=8, similar_contacts=6)
    assert "6 of 8 times" in compose(model, sight(guard(known))).cards[0].detail
    assert "times" not in compose(model, sight(guard(CRATE))).cards[0].detail
