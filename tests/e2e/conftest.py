"""Fixtures of the end-to-end tests: everything runs as processes on loopback."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.contract import Contract
from tests.support.station import Station, station


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """A running guard of the bench site with its machine, shared by a module."""
    with station(tmp_path_factory.mktemp("live")) as made:
        yield made


@pytest.fixture(scope="session")
def contract() -> Contract:
    """What ``rampe-guard schema`` prints, as validators."""
    return Contract()
