"""The committed machines and scenes: rebuilt, measured and moved without our collision code.

Joint values come from the site files through `core.drive`; where links are is yourdfpy's
answer; distances to the analytic keep-outs are formulas written here.
"""

from __future__ import annotations

import csv
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import fcl
import numpy as np
import pytest
import trimesh
import yourdfpy

from rampe_guard.core.drive import joint_value
from rampe_guard.core.scene import (
    ActuatorLimit,
    Box,
    Capsule,
    Cylinder,
    Halfspace,
    Mesh,
    SolidObject,
    Sphere,
)
from rampe_guard.core.types import FloatArray
from rampe_guard.settings import load_site

ROOT = Path(__file__).resolve().parents[2]
GEOMETRY = ROOT / "geometry"
SITES = ROOT / "config" / "sites"
LOGS = ROOT.parent / "shared" / "data" / "excavator_logs"
ASSETS = sorted(p for p in GEOMETRY.rglob("*") if p.suffix in {".stl", ".urdf"})

# What a good operator does: swing [rad], boom, stick, bucket [m of stroke].
CYCLE = np.array(
    [
        (0.0, 0.52, 0.20, 0.20),  # over the trench, stretched
        (0.0, 0.58, 0.40, 0.45),  # dig
        (0.0, 0.80, 0.40, 0.56),  # lift
        (1.2, 0.88, 0.40, 0.56),  # swing to the heap
        (1.2, 0.88, 0.30, 0.20),  # dump
        (0.0, 0.80, 0.20, 0.20),  # swing back
        (0.0, 0.52, 0.20, 0.20),
    ]
)


class Machine:
    """A site's arm in any pose: joints by `core.drive`, link poses by yourdfpy."""

    def __init__(self, site: str) -> None:
        self.site = load_site(SITES / f"{site}.yaml")
        self.arm = self.site.arm
        self.urdf: Any = yourdfpy.URDF.load(self.arm.urdf, load_meshes=True)
        self.meshes: dict[str, Any] = {
            link: trimesh.load_mesh(
                Path(self.arm.urdf).parent / description.visuals[0].geometry.mesh.filename
            )
            for link, description in self.urdf.link_map.items()
        }
        self.points = {link: _surface(mesh) for link, mesh in self.meshes.items()}

    def pose(self, position: FloatArray) -> None:
        self.urdf.update_cfg(
            {j.joint: float(joint_value(j.drive, position[j.actuator])) for j in self.arm.joints}
        )

    def matrix(self, link: str) -> FloatArray:
        return np.asarray(self.arm.base_pose @ self.urdf.get_transform(link))

    def point(self, link: str, *xyz: float) -> FloatArray:
        return np.asarray((self.matrix(link) @ [*xyz, 1.0])[:3])

    def clearance(self, item: SolidObject, position: FloatArray) -> float:
        """Smallest distance of the links that count from ``item``, less its margin [m]."""
        self.pose(position)
        links = [link for link in self.meshes if link not in item.ignore_links]
        gaps = []
        for link in links:
            if isinstance(item, Mesh):
                gaps.append(self._mesh_distance(link, item))
            else:
                pose = self.matrix(link)
                world = self.points[link] @ pose[:3, :3].T + pose[:3, 3]
                gaps.append(float(distance(item, world).min()))
        return min(gaps) - item.margin_m

    def _mesh_distance(self, link: str, item: Mesh) -> float:
        pose = self.matrix(link)
        body = _body(self.site.machine, link, self.meshes[link])
        body.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        ground = _body("scene", item.file, trimesh.load_mesh(item.file))
        return float(fcl.distance(body, ground, fcl.DistanceRequest(), fcl.DistanceResult()))


_BODIES: dict[tuple[str, str], Any] = {}


def _body(owner: str, name: str, mesh: Any) -> Any:
    if (owner, name) not in _BODIES:
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh.faces))
        model.addSubModel(mesh.vertices, mesh.faces)
        model.endModel()
        _BODIES[owner, name] = fcl.CollisionObject(model, fcl.Transform())
    return _BODIES[owner, name]


def _surface(mesh: Any) -> FloatArray:
    vertices, _ = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, max_edge=0.4)
    return np.unique(np.round(vertices, 4), axis=0)


