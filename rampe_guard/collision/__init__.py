"""Geometry at the edge: URDF and meshes to an arm, scene to keep-out shapes, FCL to proofs.

Who only reads an arm does not wait for the sweep's compiler.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rampe_guard.collision.urdf import Arm, load_arm

if TYPE_CHECKING:
    from rampe_guard.collision.sweeper import FclSweeper

__all__ = ["Arm", "FclSweeper", "load_arm"]


def __getattr__(name: str) -> Any:
    if name != "FclSweeper":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from rampe_guard.collision.sweeper import FclSweeper  # noqa: PLC0415

    return FclSweeper
