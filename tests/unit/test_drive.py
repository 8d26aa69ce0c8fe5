from __future__ import annotations

import math

import numpy as np
import pytest

from rampe_guard.core.drive import (
    CylinderDrive,
    DirectDrive,
    Drive,
    FourBarDrive,
    TableDrive,
    actuator_value,
    domain,
    joint_scalar,
    joint_value,
)
from rampe_guard.core.drive_proof import check_monotone, slope_bounds
from rampe_guard.errors import GeometryError

BOOM = CylinderDrive(base_m=0.8, rod_m=2.3, length_at_zero_m=1.7, angle_offset_rad=-1.0)
BARREL = CylinderDrive(0.8, 2.3, 1.7, 0.5, -1, "base")
ROD = CylinderDrive(3.1, 0.8, 2.44, 0.0, 1, "rod")
BUCKET = FourBarDrive(
    base_m=2.148921,
    rod_m=0.62,
    length_at_zero_m=1.66,
    rocker_offset_rad=3.0974,
    ground_m=0.45,
    rocker_m=0.62,
    coupler_m=0.6,
    follower_m=0.46,
    direction=-1,
)
TABLE = TableDrive(actuator=(0.0, 0.3, 1.0), joint=(2.0, 1.0, 0.5))
CASES: list[tuple[Drive, float, float]] = [
    (DirectDrive(scale=-2.0, offset=0.1), -1.0, 1.0),
    (BOOM, 0.0, 1.2),
    (BARREL, 0.0, 1.2),
    (ROD, 0.0, 1.3),
    (BUCKET, 0.0, 0.96),
    (TABLE, 0.0, 1.0),
]


@pytest.mark.parametrize(("drive", "lower", "upper"), CASES)
def test_scalar_and_array_agree(drive: Drive, lower: float, upper: float) -> None:
    q = np.linspace(lower, upper, 23).reshape(1, 23)
    values = [joint_scalar(drive, float(x)) for x in q[0]]
    assert np.allclose(joint_value(drive, q), [values], atol=1e-12)


@pytest.mark.parametrize(("drive", "lower", "upper"), CASES)
def test_inverse_returns(drive: Drive, lower: float, upper: float) -> None:
    for q in np.linspace(lower, upper, 7):
        theta = joint_scalar(drive, float(q))
        assert actuator_value(drive, theta, lower, upper) == pytest.approx(float(q), abs=1e-8)


@pytest.mark.parametrize(("drive", "lower", "upper"), CASES)
def test_proven_monotone_and_slopes_hold(drive: Drive, lower: float, upper: float) -> None:
    sign = check_monotone(drive, lower, upper)
    edges = np.linspace(lower, upper, 40)
    low, high = slope_bounds(drive, edges[:-1], edges[1:])
    for a, b, least, most in zip(edges[:-1], edges[1:], low, high, strict=True):
        q = np.linspace(a, b, 50)
        slopes = np.diff(joint_value(drive, q)) / np.diff(q)
        assert (np.sign(slopes) == sign).all()
        assert slopes.min() >= least - 1e-9
        assert slopes.max() <= most + 1e-9


def test_slope_bounds_grow_tight() -> None:
    for drive in (BOOM, BARREL, ROD, BUCKET):
        low, high = slope_bounds(drive, np.array([0.5]), np.array([0.501]))
        slope = (joint_scalar(drive, 0.501) - joint_scalar(drive, 0.5)) / 0.001
        assert abs(high[0] - slope) < 0.01 * abs(slope)
        assert abs(low[0] - slope) < 0.01 * abs(slope)


def test_right_angle_of_a_345_triangle() -> None:
    drive = CylinderDrive(base_m=3.0, rod_m=4.0, length_at_zero_m=4.0)
    assert joint_scalar(drive, 1.0) == pytest.approx(math.pi / 2)
    barrel = CylinderDrive(3.0, 4.0, 4.0, corner="base")
    assert joint_scalar(barrel, 1.0) == pytest.approx(math.acos(3 / 5))
    rod = CylinderDrive(3.0, 4.0, 4.0, corner="rod")
    assert joint_scalar(rod, 1.0) == pytest.approx(math.acos(4 / 5))


def test_bench_excavator_linkage_as_published() -> None:
    """Strokes in cm and angles of the bench-scale machine; angles are known modulo a turn."""
    boom = CylinderDrive(22, 7.8, 16.3, -0.39853 - 0.8161)
    stick = CylinderDrive(26.7, 8.1, 19.4, 3 * math.pi - 0.48263 - 2.77961, -1)
    bucket = FourBarDrive(
        base_m=21.2,
        rod_m=6.0,
        length_at_zero_m=15.55,
        rocker_offset_rad=math.pi - 0.21197,
        ground_m=4.0,
        rocker_m=6.0,
        coupler_m=6.0,
        follower_m=4.7,
        angle_offset_rad=3 * math.pi - 1.65879 - 0.08703,
        direction=-1,
    )
    drives: list[Drive] = [boom, stick, bucket]
    for strokes, angles in (
        ((10.84, 10.0, 2.5), (54.4, -108.4, -1.0)),
        ((6.5, 4.2, 1.2), (16.2, -66.1, 14.9)),
    ):
        for drive, stroke, angle in zip(drives, strokes, angles, strict=True):
            error = math.degrees(joint_scalar(drive, stroke)) - angle
            assert abs((error + 180) % 360 - 180) < 0.1


def test_not_a_number_where_the_triangle_cannot_close() -> None:
    low, high = domain(BOOM)
    for q in (low - 0.01, high + 0.01, -5.0):
        assert math.isnan(joint_scalar(BOOM, q))
        assert np.isnan(joint_value(BOOM, np.array([q]))).all()
    assert math.isnan(joint_scalar(TABLE, 1.01))


@pytest.mark.parametrize(
    ("drive", "lower", "upper", "words"),
    [
        (BOOM, 0.0, 2.0, "cannot close"),
        (BOOM, 1.0, 0.0, "lower < upper"),
        (DirectDrive(scale=0.0), -1.0, 1.0, "scale"),
        # the barrel swings back once the cylinder passes sqrt(base² - rod²) = 2.5
        (CylinderDrive(3.0, 1.66, 2.0, corner="base"), 0.0, 1.0, "monotone"),
        # rocker in line with the ground: the coupler turns back
        (
            FourBarDrive(2.148921, 0.62, 1.66, 1.2, 0.45, 0.62, 0.6, 0.46),
            0.0,
            0.96,
            "monotone|close",
        ),
        (TableDrive((0.0, 1.0, 2.0), (0.0, 1.0, 1.0)), 0.0, 2.0, "monotone"),
    ],
)
def test_refused_with_values(drive: Drive, lower: float, upper: float, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        check_monotone(drive, lower, upper)


def test_inverse_needs_limits_where_the_linkage_folds() -> None:
    folding = CylinderDrive(3.0, 1.66, 2.0, corner="base")
    theta = joint_scalar(folding, 0.4)
    with pytest.raises(GeometryError, match="2 actuator values"):
        actuator_value(folding, theta)
    assert actuator_value(folding, theta, 0.0, 0.45) == pytest.approx(0.4)
    with pytest.raises(GeometryError, match="0 actuator values"):
        actuator_value(BOOM, 9.0)