def distance(item: SolidObject, points: FloatArray) -> FloatArray:
    """Distance of each point (k, 3) from the surface of ``item``, negative inside [m]."""
    match item:
        case Box():
            local = (points - item.pose[:3, 3]) @ item.pose[:3, :3]
            return _outside(np.abs(local) - np.asarray(item.size_m) / 2)
        case Cylinder():
            local = (points - item.pose[:3, 3]) @ item.pose[:3, :3]
            radial = np.hypot(local[:, 0], local[:, 1]) - item.radius_m
            return _outside(np.column_stack([radial, np.abs(local[:, 2]) - item.height_m / 2]))
        case Sphere():
            return np.asarray(np.linalg.norm(points - item.center_m, axis=1) - item.radius_m)
        case Capsule():
            start, along = np.asarray(item.start_m), np.subtract(item.end_m, item.start_m)
            s = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)[:, None]
            return np.asarray(np.linalg.norm(points - start - s * along, axis=1) - item.radius_m)
        case Halfspace():
            return np.asarray(points @ np.asarray(item.normal) - item.offset_m)
        case Mesh():
            raise NotImplementedError("meshes are measured by FCL")


def _outside(excess: FloatArray) -> FloatArray:
    beyond = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return np.asarray(beyond + np.minimum(excess.max(axis=1), 0.0))


@cache
def machine(site: str) -> Machine:
    return Machine(site)


def solids(site: str) -> dict[str, SolidObject]:
    objects = machine(site).site.scene.objects
    return {o.name: o for o in objects if not isinstance(o, ActuatorLimit)}


def along_cycle(steps: int) -> FloatArray:
    s = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    return np.vstack([a + s * (b - a) for a, b in pairwise(CYCLE)])


# ------------------------------------------------------------------ files


def test_the_script_builds_the_committed_files(tmp_path: Path) -> None:
    pytest.importorskip("manifold3d", reason="only the build of the meshes needs it")
    script = GEOMETRY / "build.py"
    subprocess.run([sys.executable, script, tmp_path], check=True, capture_output=True)

    built = {p.relative_to(tmp_path): p for p in tmp_path.rglob("*") if p.is_file()}
    assert set(built) == {p.relative_to(GEOMETRY) for p in ASSETS}
    for name, path in built.items():
        if name.suffix == ".urdf":
            assert path.read_text() == (GEOMETRY / name).read_text()
            continue
        new, old = trimesh.load_mesh(path), trimesh.load_mesh(GEOMETRY / name)
        assert new.triangles.shape == old.triangles.shape, name
        np.testing.assert_allclose(new.triangles, old.triangles, atol=1e-6, err_msg=str(name))


@pytest.mark.parametrize(
    "path", [p for p in ASSETS if p.suffix == ".stl"], ids=lambda p: f"{p.parts[-3]}-{p.stem}"
)
def test_every_mesh_is_closed_and_not_degenerate(path: Path) -> None:
    mesh = trimesh.load_mesh(path)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert mesh.area_faces.min() > 1e-12


def test_the_excavator_is_of_the_promised_size_and_shape() -> None:
    meshes = machine("demo").meshes
    assert 8_000 <= sum(len(m.faces) for m in meshes.values()) <= 14_000
    hollow = {link: m.volume / m.convex_hull.volume for link, m in meshes.items()}
    assert hollow["bucket"] < 0.3
    assert max(hollow[link] for link in ("undercarriage", "house", "boom")) < 0.8


def test_every_kind_of_keep_out_appears_in_a_scene() -> None:
    kinds = {type(o) for site in ("demo", "bench") for o in machine(site).site.scene.objects}
    assert kinds == {Box, Sphere, Cylinder, Capsule, Halfspace, Mesh, ActuatorLimit}


def test_ignored_links_exist() -> None:
    for item in solids("demo").values():
        assert set(item.ignore_links) <= set(machine("demo").meshes)


# ------------------------------------------------------------------ linkages


@pytest.mark.parametrize("share", np.linspace(0.0, 1.0, 41))
def test_the_pins_of_every_cylinder_stay_together(share: float) -> None:
    arm = machine("demo")
    stroke = share * np.array([0.0, 1.20, 1.34, 0.96])
    arm.pose(stroke)
    far_ends = {
        "boom rod": (arm.point("boom_rod", 0, 0, 0), arm.point("boom", 2.30, 0, 0.45)),
        "stick barrel": (arm.point("stick_barrel", 0, 0, 0), arm.point("boom", 2.75, 0, 0.98)),
        "bucket barrel": (arm.point("bucket_barrel", 0, 0, 0), arm.point("stick", 0.35, 0, 0.50)),
        "coupler": (arm.point("coupler", 0.60, 0, 0), arm.point("rocker", 0.62, 0, 0)),
    }
    for name, (end, pin) in far_ends.items():
        assert np.linalg.norm(end - pin) < 1e-3, name
    lengths = {
        "boom": (arm.point("boom_barrel", 0, 0, 0), arm.point("boom", 2.30, 0, 0.45), 1.66),
        "stick": (arm.point("stick_rod", 0, 0, 0), arm.point("boom", 2.75, 0, 0.98), 2.44),
        "bucket": (arm.point("rocker", 0.62, 0, 0), arm.point("stick", 0.35, 0, 0.50), 1.66),
    }
    for k, (name, (base, rod, retracted)) in enumerate(lengths.items(), start=1):
        assert np.linalg.norm(rod - base) == pytest.approx(retracted + stroke[k], abs=1e-4), name


