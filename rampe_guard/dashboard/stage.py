"""The scene of one page: made once, then only moved and coloured.

Each node remembers what it shows, so what did not change is not sent again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from rampe_guard.core.types import FloatArray
from rampe_guard.dashboard.ghosts import INTENT, NEXT, STOPPING
from rampe_guard.dashboard.model import Model
from rampe_guard.dashboard.picture import Contact, Picture, Zone
from rampe_guard.dashboard.solids import Solid, Triangles
from rampe_guard.dashboard.tones import Rgb, Tone

_ARM: Rgb = (86, 112, 138)
_ARM_STALE: Rgb = (98, 98, 98)
_FLAT: dict[bool, Rgb] = {True: (74, 72, 67), False: (150, 147, 138)}
"""Of ground and walls, by night and by day: the rest must stand out before it."""
_FLAT_LOST: dict[bool, Rgb] = {True: (40, 40, 40), False: (128, 128, 128)}
_INTENT: Rgb = (79, 143, 208)
_STOPPING: Rgb = (176, 124, 216)
_NEXT: Rgb = (196, 164, 140)
_SEE_THROUGH = 0.22
_FAINT = 0.14
_SHELL = 0.10
_SHEER = 0.15
_GHOST_S = 0.08
"""Ghosts move less often than the arm: they are many, and only hints [s]."""


class Node:
    """A node of the scene that is told only of what is new."""

    def __init__(self, handle: Any) -> None:
        self._handle = handle
        self._shown: dict[str, Any] = {}

    def put(self, **wanted: Any) -> None:
        """Set properties that differ from what is shown."""
        for name, value in wanted.items():
            before = self._shown.get(name)
            if isinstance(before, np.ndarray) and isinstance(value, np.ndarray):
                if np.array_equal(before, value):
                    continue
            elif name in self._shown and before == value:
                continue
            self._shown[name] = value
            setattr(self._handle, name, value)

    def pose(self, pose: FloatArray) -> None:
        """Place it: (4, 4) [m]; float noise is no motion."""
        wxyz = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)
        self.put(position=np.round(pose[:3, 3], 5), wxyz=np.round(wxyz, 6))


@dataclass(frozen=True, slots=True)
class _ZoneNodes:
    solid: Solid
    frame: Node
    body: Node
    shell: Node | None
    label: Node


class Stage:
    """The machine in the scene of one client.

    Args:
        client: of viser.
        model: what is drawn.
    """

    def __init__(self, client: viser.ClientHandle, model: Model) -> None:
        self._scene = client.scene
        self._model = model
        self._ghosts_s = -np.inf
        # no reflections, no shadows: a tablet, or a machine without a graphics card, draws it
        # fifty times as fast
        self._scene.configure_environment_map(None)
        self._scene.configure_default_lights(enabled=False)
        self._scene.add_light_hemisphere(
            "/light/sky", sky_color=(255, 255, 255), ground_color=(120, 116, 110), intensity=1.6
        )
        for name, intensity, way in (("sun", 1.6, (-0.5, -1.0, 1.6)), ("back", 0.5, (1, 0.6, 0.8))):
            self._scene.add_light_directional(
                f"/light/{name}", intensity=intensity, position=way, cast_shadow=False
            )
        self._zones = [self._zone(solid) for solid in model.solids]
        self._links = [self._link(i) for i in range(len(model.bodies))]
        self._intent = self._ghosts("intent", INTENT, _INTENT)
        self._stopping = self._ghosts("stopping", STOPPING, _STOPPING)
        self._next = self._ghosts("next", NEXT, _NEXT, _FAINT)
        size = 0.02 * model.reach_m
        self._ball = Node(self._scene.add_icosphere("/contact", size, visible=False))
        self._words = Node(
            self._scene.add_label(
                "/contact/label",
                "",
                position=(0.0, 0.0, 2.0 * size),
                font_screen_scale=1.3,
                anchor="bottom-center",
            )
        )
        self._look_from(client)

    def show(self, picture: Picture, *, night: bool) -> None:
        """Bring the scene up to date."""
        for nodes, zone in zip(self._zones, picture.zones, strict=True):
            self._show_zone(nodes, zone, night=night)
        self._show_arm(picture)
        if picture.now_s - self._ghosts_s >= _GHOST_S:
            self._ghosts_s = picture.now_s
            self._show_ghosts(self._intent, picture.intent)
            self._show_ghosts(self._stopping, picture.stopping)
            self._show_ghosts(self._next, picture.next)
        self._show_contact(picture.contact)

    def clear(self) -> None:
        """Take everything off the page."""
        self._scene.reset()

    def _look_from(self, client: viser.ClientHandle) -> None:
        middle, reach = self._model.middle, self._model.reach_m
        client.camera.position = middle + reach * np.array([-0.66, -1.0, 0.72])
        client.camera.look_at = middle + reach * np.array([0.28, 0.10, 0.16])  # it moves with it

    def _zone(self, solid: Solid) -> _ZoneNodes:
        path = f"/zones/{solid.name}"
        frame = self._scene.add_frame(path, show_axes=False)
        body = self._mesh(f"{path}/body", solid.body, shade=not solid.flat)
        if solid.sheer:
            body.put(opacity=_SHEER)
        shell = None
        if solid.shell is not None:
            shell = Node(
                self._scene.add_mesh_simple(
                    f"{path}/shell",
                    *_arrays(solid.shell),
                    opacity=_SHELL,
                    side="double",
                    cast_shadow=False,
                    receive_shadow=False,
                )
            )
        label = self._scene.add_label(
            f"{path}/label", solid.name, position=solid.top, anchor="bottom-center"
        )
        return _ZoneNodes(solid, Node(frame), body, shell, Node(label))

    def _link(self, index: int) -> Node | None:
        body = self._model.bodies[index]
        if body is None:
            return None
        name = self._model.arm.link_names[index]
        node = self._mesh(f"/arm/{name}", body, shade=True)
        node.put(visible=False)
        return node

    def _mesh(self, path: str, body: Triangles, *, shade: bool) -> Node:
        handle = self._scene.add_mesh_simple(
            path,
            *_arrays(body),
            flat_shading=shade,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        return Node(handle)

    def _ghosts(
        self, name: str, count: int, colour: Rgb, opacity: float = _SEE_THROUGH
    ) -> list[tuple[int, Node]]:
        nodes = []
        for index, body in enumerate(self._model.bodies):
            if body is None or not self._model.moving[index]:
                continue
            handle = self._scene.add_batched_meshes_simple(
                f"/{name}/{self._model.arm.link_names[index]}",
                *_arrays(body),
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
                batched_positions=np.zeros((count, 3)),
                batched_colors=colour,
                opacity=opacity,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
            nodes.append((index, Node(handle)))
        return nodes

    def _show_zone(self, nodes: _ZoneNodes, zone: Zone, *, night: bool) -> None:
        if zone.pose is not None:
            nodes.frame.pose(zone.pose)
        placed = zone.known or zone.pose is not None
        nodes.frame.put(visible=placed)
        colour = zone.tone.colour(lit=zone.lit)
        calm = zone.tone in {Tone.CALM, Tone.LOST}
        if calm and nodes.solid.flat:
            colour = (_FLAT_LOST if zone.tone is Tone.LOST else _FLAT)[night]
        nodes.body.put(color=colour, wireframe=not zone.known)
        if nodes.shell is not None:
            nodes.shell.put(color=colour, visible=zone.tone is not Tone.LOST)
        nodes.label.put(
            text=zone.label,
            font_screen_scale=1.1 if calm else 1.7,
            visible=not (calm and nodes.solid.flat and zone.known),
        )

    def _show_arm(self, picture: Picture) -> None:
        for index, node in enumerate(self._links):
            if node is None or picture.links is None:
                continue
            tone = picture.link_tones[index]
            colour = _ARM if tone is Tone.CALM else tone.look.lit
            if picture.lost or picture.stale:
                colour = _ARM_STALE
            node.pose(picture.links[index])
            node.put(color=colour, opacity=0.55 if picture.stale else None, visible=True)

    def _show_ghosts(self, nodes: list[tuple[int, Node]], poses: FloatArray | None) -> None:
        for index, node in nodes:
            node.put(visible=poses is not None)
            if poses is None:
                continue
            turns = Rotation.from_matrix(poses[:, index, :3, :3]).as_quat(scalar_first=True)
            node.put(
                batched_positions=np.round(poses[:, index, :3, 3], 4).astype(np.float32),
                batched_wxyzs=np.round(turns, 5).astype(np.float32),
            )

    def _show_contact(self, contact: Contact | None) -> None:
        self._ball.put(visible=contact is not None)
        if contact is not None:
            self._ball.put(
                position=np.round(np.array(contact.point), 4),
                color=contact.tone.colour(lit=contact.lit),
            )
            self._words.put(text=contact.label)


def _arrays(body: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces as viser sends them."""
    return body.vertices.astype(np.float32), body.faces.astype(np.uint32)
