"""Each wish is a line; a flood of refused ones is a number."""

from __future__ import annotations

import logging

import pytest

from rampe_guard.runtime.audit import Audit
from rampe_guard.runtime.say import Sayer


def test_every_wish_is_written_and_counted(caplog: pytest.LogCaptureFixture) -> None:
    audit = Audit(Sayer("rampe_guard.test"))
    with caplog.at_level(logging.INFO):
        for k in range(15):
            audit.refuse("forget", f"eve-{k}", "no", 0.01 * k)
            audit.grant("ack", "ann", f"alert {k}")
    said = [record.getMessage() for record in caplog.records]
    assert [f"forget by eve-{k}: refused: no" for k in range(15)] == said[::2]
    assert said[1] == "ack by ann: alert 0"
    assert (audit.counts.granted, audit.counts.refused) == ({"ack": 15}, {"forget": 15})


def test_a_flood_is_a_number_and_what_comes_after_is_written_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    audit = Audit(Sayer("rampe_guard.test"))
    with caplog.at_level(logging.INFO):
        for k in range(500):
            audit.refuse("forget" if k % 5 else "scene/put", None, "x" * 1000, 0.001 * k)
        audit.turn(0.9)
        assert len(caplog.records) == 20
        audit.turn(1.1)
        audit.refuse("ack", "ann", "late", 1.2)
    *_, held, late = [record.getMessage() for record in caplog.records]
    assert held == "refused within a second, and not written down: 96 scene/put, 384 forget"
    assert late == "ack by ann: refused: late"
    assert all(len(record.getMessage()) < 300 for record in caplog.records)
    assert sum(audit.counts.refused.values()) == 501
