"""The scene file as pydantic models: one class per keep-out object."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rampe_guard.core.scene import KeepOut
from rampe_guard.settings.model import Length, Model, Name, NonNegative, Number, Pose, Text, Vector

MAX_OBJECTS = 1000
DEFAULT_TIMEOUT_S = KeepOut(name="", margin_m=0.0).timeout_s


class _Object(Model):
    name: Name = Field(description="The name of the zone in alerts; unique in the scene.")


class _Solid(_Object):
    margin_m: NonNegative | None = Field(
        default=None,
        description="The keep-out distance round it [m]; the scene's margin_m if left out.",
    )
    ignore_links: tuple[Text, ...] = Field(
        default=(), description="The links of the arm that may touch this object."
    )


class MovableModel(_Solid):
    """What an object has that may move."""

    key: Text | None = Field(
        default=None,
        description="The exact Zenoh key of its poses, for an object that moves: its shape is "
        "then given in its own frame, which the messages place in the world.",
    )
    max_speed: Annotated[float, Field(gt=0.0, le=100.0)] | None = Field(
        default=None,
        description="The top speed of any point of it [m/s]: it is grown by this since it was "
        "seen; needed with key.",
    )
    timeout_s: Annotated[float, Field(ge=0.05, le=60.0)] | None = Field(
        default=None,
        description=f"The age at which its newest pose is no longer used [s], {DEFAULT_TIMEOUT_S:g}"
        " if left out: the zone is unknown then, and taken as contact.",
    )


class BoxModel(MovableModel):
    """A box."""

    type: Literal["box"] = Field(description="The kind of object.")
    size: Annotated[tuple[Length, ...], Field(min_length=3, max_length=3)] = Field(
        description="The edge lengths along x, y, z [m]."
    )
    pose: Pose = Field(default=Pose(), description="The pose of its centre in the world.")


class SphereModel(MovableModel):
    """A sphere."""

    type: Literal["sphere"] = Field(description="The kind of object.")
    radius_m: Length = Field(description="The radius [m].")
    center: Vector = Field(description="The centre x, y, z in the world [m].")


class CylinderModel(MovableModel):
    """A cylinder along the z axis of its pose."""

    type: Literal["cylinder"] = Field(description="The kind of object.")
    radius_m: Length = Field(description="The radius [m].")
    height_m: Length = Field(description="The height along its z axis [m].")
    pose: Pose = Field(default=Pose(), description="The pose of its centre in the world.")


class CapsuleModel(MovableModel):
    """A power line, pipe or rail: all points near a segment."""

    type: Literal["capsule"] = Field(description="The kind of object.")
    radius_m: Length = Field(description="The radius [m].")
    start: Vector = Field(alias="from", description="The start of its axis x, y, z [m].")
    end: Vector = Field(alias="to", description="The end of its axis x, y, z [m].")


class HalfspaceModel(_Solid):
    """The ground, a wall or a ceiling: all x with normal·x <= offset_m."""

    type: Literal["halfspace"] = Field(description="The kind of object.")
    normal: Vector = Field(
        description="The direction out of the solid side; of any length, offset_m scales with it."
    )
    offset_m: Number = Field(
        default=0.0, description="The distance of its face from the origin along the normal [m]."
    )


class MeshModel(MovableModel):
    """A triangle mesh from a file."""

    type: Literal["mesh"] = Field(description="The kind of object.")
    file: Text = Field(description="The mesh file (STL, OBJ or PLY), relative to this file.")
    scale: Length = Field(default=1.0, description="The factor from the file's unit to metres [-].")
    pose: Pose = Field(default=Pose(), description="The pose of the mesh in the world.")
    open: bool = Field(
        default=False,
        description="True for a surface without an inside, such as a scanned terrain: only its "
        "triangles are kept clear of. False for a solid, whose mesh must be closed.",
    )


class ActuatorLimitModel(_Object):
    """A zone in actuator space, such as a slew limiter."""

    type: Literal["actuator_limit"] = Field(description="The kind of object.")
    actuator: Name = Field(description="The name of the actuator in the site file.")
    above: Number | None = Field(
        default=None, description="The value above which the zone begins [actuator unit]."
    )
    below: Number | None = Field(
        default=None, description="The value below which the zone begins [actuator unit]."
    )


ObjectModel = Annotated[
    BoxModel
    | SphereModel
    | CylinderModel
    | CapsuleModel
    | HalfspaceModel
    | MeshModel
    | ActuatorLimitModel,
    Field(discriminator="type"),
]


class SceneModel(Model):
    """Keep-out zones of a site."""

    frame: Literal["world"] = Field(default="world", description="The frame of all poses: world.")
    margin_m: NonNegative = Field(
        default=0.0,
        description="The keep-out distance round every object that gives none itself [m].",
    )
    objects: Annotated[tuple[ObjectModel, ...], Field(min_length=1, max_length=MAX_OBJECTS)] = (
        Field(description="The keep-out objects, at least one.")
    )
