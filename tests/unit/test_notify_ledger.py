"""What a target still has to be told: bounded, gravest first, ends after what they end."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rampe_guard.core.alarm import Level
from rampe_guard.notify.choose import Notice
from rampe_guard.notify.ledger import MAX_MATTERS, Ledger

OFTEN = 60_000.0


def note(subject: str, level: Level = Level.WARNING, *, over: bool = False, **body: Any) -> Notice:
    body = {"event": "alert", "level": level.word, "text": subject, **body}
    return Notice("base", subject, level, over, {**body, "over": over})


def end(subject: str) -> Notice:
    return note(subject, Level.CLEAR, over=True)


def drained(ledger: Ledger, now_s: float) -> list[tuple[str, bool]]:
    """Everything that is told now, all of it heard."""
    told = []
    while (notice := ledger.next(now_s)) is not None:
        ledger.done(notice, now_s, heard=True)
        told.append((notice.subject, notice.over))
    return told


def test_the_gravest_first_and_each_once() -> None:
    ledger = Ledger(OFTEN)
    for subject, level in (("a", Level.CAUTION), ("b", Level.IMMINENT), ("c", Level.WARNING)):
        ledger.offer(note(subject, level), 1.0)
    assert drained(ledger, 1.0) == [("b", False), ("c", False), ("a", False)]
    ledger.offer(note("a", Level.CAUTION), 2.0)
    assert ledger.wait_s(2.0) is None  # the same again


def test_an_end_is_told_only_to_whom_the_beginning_was() -> None:
    ledger = Ledger(OFTEN)
    assert ledger.offer(end("a"), 1.0) == []
    raised = note("a")
    ledger.offer(raised, 1.0)
    assert ledger.offer(end("a"), 1.1) == [raised]  # reported as not told
    assert drained(ledger, 1.1) == []
    ledger.offer(note("a"), 2.0)
    assert drained(ledger, 2.0) == [("a", False)]
    ledger.offer(end("a"), 3.0)
    assert drained(ledger, 3.0) == [("a", True)]
    assert ledger.waiting == 0


def test_an_end_is_told_when_it_is_not_known_whether_the_beginning_was_heard() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(raised := note("a"), 1.0)
    assert ledger.next(1.0) is raised
    ledger.offer(ended := end("a"), 1.1)  # while it is being told
    ledger.done(raised, 1.2, heard=False)
    assert ledger.next(1.2) is ended


def test_only_the_newest_of_a_matter_is_told() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(note("a"), 1.0)
    ledger.offer(newest := note("a", Level.IMMINENT), 1.1)
    assert ledger.next(1.2) is newest
    ledger.done(newest, 1.2, heard=True)
    assert ledger.next(1.2) is None


def test_failures_are_tried_again_later_and_later_and_let_others_pass() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(bad := note("bad", Level.IMMINENT), 0.0)
    waits, now_s = [], 0.0
    for _ in range(9):
        assert ledger.next(now_s) is bad
        ledger.done(bad, now_s, heard=False)
        assert ledger.next(now_s) is None
        wait_s = ledger.wait_s(now_s)
        assert wait_s is not None
        waits.append(wait_s)
        now_s += wait_s
    assert waits == [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0, 30.0]
    ledger.offer(note("good", Level.CAUTION), now_s)
    assert [s for s, _ in drained(ledger, now_s)] == ["good", "bad"]


def test_what_got_graver_is_tried_at_once() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(first := note("a"), 0.0)
    assert ledger.next(0.0) is first
    ledger.done(first, 0.0, heard=False)
    ledger.offer(worse := note("a", Level.IMMINENT), 0.1)
    assert ledger.next(0.1) is worse


def test_lost_protection_takes_back_what_is_no_longer_current() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(note("told"), 0.0)
    assert drained(ledger, 0.0) == [("told", False)]
    ledger.offer(end("told"), 0.1)
    ledger.offer(waiting := note("waits", Level.IMMINENT), 0.1)
    assert ledger.offer(note("protection"), 0.2) == [waiting]
    assert drained(ledger, 0.2) == [("told", True), ("protection", False)]
    # protection is back, and the alert is still there
    ledger.offer(end("protection"), 1.0)
    ledger.offer(waiting, 1.0)
    assert sorted(drained(ledger, 1.0)) == [("protection", True), ("waits", False)]


def test_what_failed_before_protection_was_lost_is_told_when_it_is_back() -> None:
    ledger = Ledger(OFTEN)
    ledger.offer(raised := note("a"), 0.0)
    assert ledger.next(0.0) is raised
    ledger.done(raised, 0.1, heard=False)
    ledger.offer(note("protection"), 0.2)
    ledger.offer(end("protection"), 0.3)
    ledger.offer(raised, 0.3)
    assert ("a", False) in drained(ledger, 1.0)


def test_a_target_is_not_told_more_than_its_rate() -> None:
    ledger = Ledger(per_minute=60.0)
    for i in range(40):
        ledger.offer(note(str(i)), 0.0)
    times, now_s = [], 0.0
    while ledger.waiting:
        times += [now_s] * len(drained(ledger, now_s))
        now_s += ledger.wait_s(now_s) or 0.0
    assert times.count(0.0) == 10
    assert 29.9 < times[-1] < 30.1


def test_too_many_matters_push_out_the_least() -> None:
    ledger = Ledger(OFTEN)
    for i in range(MAX_MATTERS):
        assert ledger.offer(note(f"w{i}"), 0.0) == []
    assert [n.subject for n in ledger.offer(note("small", Level.CAUTION), 0.0)] == ["small"]
    assert [n.subject for n in ledger.offer(note("new"), 0.0)] == ["w0"]
    assert [n.subject for n in ledger.offer(note("grave", Level.IMMINENT), 0.0)] == ["w1"]
    assert ledger.waiting == MAX_MATTERS
    assert ledger.next(0.0) == note("grave", Level.IMMINENT)


def test_what_was_told_long_ago_is_forgotten_before_memory_grows() -> None:
    ledger = Ledger(OFTEN)
    for i in range(3 * MAX_MATTERS):
        ledger.offer(note(f"w{i}"), float(i))
        drained(ledger, float(i))
    assert len(ledger._matters) <= MAX_MATTERS + 1


class History:
    """A ledger, what is so, and what its target heard."""

    def __init__(self) -> None:
        self.ledger = Ledger(OFTEN)
        self.now: dict[str, Notice] = {}
        self.heard: dict[str, Notice] = {}
        self.flying: Notice | None = None

    def offer(self, notice: Notice, now_s: float) -> None:
        self.now[notice.subject] = notice
        self.ledger.offer(notice, now_s)

    def back(self, now_s: float) -> None:
        self.offer(end("protection"), now_s)
        for notice in self.now.values():
            if not notice.over:
                self.ledger.offer(notice, now_s)

    def land(self, now_s: float, *, heard: bool) -> None:
        if self.flying is not None:
            if heard:
                self.heard[self.flying.subject] = self.flying
            self.ledger.done(self.flying, now_s, heard=heard)
        self.flying = None

    def step(self, subject: str, word: str, now_s: float) -> None:
        if word in LEVELS:
            self.offer(note(subject, LEVELS[word], over=word == "end"), now_s)
        elif word == "try" and self.flying is None:
            self.flying = self.ledger.next(now_s)
        elif word in {"hear", "fail"}:
            self.land(now_s, heard=word == "hear")
        elif word == "lose":
            self.offer(note("protection"), now_s)
        elif word == "back":
            self.back(now_s)


LEVELS = {"raise": Level.WARNING, "worse": Level.IMMINENT, "end": Level.CLEAR}
WORDS = [*LEVELS, "try", "hear", "fail", "lose", "back"]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(WORDS)), max_size=60))
def test_after_any_history_a_target_that_answers_ends_up_right(
    words: list[tuple[str, str]],
) -> None:
    """Whatever failed before: in the end what was heard last is what is, and no end is missing."""
    history, now_s = History(), 0.0
    for subject, word in words:
        now_s += 100.0
        history.step(subject, word, now_s)
    history.land(now_s, heard=True)
    while history.ledger.waiting:
        now_s += 100.0
        history.flying = history.ledger.next(now_s)
        history.land(now_s, heard=True)
    lost = history.now.get("protection")
    for subject, notice in history.now.items():
        last = history.heard.get(subject)
        if notice.over:
            assert last is None or last.over
        elif lost is None or lost.over or subject == "protection":
            assert last is not None
            assert last.level == notice.level