@pytest.mark.parametrize("site", ["demo", "bench"])
def test_strokes_end_where_the_urdf_limits_its_joints(site: str) -> None:
    arm = machine(site)
    limited = [j for j in arm.arm.joints if arm.urdf.joint_map[j.joint].limit is not None]
    assert len(limited) == len(arm.arm.joints) - 1  # all but the swing
    for j in limited:
        ends = joint_value(j.drive, np.array(arm.arm.limits[j.actuator], dtype=float))
        limit = arm.urdf.joint_map[j.joint].limit
        np.testing.assert_allclose(sorted(ends), [limit.lower, limit.upper], atol=2e-5)


def test_the_excavator_reaches_as_far_as_its_class() -> None:
    arm = machine("demo")
    grid = np.stack(np.meshgrid(*[np.linspace(0, s, 9) for s in (1.20, 1.34, 0.96)]), -1)
    tips = []
    for strokes in grid.reshape(-1, 3):
        arm.pose(np.array([0.0, *strokes]))
        tips.append(arm.point("bucket", 1.5, 0, 0))
    low, high = np.min(tips, axis=0), np.max(tips, axis=0)
    assert 9.0 < high[0] < 10.5
    assert 8.5 < high[2] < 10.5
    assert -7.0 < low[2] < -5.5


@pytest.mark.parametrize(
    ("strokes_cm", "angles_deg", "x_cm", "z_cm"),
    [
        ((10.84, 10, 2.5), (54.4, -108.4, -1.0), 53.3, 9.3),
        ((6.5, 4.2, 1.2), (16.2, -66.1, 14.9), 75.7, -12.5),
    ],
)
def test_the_bench_excavator_stands_as_measured(
    strokes_cm: tuple[float, ...], angles_deg: tuple[float, ...], x_cm: float, z_cm: float
) -> None:
    arm = machine("bench")
    position = np.array([0.0, *strokes_cm]) / 100
    angles = [joint_value(j.drive, position[j.actuator]) for j in arm.arm.joints[1:]]
    np.testing.assert_allclose(np.degrees(angles), angles_deg, atol=0.06)
    arm.pose(position)
    np.testing.assert_allclose(100 * arm.point("bucket", 0.115, 0, 0), [x_cm, 0, z_cm], atol=0.06)


# ------------------------------------------------------------------ scenes


def test_a_good_cycle_keeps_out_of_every_margin() -> None:
    arm = machine("demo")
    for position in along_cycle(steps=6):
        for name, item in solids("demo").items():
            assert arm.clearance(item, position) > 0.05, (name, position)


def test_digging_reaches_below_the_ground() -> None:
    arm = machine("demo")
    arm.pose(CYCLE[1])
    assert arm.point("bucket", 1.5, 0, 0)[2] < -0.5


def test_swinging_too_far_at_the_heap_enters_the_margin_of_the_wall() -> None:
    late = CYCLE[3] + [0.40, 0, 0, 0]
    assert machine("demo").clearance(solids("demo")["wall"], late) < 0


def test_raising_the_stretched_arm_enters_the_margin_of_the_power_line() -> None:
    high = np.array([0.0, 1.10, 0.05, 0.20])
    assert machine("demo").clearance(solids("demo")["power-line"], high) < 0


@pytest.mark.private_data
@pytest.mark.parametrize("run", range(1, 6))
def test_recorded_runs_cross_the_zones_of_the_bench_now_and_then(run: int) -> None:
    if not LOGS.is_dir():
        pytest.skip("the private operator logs are not beside the checkout")
    arm = machine("bench")
    columns = ("Swing Ms", "Boom Ms", "Stick Ms", "Bucket Ms")
    with (LOGS / f"operator3_run{run}.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if all(r[c] for c in columns)]
    log = np.array([[float(r[c]) for c in columns] for r in rows]) * [1, 0.01, 0.01, 0.01]

    left, right = (o for o in arm.site.scene.objects if isinstance(o, ActuatorLimit))
    assert left.above is not None
    assert right.below is not None
    beyond = (log[:, 0] > left.above) | (log[:, 0] < right.below)
    assert 5 <= np.count_nonzero(np.diff(beyond.astype(int)) == 1) <= 30
    assert beyond.mean() < 0.75

    for name in ("crate", "ceiling"):
        inside = [arm.clearance(solids("bench")[name], q) < 0 for q in log[::8]]
        assert 0 < np.mean(inside) < 0.35, name
