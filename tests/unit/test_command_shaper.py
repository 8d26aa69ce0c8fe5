import numpy as np
import pytest

from rampe_guard import wire
from rampe_guard.client import CommandShaper
from rampe_guard.errors import MessageError

FULL = np.array([1.0, -1.0])


def told(
    seq: int = 1,
    stamp: float | None = 10.0,
    boot: str = "a",
    *,
    some: bool = True,
    expires_s: float = 0.25,
) -> bytes:
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
            expires_after_s=expires_s,
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


@pytest.mark.parametrize("command", [[np.nan, 1.0], [np.inf, 1.0], [1e300, 1.0]])
def test_what_is_no_number_moves_nothing(shaper: CommandShaper, command: list[float]) -> None:
    shaper.take(told(), 10.0)
    shaped = shaper.shape(np.array(command), 10.0)
    assert shaped.tolist() == [0.0 if np.isnan(command[0]) else 0.25, 0.25]


def test_a_command_for_another_number_of_actuators_is_an_error(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.0)
    with pytest.raises(ValueError, match="2 actuators"):
        shaper.shape(np.array([1.0]), 10.0)


def test_time_that_goes_back_or_is_none_makes_no_advice_young(shaper: CommandShaper) -> None:
    shaper.take(told(), 10.0)
    assert not shaper.advised(10.3)
    assert not shaper.advised(10.1)
    shaper.take(told(2), 10.0)  # its clock was set, and it is told anew
    assert shaper.advised(10.1)
    assert not shaper.advised(float("nan"))
    assert shaper.shape(FULL, 10.1).tolist() == [0.0, 0.0]


def test_no_advice_holds_for_ever_nor_comes_from_the_future(shaper: CommandShaper) -> None:
    shaper.take(told(expires_s=1e9), 10.0)
    assert shaper.advised(12.0)
    assert not shaper.advised(12.1)
    shaper.take(told(2, stamp=1e9), 12.1)
    assert not shaper.advised(12.1)
    shaper.take(told(3, stamp=13.0), float("nan"))
    assert not shaper.advised(13.0)
