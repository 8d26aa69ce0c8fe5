"""What the closing table of a demo takes from what was heard."""

from __future__ import annotations

import subprocess
import sys

import pytest
from msgspec.structs import replace

from rampe_guard import wire
from rampe_guard.evaluate.tally import Tally
from rampe_guard.programs.demo import _Score, more_words
from tests.support.messages import HEARTBEAT
from tests.unit.test_score_referee import WallAtOne


def beat(time_s: float, status: str) -> wire.Heartbeat:
    return replace(HEARTBEAT, published_unix_s=time_s, status=status)


def position(time_s: float) -> wire.ActuatorsMessage:
    return wire.ActuatorsMessage(position=(0.0,), stamp=time_s)


@pytest.mark.parametrize(
    ("beats", "blind_s"),
    [
        ([(0.0, "ok"), (0.9, "degraded"), (1.8, "ok"), (2.7, "ok")], 0.0),
        ([(0.0, "ok"), (0.9, "not_monitoring"), (1.8, "ok"), (2.7, "ok")], 0.9),
        ([(0.0, "ok"), (1.5, "ok"), (2.4, "ok")], 0.5),  # silent for too long
        ([(0.0, "ok"), (0.9, "ok")], 3.0 - 1.9),  # silent to the end
    ],
)
def test_a_demo_knows_when_nobody_watched(beats: list[tuple[float, str]], blind_s: float) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as operator:
        score = _Score(Tally(WallAtOne(), ("wall",)), operator, ())
        score.take([position(0.0)])
        for told in beats:
            score.take([beat(*told)])
        score.take([position(3.0)])
    assert score.tally.duration_s == pytest.approx(3.0)
    assert score.tally.blind_s == pytest.approx(blind_s)


@pytest.mark.parametrize(
    ("took_s", "words"), [(9.97, "0 %"), (10.03, "0 %"), (10.09, "+1 %"), (9.0, "-10 %")]
)
def test_no_difference_has_no_sign(took_s: float, words: str) -> None:
    assert more_words(took_s, 10.0) == words
