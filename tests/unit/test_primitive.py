import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.joystick import CategoryChange
from rampe_guard.core.primitive import PrimitiveTracker


def walk(tracker: PrimitiveTracker, until: float, start: float = 0.0) -> None:
    for t in np.arange(start, until + 1e-9, 0.1):
        tracker.position(float(t), np.array([t, 2.0 * t]))


def test_displacement_runs_from_change_to_change() -> None:
    tracker = PrimitiveTracker()
    walk(tracker, 1.0)
    assert tracker.change(CategoryChange((1, 1), 0.95)) is None
    assert tracker.current is not None
    np.testing.assert_allclose(tracker.current.start, [0.95, 1.9])
    walk(tracker, 2.0, 1.1)
    finished = tracker.change(CategoryChange((0, 0), 1.8))
    assert finished is not None
    assert finished.complete
    assert finished.primitive.category == (1, 1)
    np.testing.assert_allclose(finished.displacement, [0.85, 1.7])
    assert tracker.current is None


def test_one_primitive_ends_where_the_next_starts() -> None:
    tracker = PrimitiveTracker()
    walk(tracker, 2.0)
    tracker.change(CategoryChange((1, 0), 1.0))
    finished = tracker.change(CategoryChange((1, 1), 1.5))
    assert finished is not None
    assert tracker.current is not None
    np.testing.assert_allclose(
        tracker.current.start, finished.primitive.start + finished.displacement
    )


def test_interrupted_primitives_say_so_and_the_next_is_whole_again() -> None:
    tracker = PrimitiveTracker()
    walk(tracker, 2.0)
    tracker.change(CategoryChange((1, 0), 1.0))
    tracker.interrupt()
    first = tracker.change(CategoryChange((0, 1), 1.5))
    second = tracker.change(CategoryChange((0, 0), 1.9))
    assert first is not None
    assert second is not None
    assert (first.complete, second.complete) == (False, True)


def test_without_a_position_nothing_starts() -> None:
    tracker = PrimitiveTracker()
    assert tracker.change(CategoryChange((1, 0), 1.0)) is None
    assert tracker.current is None


def test_reset_forgets_the_primitive_under_way() -> None:
    tracker = PrimitiveTracker()
    walk(tracker, 1.0)
    tracker.change(CategoryChange((1, 0), 0.5))
    tracker.reset()
    assert tracker.change(CategoryChange((0, 0), 0.9)) is None


@given(st.lists(st.floats(0.2, 1.5), min_size=1, max_size=12))
def test_displacements_of_a_chain_add_up_to_the_way(durations: list[float]) -> None:
    tracker = PrimitiveTracker()
    now, total = 0.0, 0.0
    tracker.position(0.0, np.array([0.0]))
    tracker.change(CategoryChange((1,), 0.0))
    for k, duration in enumerate(durations):
        now += duration
        tracker.position(now, np.array([now * now]))
        finished = tracker.change(CategoryChange((-1 if k % 2 == 0 else 1,), now))
        assert finished is not None
        total += float(finished.displacement[0])
    assert np.isclose(total, now * now)
