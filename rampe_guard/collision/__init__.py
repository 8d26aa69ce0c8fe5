"""Geometry at the edge: URDF and meshes to an arm, scene to keep-out shapes, FCL to proofs."""

from rampe_guard.collision.sweeper import FclSweeper
from rampe_guard.collision.urdf import Arm, load_arm

__all__ = ["Arm", "FclSweeper", "load_arm"]
