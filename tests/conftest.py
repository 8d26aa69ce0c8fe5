"""What all tests share: no test leaves shapes on this machine, or finds some there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

# imported here so that it chooses, before the folder of shapes is ours, where compiled kernels
# are kept: all sessions and their processes share those
import rampe_guard  # noqa: F401
from rampe_guard.collision.shape_cache import ENVIRONMENT

UNIT = Path(__file__).parent / "unit"
E2E = Path(__file__).parent / "e2e"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Choose whose lines are counted, and the order of the files.

    Lines count in the unit tests only: they must cover the core by themselves, and the others run
    a third faster without being traced. End-to-end files wait much and compute little: spread
    evenly among the others, they fill a worker's time while the other one computes.
    """
    for item in items:
        if UNIT not in item.path.parents:
            item.add_marker("no_cover")
    files = list(dict.fromkeys(item.path for item in items))
    waiting = [file for file in files if E2E in file.parents]
    computing = [file for file in files if E2E not in file.parents]
    place = {
        file: (number + 0.5) / len(group)
        for group in (waiting, computing)
        for number, file in enumerate(group)
    }
    items.sort(key=lambda item: place[item.path])


@pytest.fixture(scope="session", autouse=True)
def _shapes_of_this_session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:  # the workers of a session share them
        folder = folder.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(ENVIRONMENT, str(folder / "shapes"))
        yield
