"""What all tests share: no test leaves shapes on this machine, or finds some there."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

# imported here so that it chooses, before the folder of shapes is ours, where compiled kernels
# are kept: all sessions and their processes share those
import rampe_guard  # noqa: F401
from rampe_guard.collision.shape_cache import ENVIRONMENT


@pytest.fixture(scope="session", autouse=True)
def _shapes_of_this_session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(ENVIRONMENT, str(tmp_path_factory.mktemp("shapes")))
        yield
