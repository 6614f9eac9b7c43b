"""A scene in the browser: its meshes are sent once, then only where they are."""

from typing import Any

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.view.geometry import Colour, in_bytes
from excite_cli.view.instants import Instants
from excite_cli.view.scene import Scene
from excite_cli.view.studio import BOX_COLOUR
from excite_cli.view.surface import Surface
from excite_cli.view.translucent import (
    CAPSULE,
    NEAREST,
    REGION,
    WALL,
    region_surface,
    wall_surface,
)

_INK: Colour = (0.13, 0.15, 0.18)
_LIFTED = 0.003  # [m]


class SceneNodes:
    """Nodes of `scene` on a viser server; `show` moves them."""

    def __init__(self, server: Any, scene: Scene) -> None:
        self._scene, self._api = scene, server.scene
        self._near: set[int] = set()
        unit = scene.size / 100
        self._frames: dict[str, dict[int, Any]] = {"robot": {}, "capsules": {}}
        for number, body in enumerate(scene.bodies):
            parent = self._frame("robot", body.joint)
            self._mesh(f"{parent}/{number}", body.surface, body.colour)
        self.capsules = self._api.add_frame("/capsules", show_axes=False)
        self._capsules = [
            self._mesh(f"{self._frame('capsules', capsule.joint)}/{number}", surface, CAPSULE, 0.16)
            for number, (capsule, surface) in enumerate(
                zip(scene.capsules, scene.capsule_surfaces, strict=True)
            )
        ]
        self._surroundings()
        self.distance = self._api.add_frame("/distance", show_axes=False)
        self._line = self._segment("/distance/line", NEAREST, 3.0)
        self._ends = [self._ball(f"/distance/end{k}", 0.35 * unit, NEAREST) for k in range(2)]
        self._value = self._api.add_label("/distance/value", "", anchor="bottom-left")
        self.mass = self._api.add_frame("/mass", show_axes=False)
        self._center = self._ball("/mass/center", 1.0 * unit, _INK)
        self._plumb = self._segment("/mass/plumb", _INK, 2.0)
        self._foot = self._ball("/mass/foot", 0.5 * unit, REGION)
        self._zmp = self._ball("/mass/zero_moment_point", 0.6 * unit, NEAREST)

    @property
    def balanced(self) -> bool:
        """Whether the centre of mass, or the zero-moment point, is kept in a region."""
        return self._scene.region is not None

    def show(self, instants: Instants, instant: int) -> None:
        """Everything where it is at an instant."""
        for group in self._frames.values():
            for joint, frame in group.items():
                frame.position = instants.poses.translations[instant, joint]
                frame.wxyz = _quaternion(instants.poses.rotations[instant, joint])
        self._show_nearest(instants, instant)
        self._show_mass(instants, instant)

    def _show_nearest(self, instants: Instants, instant: int) -> None:
        nearest = instants.nearest
        if nearest is None:
            self.distance.visible = False
            return
        ends = nearest.ends[instant]
        self._line.points = ends[None].astype(np.float32)
        for ball, end in zip(self._ends, ends, strict=True):
            ball.position = end
        self._value.position = ends.mean(axis=0)
        self._value.text = f"{1000 * nearest.distances[instant]:.0f} mm"
        at = nearest.capsules[instant]
        near = {k for k, capsule in enumerate(self._scene.capsules) if capsule in at}
        if near != self._near:
            for index in near ^ self._near:
                self._capsules[index].color = in_bytes(NEAREST if index in near else CAPSULE)
            self._near = near

    def _show_mass(self, instants: Instants, instant: int) -> None:
        region = self._scene.region
        height = self._scene.ground if region is None else region.height
        center = instants.mass[instant]
        foot = np.array([center[0], center[1], height + _LIFTED])
        self._center.position, self._foot.position = center, foot
        self._plumb.points = np.stack([center, foot])[None].astype(np.float32)
        zmp = None if instants.zmp is None else instants.zmp[instant]
        seen = zmp is not None and bool(np.isfinite(zmp).all())
        self._zmp.visible = seen
        if seen and zmp is not None:
            self._zmp.position = np.array([zmp[0], zmp[1], height + _LIFTED])

    def _surroundings(self) -> None:
        scene = self._scene
        self._api.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(226, 229, 233),
            section_color=(196, 201, 208),
            fade_distance=4 * scene.size,
            shadow_opacity=0.25,
            position=(0.0, 0.0, scene.ground - _LIFTED),
        )
        self.ground = self._api.add_label(
            "/ground/words", scene.ground_words, position=(*scene.low[:2], scene.ground)
        )
        for name, surface in scene.boxes:
            self._mesh(f"/around/{name}", surface, BOX_COLOUR)
        for wall in scene.walls:
            self._mesh(f"/around/{wall.name}", wall_surface(wall, scene), WALL, 0.2)
        if scene.region is not None:
            self._mesh("/mass/region", region_surface(scene.region), REGION, 0.5)
        for number, point in enumerate(scene.contacts):
            ball = self._ball(f"/contact/{number}", scene.size / 250, REGION)
            ball.position = point

    def _frame(self, group: str, joint: int) -> str:
        name = f"/{group}/{joint}"
        if joint not in self._frames[group]:
            self._frames[group][joint] = self._api.add_frame(name, show_axes=False)
        return name

    def _mesh(
        self, name: str, surface: Surface, colour: Colour, opacity: float | None = None
    ) -> Any:
        return self._api.add_mesh_simple(
            name,
            surface.points.astype(np.float32),
            surface.faces.astype(np.uint32),
            color=in_bytes(colour),
            opacity=opacity,
            side="double",
            cast_shadow=opacity is None,
            receive_shadow=opacity is None,
        )

    def _ball(self, name: str, radius: float, colour: Colour) -> Any:
        return self._api.add_icosphere(
            name, radius=radius, color=in_bytes(colour), cast_shadow=False
        )

    def _segment(self, name: str, colour: Colour, width: float) -> Any:
        return self._api.add_line_segments(
            name, np.zeros((1, 2, 3), dtype=np.float32), in_bytes(colour), thickness=width,
            thickness_units="screen",
        )  # fmt: skip


def _quaternion(rotation: Array) -> Array:
    """w, x, y, z of a rotation (3, 3), by the largest of the four (Shepperd)."""
    m = rotation
    squares = np.array(
        [
            1 + m[0, 0] + m[1, 1] + m[2, 2],
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    largest = int(np.argmax(squares))
    a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    d, e, f = m[1, 0] + m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2]
    rows = np.array(
        [
            [squares[0], a, b, c],
            [a, squares[1], d, e],
            [b, d, squares[2], f],
            [c, e, f, squares[3]],
        ]
    )
    return np.asarray(rows[largest] / np.linalg.norm(rows[largest]))
