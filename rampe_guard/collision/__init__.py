"""Geometry at the edge: URDF and meshes to an arm, scene to keep-out shapes, FCL to certificates."""
