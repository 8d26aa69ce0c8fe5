import numpy as np
import pytest

from rampe_guard import wire
from rampe_guard.client import CommandShaper
from rampe_guard.errors import MessageError

FULL = np.array([1.0, -1.0])


def told(seq: int = 1, stamp: float | None = 10.0, boot: str = "a", *, some: bool = True) -> bytes:
    lever = wire.ActuatorAdvice(
        negative_share=0.5, positive_share=0.25, negative_zone="x", positive_zone="y"
    )
    return wire.encode(
        wire.Advice(
            boot_id=boot,
            seq=seq,
            site="s",
            machine="m",
            quality="good" if some else "none",
            actuators={"swing": lever, "boom": lever} if some else None,
            reason=None if some else "blind",
            stamp=stamp,
            published_unix_s=0.0,
            expires_after_s=0.25,
            text="",
        )
    )


@pytest.fixture
def shaper() -> CommandShaper:
    return CommandShaper(("swing", "boom"))


def test_without_advice_it_stands(shaper: CommandShaper) -> None:
    assert shaper.shape(FULL, 0.0).tolist() == [0.0, 0.0]
    assert CommandShaper(("swing", "boom"), 0.1).shape(FULL, 0.0).tolist() == [0.1, -0.1]


def test_fresh_advice_limits_each_way(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.05)
    assert shaper.advised(10.2)
    assert shaper.shape(FULL, 10.2).tolist() == [0.25, -0.5]
    assert shaper.shape(np.array([0.1, 0.1]), 10.2).tolist() == [0.1, 0.1]


def test_advice_is_as_old_as_what_it_is_about(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.2)
    assert shaper.advised(10.25)
    assert not shaper.advised(10.26)
    assert shaper.shape(FULL, 10.26).tolist() == [0.0, 0.0]


def test_without_a_stamp_the_arrival_counts(shaper: CommandShaper) -> None:
    shaper.take(told(stamp=None), 10.2)
    assert shaper.advised(10.45)
    assert not shaper.advised(10.46)


def test_no_advice_is_not_free(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.0)
    shaper.take(told(2, some=False), 10.0)
    assert not shaper.advised(10.0)
    assert shaper.shape(FULL, 10.0).tolist() == [0.0, 0.0]


def test_what_was_overtaken_is_not_taken(shaper: CommandShaper) -> None:
    shaper.take(told(2, some=False), 10.0)
    shaper.take(told(1), 10.0)
    assert not shaper.advised(10.0)
    shaper.take(told(1, boot="b"), 10.0)  # another run of the guard counts anew
    assert shaper.advised(10.0)


def test_advice_for_another_machine_is_none() -> None:
    shaper = CommandShaper(("swing", "boom", "stick"))
    shaper.take(told(), 10.0)
    assert not shaper.advised(10.0)


def test_rubbish_changes_nothing(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.0)
    with pytest.raises(MessageError):
        shaper.take(b"{}", 10.1)
    assert shaper.advised(10.1)


def test_a_share_is_a_share() -> None:
    with pytest.raises(ValueError, match="without=2"):
        CommandShaper((), 2.0)
