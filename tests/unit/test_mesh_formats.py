"""COLLADA and glTF: all that is drawn is read where it is drawn, or the file is refused."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rampe_guard.collision import mesh_dae, mesh_limits
from rampe_guard.collision.mesh import load_mesh
from rampe_guard.collision.shape_cache import ShapeCache, load_shape
from rampe_guard.errors import GeometryError

CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset>{asset}</asset>
  <library_images><image id="i"><init_from>gone.png</init_from></image></library_images>
  <library_effects><effect id="e"><broken/></effect></library_effects>
  <library_materials>
    <material id="m"><instance_effect url="#nowhere"/></material>
  </library_materials>
  <library_geometries><geometry id="cube"><mesh>
    <source id="p"><float_array id="pa" count="24">{points}</float_array>
      <technique_common><accessor source="#pa" count="8" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    {primitives}
  </mesh></geometry></library_geometries>
  {nodes}
  <library_visual_scenes><visual_scene id="s">{scene}</visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""
INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
INSTANCE = (
    '<instance_geometry url="#cube"><bind_material><technique_common>'
    '<instance_material symbol="x" target="#gone"/></technique_common></bind_material>'
    "</instance_geometry>"
)


def numbers(rows: Any) -> str:
    return " ".join(str(x) for row in rows for x in row)


POLYGONS = {
    "triangles": f'<triangles count="12">{INPUT}<p>{numbers(TRIANGLES)}</p></triangles>',
    "polylist": f'<polylist count="6">{INPUT}<vcount>4 4 4 4 4 4</vcount>'
    f"<p>{numbers(QUADS)}</p></polylist>",
    "polygons": f'<polygons count="6">{INPUT}'
    + "".join(f"<p>{numbers([quad])}</p>" for quad in QUADS)
    + "</polygons>",
    "tristrips": f'<tristrips count="6">{INPUT}'
    + "".join(f"<p>{a} {b} {d} {c}</p>" for a, b, c, d in QUADS)
    + "</tristrips>",
    "trifans": f'<trifans count="6">{INPUT}'
    + "".join(f"<p>{numbers([quad])}</p>" for quad in QUADS)
    + "</trifans>",
}


def dae(folder: Path, **parts: str) -> Path:
    given = {
        "asset": '<unit meter="1"/><up_axis>Z_UP</up_axis>',
        "points": numbers(CUBE),
        "primitives": POLYGONS["triangles"],
        "nodes": "",
        "scene": f"<node>{INSTANCE}</node>",
        **parts,
    }
    path = folder / "a.dae"
    path.write_text(DAE.format(**given))
    return path


def box(path: Path) -> tuple[list[float], list[float]]:
    mesh = load_mesh(path)
    return mesh.vertices.min(axis=0).tolist(), mesh.vertices.max(axis=0).tolist()


@pytest.mark.parametrize("kind", POLYGONS)
def test_polygons_of_every_kind_are_read(tmp_path: Path, kind: str) -> None:
    mesh = load_mesh(dae(tmp_path, primitives=POLYGONS[kind]))
    assert len(mesh.faces) == 12
    assert mesh.is_watertight()
    assert abs(mesh.parts().volume[0]) == pytest.approx(1.0)
    assert mesh.notes == ()


def test_nodes_move_turn_scale_and_stand_for_others(tmp_path: Path) -> None:
    scene = (
        "<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate>"
        f"<node><scale>2 1 1</scale>{INSTANCE}</node></node>"
        '<node><matrix>1 0 0 0 0 1 0 5 0 0 -1 0 0 0 0 1</matrix><instance_node url="#n"/></node>'
    )
    nodes = f'<library_nodes><node id="n">{INSTANCE}</node></library_nodes>'
    low, high = box(dae(tmp_path, scene=scene, nodes=nodes))
    # the first is turned to -1..0 along x and 0..2 along y, the second mirrored below
    assert low == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
    assert high == pytest.approx([10.0, 6.0, 1.0])


@pytest.mark.parametrize("axis", ["Y_UP", "X_UP"])
def test_axes_stand_as_they_are_drawn_and_the_unit_counts(tmp_path: Path, axis: str) -> None:
    asset = f'<unit name="inch" meter="0.0254"/><up_axis>{axis}</up_axis>'
    path = dae(tmp_path, asset=asset, scene=f"<node><scale>1 2 3</scale>{INSTANCE}</node>")
    assert box(path)[1] == pytest.approx([0.0254, 0.0508, 0.0762])
    said, unit = load_mesh(path).notes
    assert f"its axes are taken as they stand, as by the tools of ROS, not as its '{axis}'" in said
    assert "the file's unit is 0.0254 m" in unit


HOLE = f'<polygons count="1">{INPUT}<ph><p>0 1 3</p><h>4 5 7</h></ph></polygons>'


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"scene": '<node><instance_controller url="#skin"/></node>'}, "has a skin or a morph"),
        ({"primitives": HOLE}, "has polygons with holes"),
        ({"scene": '<node><instance_geometry url="#gone"/></node>'}, "cannot be read whole"),
        ({"scene": '<node><instance_node url="#gone"/></node>'}, "cannot be read whole"),
        ({"scene": f"<node><skew>1 0 0 0 1 0 0</skew>{INSTANCE}</node>"}, "cannot be read whole"),
        ({"primitives": POLYGONS["triangles"].replace("#v", "#w")}, "cannot be read whole"),
        ({"primitives": f'<triangles count="1">{INPUT}<p>0 1 99</p></triangles>'}, "limits of"),
        ({"primitives": f'<triangles count="1">{INPUT}<p>0 1 x</p></triangles>'}, "read whole"),
        ({"scene": ""}, "no triangles"),
    ],
)
def test_a_broken_part_is_no_hole_in_the_arm(
    tmp_path: Path, parts: dict[str, str], words: str
) -> None:
    with pytest.raises(GeometryError, match=words) as caught:
        load_mesh(dae(tmp_path, **parts))
    assert str(caught.value).startswith(f"{tmp_path}/a.dae: ")


def test_few_nodes_do_not_stand_for_any_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doubled = "".join(
        f'<node id="n{i}"><instance_node url="#n{i - 1}"/><instance_node url="#n{i - 1}"/></node>'
        for i in range(1, 40)
    )
    nodes = f'<library_nodes><node id="n0">{INSTANCE}</node>{doubled}</library_nodes>'
    path = dae(tmp_path, nodes=nodes, scene='<node><instance_node url="#n39"/></node>')
    with pytest.raises(GeometryError, match="more than 100000 nodes"):
        load_mesh(path)
    monkeypatch.setattr(mesh_dae, "MAX_NODES", 10**9)
    monkeypatch.setattr(mesh_limits, "MAX_TRIANGLES", 1000)
    with pytest.raises(GeometryError, match=r"its scene: .* more than 1000 are refused"):
        load_mesh(path)


def gltf() -> dict[str, Any]:
    """A cube in a file beside, turned, moved and scaled by its nodes."""
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 96, "uri": "parts/points.bin"}, {"byteLength": 36}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 1, "byteLength": 36},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [
            {"children": [1], "translation": [10, 0, 0], "rotation": [0, 0, 0.5**0.5, 0.5**0.5]},
            {"mesh": 0, "scale": [2, 1, 1]},
        ],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }


def gltf_file(folder: Path, change: Callable[[dict[str, Any]], object] = len) -> Path:
    content = gltf()
    inline = base64.b64encode(bytes(x for t in TRIANGLES for x in t)).decode()
    content["buffers"][1]["uri"] = f"data:application/octet-stream;base64,{inline}"
    change(content)
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "points.bin").write_bytes(np.array(CUBE, "<f4").tobytes())
    path = folder / "a.gltf"
    path.write_text(json.dumps(content))
    return path


def test_a_gltf_is_read_with_its_buffers_and_nodes(tmp_path: Path) -> None:
    path = gltf_file(tmp_path)
    assert len(load_mesh(path).faces) == 12
    low, high = box(path)
    assert low == pytest.approx([9.0, 0.0, 0.0])
    assert high == pytest.approx([10.0, 2.0, 1.0])
    spaced = gltf_file(tmp_path, lambda g: g["buffers"][0].update(uri="parts/po%69nts.bin"))
    assert box(spaced)[1] == pytest.approx([10.0, 2.0, 1.0])


def test_a_kept_shape_is_not_that_of_other_buffers(tmp_path: Path) -> None:
    path, cache = gltf_file(tmp_path), ShapeCache(tmp_path / "cache")
    before = load_shape(path, cache=cache)
    (tmp_path / "parts" / "points.bin").write_bytes((2.0 * np.array(CUBE, "<f4")).tobytes())
    assert load_shape(path, cache=cache).extent_m == pytest.approx(2.0 * before.extent_m)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda g: g.update(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco"),
        (lambda g: g["accessors"][0].update(sparse={"count": 1}), "stored sparsely"),
        (lambda g: g["accessors"][0].pop("bufferView"), "stored sparsely"),
        (lambda g: g["accessors"][0].update(componentType=5122), "quantized positions"),
        (lambda g: g["meshes"][0]["primitives"][0].update(mode=6), "triangle fans"),
        (lambda g: g["meshes"][0].update(weights=[0.5]), "a morphed mesh"),
        (lambda g: g["nodes"][1].update(weights=[0.5]), "a morphed mesh"),
        (lambda g: g["nodes"][1].update(skin=0), "a skinned mesh"),
        (lambda g: g["nodes"][0].update(camera=0), "below a camera"),
        (
            lambda g: g["nodes"][1].update(extensions={"EXT_mesh_gpu_instancing": {}}),
            "copies of a mesh",
        ),
        (lambda g: g["buffers"][0].update(uri="gone.bin"), "gone.bin cannot be read"),
        (lambda g: g["scenes"][0].update(nodes=[]), "no triangles"),
    ],
)
def test_what_a_reader_would_leave_out_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], words: str
) -> None:
    with pytest.raises(GeometryError, match=words) as caught:
        load_mesh(gltf_file(tmp_path, change))
    assert str(caught.value).startswith(f"{tmp_path}/a.gltf: ")
