"""What the models of both files share: the base class, bounded numbers, names and poses."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

MAX_NAME = 64
_FAR = 1e7  # holds any metric grid coordinate; keeps every product of two finite


class Model(BaseModel):
    """Base of all models: unknown keys, wrong types, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _printable(text: str) -> str:
    if not text.isprintable() or text != text.strip():
        raise ValueError("has control characters or spaces at an end")
    return text


Name = Annotated[str, Field(min_length=1, max_length=MAX_NAME), AfterValidator(_printable)]
"""A name that people read: printable, 1 to 64 characters."""

Text = Annotated[str, Field(min_length=1, max_length=1024), AfterValidator(_printable)]
"""A path, key or column name."""

Number = Annotated[float, Field(ge=-_FAR, le=_FAR)]
Positive = Annotated[float, Field(gt=0.0, le=_FAR)]
NonNegative = Annotated[float, Field(ge=0.0, le=_FAR)]
Length = Annotated[float, Field(gt=1e-6, le=1e5)]
"""A size of a thing [m]: more than a micrometre, at most 100 km."""

Seconds = Annotated[float, Field(ge=0.0, le=3600.0)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Vector = Annotated[tuple[Number, ...], Field(min_length=3, max_length=3)]


class Pose(Model):
    """A pose: translation, then fixed-axis roll, pitch, yaw as in URDF."""

    xyz: Vector = Field(default=(0.0, 0.0, 0.0), description="The position x, y, z [m].")
    rpy: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="The rotation about the fixed x, then y, then z axis [rad].",
    )
